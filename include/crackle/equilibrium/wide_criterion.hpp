/// The rule of breaking on forces that are wider than double: the largest ratio, the lowest number among equals.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "crackle/equilibrium/equilibrium.hpp"

namespace crackle {

/// force / threshold, or its magnitude / threshold; 0 where it isn't above 0. As in double, what is beyond its range is
/// infinite: one rule for every strategy, those bonds tie.
template <class Real>
[[nodiscard]] Real wide_ratio(Real force, double threshold, BreakOn break_on) {
  const Real size = break_on == BreakOn::magnitude && force < 0 ? -force : force;
  if (!(size > 0)) return 0;
  const Real ratio = size / std::abs(threshold);  // which may be -0
  return ratio <= std::numeric_limits<double>::max() ? ratio : Real(std::numeric_limits<double>::infinity());
}

/// Forces [M] at unit plate load, 0 for what carries nothing; thresholds [M], infinite for what can't break. Fills bond
/// and load; false when no ratio is above 0.
template <class Real>
[[nodiscard]] bool find_largest_ratio(std::span<const Real> force, std::span<const double> threshold,
                                      BreakOn break_on, Critical& next) {
  Real largest = 0;
  for (std::size_t e = 0; e < force.size(); ++e) {
    largest = std::max(largest, wide_ratio(force[e], threshold[e], break_on));
  }
  if (!(largest > 0)) return false;
  const Real tied = largest * (1 - static_cast<Real>(kTie));
  std::size_t first = 0;
  while (!(wide_ratio(force[first], threshold[first], break_on) >= tied)) ++first;
  next.bond = static_cast<BondId>(first);
  next.load = static_cast<double>(1 / largest);
  return true;
}

}  // namespace crackle
