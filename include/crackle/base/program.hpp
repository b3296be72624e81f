/// What crackle's programs have in common at their beginning and their end.
#pragma once

#include <exception>
#include <functional>
#include <string>

namespace crackle {

/// "crackle 0.1.0", and the versions of what it is built with.
[[nodiscard]] std::string version_text(const std::string& program);

/// Whether a word of the command line asks for it: -version, --version, -V.
[[nodiscard]] bool wants_version(int argc, char** argv);

/// -h and --help become -help, which PETSc knows, too.
void unify_help(int argc, char** argv);

/// Runs work() to the program's exit status. Prints an exception on one line on stderr, as "<program>: ...", status 1. A
/// standard output that could not be written (a full disk) is one, too.
int run_program(const std::string& program, const std::function<int()>& work);

/// Prints it so, and returns 1.
int complain(const std::string& program, const std::exception& error);

/// One line on stderr where the folder of an output's shards could not go, since somebody has put something into it.
void tell_what_stays(const std::string& program, const std::string& output);

}  // namespace crackle
