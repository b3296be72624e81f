/// What may be believed of an answer in double: where it ends, and what a residual leaves open.
///
/// A residual e_plate - K u comes from the bonds, never from a factor; the load's norm is 1.
#pragma once

#include <cstdint>
#include <span>

#include "crackle/equilibrium/criterion.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

/// Backward error that is not believed: a direct solver leaves 1e-16 to 1e-14.
inline constexpr double kLargestError = 1e-12;

/// F below this fraction of the intact network's F is 0: bond directions are right to 1e-16, and F, an energy, goes
/// with their square. A small F is told from 0 by energies, which are upper bounds, and by a Referee.
inline constexpr double kFailedStiffness = 1e-24;
/// F below this fraction of the intact network's is the Referee's: double has too few digits left.
inline constexpr double kRefereedStiffness = 1e-6;
/// F below this fraction has the residual looked at at every break.
inline constexpr double kDoubtfulStiffness = 1e-4;
/// A pivot of the intact network below this fraction of its diagonal entry is that of a free motion, or one that
/// double doesn't know well enough: a Referee tells which.
inline constexpr double kSoftPivot = 1e-8;

/// A residual above this may leave open which bond breaks: it is then looked at in every state. The forces that balance
/// a load are bounded by it, whatever the stiffnesses (G. W. Stewart, Linear Algebra Appl. 112 (1989) 189, on scaled
/// projections), by a factor that geometry decides.
inline constexpr double kDoubtfulResidual = 1e-9;
/// A force is taken to be in error by at most this multiple of the residual, times the root of (intact F over F): 2 is
/// the most that was seen where no pivot is below kSoftPivot. Where one is, no residual is believed.
inline constexpr double kForcePerResidual = 10;
/// A residual that makes the load a direct solver finds uncertain by more than this is not what it should leave.
inline constexpr double kUncertainForce = 1e-8;
/// A critical bond whose elongation is below this multiple of the plate's displacement has the residual looked at.
inline constexpr double kTinyElongation = 1e-6;
/// Rounding of displacements hides an elongation below this multiple of the plate's, and with it a force of so much times
/// k / F: where that is more than kHiddenForce of the load, a bond with a threshold as small is the Referee's.
inline constexpr double kHiddenElongation = 4e-15;
inline constexpr double kHiddenForce = 1e-12;
/// A pivot is right to so many roundings of the stiffest bond's.
inline constexpr double kPivotRoundings = 1e3;
/// Breaks between two looks at the residual, while it is not doubtful.
inline constexpr std::int64_t kTrustEvery = 128;

/// A network as one sample has left it, and what a solver says of it.
struct SolvedState {
  const Network& network;
  std::span<const double> threshold;  ///< [M] infinite for what can't break
  BreakOn break_on = BreakOn::magnitude;
  double intact_stiffness = 0;
  std::span<const double> u;  ///< [n] displacements at unit plate load
  Critical next;              ///< the critical bond that follows from u
};

/// Pivots of an intact network below this fraction of the diagonal entry may be 0 for all that double knows.
/// contrast: largest over smallest stiffness.
[[nodiscard]] double least_certain_pivot(double contrast);

/// The slack of a break, 1 - k b^T K^-1 b, from 1/F before and after it and the energy f^2 / k of the bond that broke:
/// 1/F' = 1/F + f^2 / (k slack) (Sherman-Morrison). Not more than rounding of 1/F lets it be.
[[nodiscard]] double slack_of_break(double energy, double bent_before, double bent_after);

/// A critical bond is so for its threshold rather than its force, which may be nothing but rounding. (Both 0: true.)
[[nodiscard]] bool is_tiny(const Network& network, std::span<const double> threshold, const Critical& next);

/// Some bond of `slight` that is not broken (threshold infinite) would be critical if it carried a force that rounding
/// of displacements may hide.
[[nodiscard]] bool may_hide_one(const Network& network, std::span<const double> threshold,
                                std::span<const BondId> slight, const Critical& next);

/// True when, forces being as uncertain as a residual of this norm says, another bond may have the largest ratio, or a
/// direct solver's loads are off. What such a solver leaves by rounding (norm <= kDoubtfulResidual) is not doubted: equal
/// ratios and bonds without force have rules of their own. iterates: its error is the user's choice.
[[nodiscard]] bool is_left_open(const SolvedState& state, double norm, bool iterates);

}  // namespace crackle
