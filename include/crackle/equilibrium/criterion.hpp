/// The criterion: which bond breaks next, given what each carries. One rule, in whatever precision forces come.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "crackle/network/network.hpp"

namespace crackle {

enum class BreakOn : std::uint8_t { magnitude, tension };  ///< the ratio is |f|/t, or f/t

/// What a look at the network finds.
enum class State : std::uint8_t {
  carrying,  ///< there is a critical bond
  failed,    ///< the plate's stiffness is 0 (below kFailedStiffness of the intact one): nothing carries
  held,      ///< the plate is held, but by bonds that can't break: no ratio is above 0
  unsolved,  ///< the solver gave no answer to trust, and has a complaint that says why
};

/// The bond that breaks next.
struct Critical {
  BondId bond = 0;
  double load = 0;       ///< P = F / max ratio at unit displacement: the plate force at which it breaks
  double stiffness = 0;  ///< F just before it breaks; load / stiffness is the plate's displacement
};

/// Ratios that differ by less than this fraction are equal: of those bonds the lowest BondId breaks.
inline constexpr double kTie = 1e-11;
/// A bond carries nothing when its elongation is below this multiple of the plate's displacement and its force below
/// this part of the load: what rounded positions and stiffnesses make of 0. (Of a stiff bond the first alone says nothing.)
inline constexpr double kNoElongation = 1e-14;
inline constexpr double kNoForce = 1e-14;

/// What counts as no elongation and no force in one state.
template <class Real>
class Nothing {
 public:
  /// plate: its displacement under `load`.
  constexpr Nothing(Real plate, Real load) : elongation_(kNoElongation * plate), force_(kNoForce * load) {}

  [[nodiscard]] constexpr Real elongation() const { return elongation_; }
  [[nodiscard]] constexpr Real force() const { return force_; }
  /// Whether a bond carries more: its elongation and force, or their magnitudes.
  [[nodiscard]] constexpr bool is_less_than(Real elongation, Real force) const {
    return elongation > elongation_ || force > force_;
  }
  /// The same of a bond of which force and stiffness are known.
  [[nodiscard]] constexpr bool is_less_than_force(Real force, Real stiffness) const {
    return force > force_ || force > elongation_ * stiffness;
  }

 private:
  Real elongation_;
  Real force_;
};

/// Ratios from here up to the largest one are equal to it.
template <class Real>
[[nodiscard]] constexpr Real least_tied(Real largest) {
  return largest * (1 - static_cast<Real>(kTie));
}

/// force / threshold, or its magnitude / threshold; 0 where it isn't above 0. As in double, what is beyond its range is
/// infinite: one rule for every strategy, those bonds tie.
template <class Real>
[[nodiscard]] Real break_ratio(Real force, double threshold, BreakOn break_on) {
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
  assert(force.size() == threshold.size());
  Real largest = 0;
  for (std::size_t e = 0; e < force.size(); ++e) {
    largest = std::max(largest, break_ratio(force[e], threshold[e], break_on));
  }
  if (!(largest > 0)) return false;
  const Real tied = least_tied(largest);
  std::size_t first = 0;
  while (!(break_ratio(force[first], threshold[first], break_on) >= tied)) ++first;
  next.bond = static_cast<BondId>(first);
  next.load = static_cast<double>(1 / largest);
  return true;
}

/// The same from displacements u (unit plate load, size n) in double, every bond scanned; fills `next` whole.
/// ratio: [M] workspace, filled.
[[nodiscard]] bool scan_ratios(const Network& network, std::span<const double> threshold,
                               std::span<const double> u, BreakOn break_on, std::span<double> ratio,
                               Critical& next);

}  // namespace crackle
