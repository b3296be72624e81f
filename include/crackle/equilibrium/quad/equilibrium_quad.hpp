/// `-equilibrium quad`: L D L^T in 113 bits, for networks whose stiffnesses are too far apart for double, for breaks
/// beyond where double can tell F from 0, and to check others with.
///
/// A break takes about 2e-7 seconds for each entry of the profile, a new factor 2e-8 times the mean length of a row.
/// Loads are right to the last bit of a double up to contrasts of 1e16 or so; from 1e30 on most samples end
/// with a message.
#pragma once

#include "crackle/equilibrium/equilibrium.hpp"

namespace crackle {

/// Throws InputError for a network whose factor has more than kMostQuadEntries.
[[nodiscard]] std::unique_ptr<Equilibrium> make_equilibrium_quad(const Network& network,
                                                                 const EquilibriumOptions& options,
                                                                 PhaseTimes& times);

}  // namespace crackle
