/// PETSc options for the length of a test.
#pragma once

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "crackle/base/petsc_handle.hpp"

namespace crackle::test {

class SolverOptions {
 public:
  /// Names with the dash, values as typed.
  SolverOptions(std::initializer_list<std::pair<std::string, std::string>> options) : options_(options) {
    for (const auto& [name, value] : options_) {
      petsc::check(PetscOptionsSetValue(nullptr, name.c_str(), value.c_str()));
    }
  }
  ~SolverOptions() {
    for (const auto& option : options_) PetscOptionsClearValue(nullptr, option.first.c_str());
  }
  SolverOptions(const SolverOptions&) = delete;
  SolverOptions& operator=(const SolverOptions&) = delete;

 private:
  std::vector<std::pair<std::string, std::string>> options_;
};

}  // namespace crackle::test
