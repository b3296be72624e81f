/// The laws that thresholds and stiffnesses are drawn from: a table each. A new law is a function and a row in laws.cpp.
///
/// Each makes a value of a bond from r, uniform on [0, 1), which belongs to that bond (and sample) alone.
#pragma once

#include <cstddef>
#include <span>

#include "crackle/network/lattice.hpp"

namespace crackle {

struct ThresholdLaw {
  const char* name;      ///< in `-disorder`
  const char* meaning;   ///< "t = r^D"
  const char* exponent;  ///< what -disorder_exponent is to it; null: it has none
  double (*threshold)(double r, double exponent);
};

/// The default first.
[[nodiscard]] std::span<const ThresholdLaw> threshold_laws();

struct StiffnessLaw {
  const char* name;     ///< in `-stiffness`
  const char* meaning;  ///< one line; c is -stiffness_contrast
  bool contrasts;       ///< false: every bond has 1
  double (*stiffness)(const Lattice& lattice, std::size_t bond, double contrast, double r);
};

/// The default first.
[[nodiscard]] std::span<const StiffnessLaw> stiffness_laws();

}  // namespace crackle
