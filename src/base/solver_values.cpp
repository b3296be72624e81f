#include "crackle/base/solver_values.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include "crackle/base/error.hpp"
#include "crackle/base/option_database.hpp"

namespace crackle {

namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// How a KSP may be told to end. The load's norm, and that of the first residual, is 1.
struct Range {
  const char* name;
  bool whole;  ///< an integer
  double above, from, below;
  const char* allowed;
};

constexpr std::array kRanges = {
    Range{"-ksp_rtol", false, -1, 0, 1, "a number from 0 to below 1"},
    Range{"-ksp_atol", false, -1, 0, 1, "a number from 0 to below 1, the norm of the load"},
    Range{"-ksp_divtol", false, 1, 1, kUnlimited, "a finite number above 1"},
    Range{"-ksp_max_it", true, 0, 1, 2147483648.0, "an integer from 1 to 2147483647"},
};

bool is_finite_or_none(const std::string& value) {
  char* end = nullptr;
  const double number = std::strtod(value.c_str(), &end);
  return end == value.c_str() || *end != '\0' || std::isfinite(number);
}

void check_range(const Range& range, const std::string& value) {
  if (value.empty()) throw InputError(range.name, "without a value", range.allowed);
  char* end = nullptr;
  const double number = std::strtod(value.c_str(), &end);
  const bool digits =
      value.find_first_not_of(range.whole ? "0123456789+" : "0123456789+-.eE") == std::string::npos;
  const bool inside = number > range.above && number >= range.from && number < range.below;
  if (*end != '\0' || !digits || !inside) throw InputError(range.name, value, range.allowed);
}

}  // namespace

void check_solver_values() {
  const auto given = given_values();
  for (const Range& range : kRanges) {
    if (const auto option = given.find(range.name); option != given.end()) check_range(range, option->second);
  }
  for (const auto& [name, value] : given) {
    const bool of_solver = name.find("ksp_") != std::string::npos || name.find("pc_") != std::string::npos ||
                           name.find("mat_") != std::string::npos;
    if (of_solver && !is_finite_or_none(value)) throw InputError(name, value, "a finite number");
  }
}

}  // namespace crackle
