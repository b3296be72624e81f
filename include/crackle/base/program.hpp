/// What crackle's programs have in common at their beginning and their end.
#pragma once

#include <functional>
#include <string>

namespace crackle {

/// "crackle 0.1.0", and the versions of what it is built with: -version, --version, -V.
[[nodiscard]] std::string version_text(const std::string& program);

/// Runs work() to the program's exit status. -version is answered here; -h and --help become -help. Prints an exception on
/// one line on stderr, as "<program>: ...", status 1. A standard output that could not be written (a full disk) is one,
/// too.
int run_program(const std::string& program, int argc, char** argv, const std::function<int()>& work);

/// The same within PETSc, whose options have been looked through before. help: the text of -help.
int run_solver_program(const std::string& program, int argc, char** argv,
                       const std::function<std::string()>& help, const std::function<int()>& work);

/// One line on stderr where the folder of an output's shards could not go, since somebody has put something into it.
void tell_what_stays(const std::string& program, const std::string& output);

}  // namespace crackle
