/// Where options come from: ~/.petscrc, .petscrc and petscrc, PETSC_OPTIONS, files of options, the command line.
///
/// PETSc takes them in that order, the last one counts. It skips words that it can't place, cuts values at a quote, and
/// a file that includes itself ends in a crash: so they are looked through before it starts.
#pragma once

#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

namespace crackle {

/// One option as it was given.
struct GivenOption {
  std::string name;   ///< "-seed", in lower case
  std::string value;  ///< "" without one
  std::string place;  ///< "options file .petscrc, line 3", "PETSC_OPTIONS"; "" on the command line
  bool asked = true;  ///< on the command line, or in a file that it names
};

/// All options that were given, in the order in which PETSc takes them; those of YAML files aside, which PETSc reads.
///
/// A file has an option a line: "-name value" or "-name"; a value with spaces stands between "; what follows a # is a
/// comment; "-options_file NAME" includes another; "alias -new -old". Throws InputError, naming file and line, for
/// anything else, for a file that is no text (a byte order mark, zeros), is missing or includes itself; and for a word
/// of PETSC_OPTIONS that is neither option nor value.
[[nodiscard]] std::vector<GivenOption> given_options(int argc, char* const* argv);

/// The same of one file.
[[nodiscard]] std::vector<GivenOption> options_in_file(const std::string& file);

/// given_options of PETSc's arguments, in a session.
[[nodiscard]] std::vector<GivenOption> given_options();

/// Looks through them before PETSc does, in the process that reads them. Throws as given_options does, and for more
/// options, aliases or files than PETSc's tables and stack hold.
void check_options(int argc, char* const* argv);

/// A message that begins with an option, and where that was given, when it wasn't on the command line.
[[nodiscard]] std::runtime_error with_place(const std::exception& error);

}  // namespace crackle
