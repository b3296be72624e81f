/// PETSc's database of options: what was given, whoever reads it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace crackle {

/// "-name" or "--name", not a negative number; as PETSc sees it, -inf and -nan are numbers.
[[nodiscard]] bool looks_like_option(const std::string& word);

/// -ksp_..., -pc_..., -mat_...
[[nodiscard]] bool reaches_solver(const std::string& name);

[[nodiscard]] bool is_given(const char* name);

/// The whole text of an option's value, of any length ("" without one); nothing when it isn't given.
[[nodiscard]] std::optional<std::string> given_value(const char* name);

/// All options that were given, -name to value; names in lower case.
[[nodiscard]] std::map<std::string, std::string> given_values();

/// The solver's options that were given, -name to value; names in lower case.
[[nodiscard]] std::map<std::string, std::string> solver_options();

/// "-name value" of the first of them whose value is a word of `message`; empty when none is.
[[nodiscard]] std::string option_named_in(const std::string& message);

/// Name and value of the first option that nobody has asked for, those aside that PETSc looks at late. Call it once the
/// solver has read its own.
[[nodiscard]] std::optional<std::pair<std::string, std::string>> unused_option();

/// Throws InputError for a word on the command line that is neither option nor value: PETSc would skip it.
void reject_stray_words();

/// What stands between the commas.
[[nodiscard]] std::vector<std::string> split(const std::string& list);

}  // namespace crackle
