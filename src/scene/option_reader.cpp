#include "crackle/scene/option_reader.hpp"

#include <sstream>

#include "crackle/base/petsc_handle.hpp"

namespace crackle {

using petsc::check;

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> words;
  std::istringstream stream(list);
  for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
  return words;
}

bool Reader::given(const char* name) const {
  PetscBool set = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, name, &set));
  return set == PETSC_TRUE;
}

std::string Reader::text(const char* name) {
  const char* value = nullptr;  // the whole text: a copy would have to have a length
  PetscBool set = PETSC_FALSE;
  check(PetscOptionsFindPair(nullptr, nullptr, name, &value, &set));
  const OptionText& option = find_option(name);
  if (set != PETSC_TRUE) return used_[name] = option.standard;
  if (value == nullptr || *value == '\0') throw InputError(name, "without a value", option.allowed);
  return used_[name] = value;
}

double Reader::positive(const char* name) {
  const double value = number(name, 0.0);
  if (value > 0) return value;
  throw InputError(name, text(name), find_option(name).allowed);
}

bool Reader::flag(const char* name) {
  PetscBool value = PETSC_FALSE;
  if (PetscOptionsGetBool(nullptr, nullptr, name, &value, nullptr) != 0) {
    throw InputError(name, text(name), "nothing, true or false");
  }
  used_[name] = value == PETSC_TRUE ? "true" : "false";
  return value == PETSC_TRUE;
}

}  // namespace crackle
