#include "crackle/compare/compare_strategy.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>

#include "crackle/base/error.hpp"
#include "crackle/base/option_database.hpp"
#include "crackle/base/option_files.hpp"
#include "crackle/base/petsc_handle.hpp"

namespace crackle {

namespace {

using petsc::check;

/// "-name value" lines, as PETSc reads them.
std::map<std::string, std::string> read_options(const std::string& file) {
  if (!std::ifstream(file) || std::filesystem::is_directory(file)) {
    throw InputError("-compare", file,
                     "files of solver options, with commas between (options/solver/*.opts)");
  }
  (void)options_in_file(file);
  PetscOptions database = nullptr;
  char* text = nullptr;
  check(PetscOptionsCreate(&database));
  check(PetscOptionsInsertFile(PETSC_COMM_SELF, database, file.c_str(), PETSC_TRUE));
  check(PetscOptionsGetAll(database, &text));
  std::istringstream words(text);
  check(PetscFree(text));
  check(PetscOptionsDestroy(&database));
  std::map<std::string, std::string> options;
  std::string name;
  for (std::string word; words >> word;) {
    if (looks_like_option(word)) {
      options[name = word] = "";
    } else if (!name.empty()) {
      options[name].append(options[name].empty() ? "" : " ").append(word);
    }
  }
  return options;
}

bool iterates(const std::map<std::string, std::string>& options) {
  const auto ksp = options.find("-ksp_type");
  return ksp != options.end() && ksp->second != "preonly";
}

std::string short_name(const std::string& file) {
  return std::filesystem::path(file).stem().string();
}

}  // namespace

std::vector<StrategyChoice> choose_strategies(std::span<const std::string> files,
                                              std::span<const std::string> tolerances) {
  std::vector<StrategyChoice> choices;
  for (const std::string& file : files) {
    const StrategyChoice choice{short_name(file), file, "", read_options(file)};
    if (tolerances.empty() || !iterates(choice.options)) {
      choices.push_back(choice);
      continue;
    }
    for (const std::string& rtol : tolerances) {
      choices.push_back(choice);
      choices.back().name += " " + rtol;
      choices.back().rtol = choices.back().options["-ksp_rtol"] = rtol;
    }
  }
  return choices;
}

StrategyOptions::StrategyOptions(const StrategyChoice& choice) {
  for (const auto& [name, value] : choice.options) {
    const char* old = nullptr;
    PetscBool set = PETSC_FALSE;
    check(PetscOptionsFindPair(nullptr, nullptr, name.c_str(), &old, &set));
    auto& before = before_[name];
    if (set == PETSC_TRUE) before = old == nullptr ? "" : old;
    check(PetscOptionsSetValue(nullptr, name.c_str(), value.empty() ? nullptr : value.c_str()));
  }
}

StrategyOptions::~StrategyOptions() {
  for (const auto& [name, value] : before_) {
    if (value) {
      PetscOptionsSetValue(nullptr, name.c_str(), value->empty() ? nullptr : value->c_str());
    } else {
      PetscOptionsClearValue(nullptr, name.c_str());
    }
  }
}

}  // namespace crackle
