#include "crackle/base/option_database.hpp"

#include <petscsys.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <sstream>

#include "crackle/base/error.hpp"
#include "crackle/base/petsc_handle.hpp"

namespace crackle {

namespace {

/// PETSc looks at these in its first solve, when it ends, or never where they are already obeyed.
constexpr std::array kLateOptions = {"ksp_converged_reason",
                                     "ksp_converged_rate",
                                     "options_left",
                                     "options_view",
                                     "options_monitor",
                                     "objects_dump",
                                     "malloc",
                                     "malloc_debug",
                                     "malloc_dump",
                                     "malloc_view",
                                     "malloc_view_threshold",
                                     "malloc_test",
                                     "memory_view",
                                     "log_view",
                                     "log_view_memory",
                                     "log_view_gpu_time",
                                     "log_all",
                                     "log",
                                     "log_exclude",
                                     "log_sync",
                                     "log_trace",
                                     "info",
                                     "info_exclude",
                                     "history",
                                     "get_total_flops",
                                     "check_stack",
                                     "on_error_abort",
                                     "on_error_mpiabort",
                                     "on_error_attach_debugger",
                                     "start_in_debugger",
                                     "debugger_nodes",
                                     "debugger_ranks",
                                     "no_signal_handler",
                                     "fp_trap",
                                     "skip_petscrc",
                                     "help",
                                     "version",
                                     "error_output_none",
                                     "error_output_stdout",
                                     "check_pointer_intensity"};

bool is_late(const std::string& bare_name) {
  return std::ranges::find(kLateOptions, bare_name) != kLateOptions.end();
}

}  // namespace

bool looks_like_option(const std::string& word) {
  if (word.size() < 2 || word[0] != '-') return false;
  const char first = word[1] == '-' && word.size() > 2 ? word[2] : word[1];
  char* end = nullptr;
  (void)std::strtod(word.c_str(), &end);
  const bool number =
      end != word.c_str() && *end != '_' && std::isalnum(static_cast<unsigned char>(*end)) == 0;
  return !number && std::isalpha(static_cast<unsigned char>(first)) != 0;
}

bool reaches_solver(const std::string& name) {
  return name.starts_with("-ksp_") || name.starts_with("-pc_") || name.starts_with("-mat_");
}

bool is_given(const char* name) {
  PetscBool set = PETSC_FALSE;
  petsc::check(PetscOptionsHasName(nullptr, nullptr, name, &set));
  return set == PETSC_TRUE;
}

std::optional<std::string> given_value(const char* name) {
  const char* value = nullptr;  // the whole text: a copy would have to have a length
  PetscBool set = PETSC_FALSE;
  petsc::check(PetscOptionsFindPair(nullptr, nullptr, name, &value, &set));
  if (set != PETSC_TRUE) return std::nullopt;
  return value == nullptr ? "" : value;
}

std::map<std::string, std::string> given_values() {
  char* text = nullptr;
  petsc::check(PetscOptionsGetAll(nullptr, &text));
  std::istringstream stream(text);
  petsc::check(PetscFree(text));
  std::map<std::string, std::string> options;
  std::string name;
  for (std::string word; stream >> word;) {
    if (looks_like_option(word)) {
      // PETSc takes no notice of case
      std::ranges::transform(word, word.begin(),
                             [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      name = word;
      options[name] = "";
    } else if (!name.empty()) {
      options[name].append(options[name].empty() ? "" : " ").append(word);
    }
  }
  return options;
}

std::map<std::string, std::string> solver_options() {
  auto options = given_values();
  std::erase_if(options, [](const auto& option) { return !reaches_solver(option.first); });
  return options;
}

std::string option_named_in(const std::string& message) {
  std::istringstream words(message);
  for (std::string word; words >> word;) {
    for (const auto& [name, value] : solver_options()) {
      if (word == value) return std::string(name).append(" ").append(value);
    }
  }
  return "";
}

void reject_stray_words() {
  int count = 0;
  char** words = nullptr;
  petsc::check(PetscGetArgs(&count, &words));
  for (int i = 1; i < count; ++i) {
    if (looks_like_option(words[i])) continue;
    const bool is_value = i > 1 && looks_like_option(words[i - 1]);
    if (!is_value)
      throw InputError("command line", words[i], "options that begin with -, each with one value");
  }
}

std::optional<std::pair<std::string, std::string>> unused_option() {
  PetscInt count = 0;
  char** names = nullptr;
  char** values = nullptr;
  petsc::check(PetscOptionsLeftGet(nullptr, &count, &names, &values));
  std::optional<std::pair<std::string, std::string>> unused;
  for (PetscInt i = 0; i < count && !unused; ++i) {
    if (is_late(names[i])) continue;
    unused.emplace(std::string("-") + names[i], values[i] == nullptr ? "" : values[i]);
  }
  petsc::check(PetscOptionsLeftRestore(nullptr, &count, &names, &values));
  return unused;
}

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> words;
  std::istringstream stream(list);
  for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
  return words;
}

}  // namespace crackle
