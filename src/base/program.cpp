#include "crackle/base/program.hpp"

#include <cholmod.h>
#include <hdf5.h>
#include <metis.h>
#include <petscversion.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <span>

#include "crackle/base/durable_file.hpp"
#include "crackle/base/error.hpp"
#include "crackle/base/option_files.hpp"
#include "crackle/base/output_lock.hpp"
#include "crackle/base/petsc_handle.hpp"
#include "crackle/base/version.hpp"

namespace crackle {

namespace {

bool is_among(const std::string& word, std::span<const char* const> words) {
  return std::ranges::find(words, word, [](const char* one) { return std::string(one); }) != words.end();
}

std::string dotted(std::initializer_list<int> numbers) {
  std::string text;
  for (const int number : numbers) text += (text.empty() ? "" : ".") + std::to_string(number);
  return text;
}

/// Whether a word of the command line asks for it.
bool wants_version(int argc, char** argv) {
  constexpr std::array kWords = {"-version", "--version", "-V"};
  return std::any_of(argv + 1, argv + argc, [&](const char* word) { return is_among(word, kWords); });
}

/// PETSc knows -help.
void unify_help(int argc, char** argv) {
  static std::array<char, 6> help{"-help"};
  constexpr std::array kWords = {"-h", "--help"};
  for (int i = 1; i < argc; ++i) {
    if (is_among(argv[i], kWords)) argv[i] = help.data();
  }
}

/// Returns 1.
int complain(const std::string& program, const std::exception& error) {
  std::fflush(stdout);
  std::fprintf(stderr, "%s: %s\n", program.c_str(), one_line(explain(error)).c_str());
  return 1;
}

}  // namespace

std::string version_text(const std::string& program) {
  return program + " " + kVersion + "\nPETSc " +
         dotted({PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR, PETSC_VERSION_SUBMINOR}) + ", HDF5 " +
         dotted({H5_VERS_MAJOR, H5_VERS_MINOR, H5_VERS_RELEASE}) + ", CHOLMOD " +
         dotted({CHOLMOD_MAIN_VERSION, CHOLMOD_SUB_VERSION, CHOLMOD_SUBSUB_VERSION}) + ", METIS " +
         dotted({METIS_VER_MAJOR, METIS_VER_MINOR, METIS_VER_SUBMINOR}) +
         "\nGNU General Public License, version 3 or later\n";
}

int run_program(const std::string& program, int argc, char** argv, const std::function<int()>& work) {
  int status = 0;
  try {
    if (wants_version(argc, argv)) {
      std::printf("%s", version_text(program).c_str());
    } else {
      unify_help(argc, argv);
      status = work();
    }
  } catch (const std::exception& error) {
    return complain(program, error);
  }
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;
  return complain(program, WriteError("standard output", "not all of it has arrived"));
}

int run_solver_program(const std::string& program, int argc, char** argv,
                       const std::function<std::string()>& help, const std::function<int()>& work) {
  return run_program(program, argc, argv, [&] {
    check_options(argc, argv);
    const std::string text = help();
    const petsc::Session session(argc, argv, text.c_str());
    try {
      return work();
    } catch (const std::exception& error) {
      return session.first() ? complain(program, with_place(error)) : 1;
    }
  });
}

void tell_what_stays(const std::string& program, const std::string& output) {
  const std::string place = follow_links(output);
  const std::string stranger = stranger_beside(place);
  if (stranger.empty()) return;
  const std::string text = shard_folder(place) + " stays: " + stranger + " in it is of no run";
  std::fprintf(stderr, "%s: %s\n", program.c_str(), one_line(text).c_str());
}

}  // namespace crackle
