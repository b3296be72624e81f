/// The options by name: what -help says of each, and what a name on the command line can be.
#pragma once

#include <map>
#include <string>

namespace crackle {

/// Largest L of a generated lattice: its 3L^2 bonds and 4L^2 entries of b_e are counted in 32 bits.
inline constexpr int kLargestSize = 8192;

struct OptionText {
  const char* name;      ///< "-lattice_size"
  const char* standard;  ///< default, as one would type it; "" for none
  const char* allowed;   ///< "an integer from 1"
  const char* meaning;   ///< one line
  bool decides;          ///< another value gives other results
};

/// The option of that name; it must be one of ours.
[[nodiscard]] const OptionText& find_option(const std::string& name);

/// The text of -help, of crackle or of crackle_compare.
[[nodiscard]] std::string format_help(bool comparison);

/// "-name" or "--name", not a negative number.
[[nodiscard]] bool looks_like_option(const std::string& word);

/// -ksp_..., -pc_..., -mat_...
[[nodiscard]] bool reaches_solver(const std::string& name);

/// The solver's options that were given, -name to value; names in lower case.
[[nodiscard]] std::map<std::string, std::string> solver_options();

/// "-name value" of the first of them whose value is a word of `message`; empty when none is.
[[nodiscard]] std::string option_named_in(const std::string& message);

/// True for our options that decide what a run file holds, and for the solver's but for those that only look.
[[nodiscard]] bool decides_results(const std::string& name);

/// Options of two runs ("-name value" a line) that decide results and differ: "-seed 2 (the file has 1)",
/// with commas between; empty when the two may be one run. The kernels of `tree` count where both name them.
[[nodiscard]] std::string differing_options(const std::string& ours, const std::string& theirs);

/// Throws InputError for a word on the command line that is neither option nor value: PETSc would skip it.
void reject_stray_words();

/// Throws InputError for the first option that nobody has asked for: misspelt, or of no use in this scene.
/// Call it once the solver has read its own.
void reject_unused_options();

}  // namespace crackle
