#include "crackle/scene/option_reader.hpp"

#include <petscsys.h>

namespace crackle {

std::string Reader::text(const char* name) {
  const auto value = given_value(name);
  if (value && value->empty()) throw InputError(name, "without a value", allowed_of(name));
  return used_[name] = value.value_or(find_option(name).standard);
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
