/// `-equilibrium quad`: L D L^T in 113 bits, for networks whose stiffnesses are too far apart for double, for breaks
/// beyond where double can tell F from 0, and to check others with.
///
/// A break costs about 2e-7 seconds times the entries of the profile, a new factor their mean length times that.
#pragma once

#include <cstddef>

#include "crackle/equilibrium.hpp"

namespace crackle {

/// Entries of the factor (16 bytes each) above which a network is refused: L = 96 springs, where a break takes seconds.
inline constexpr std::size_t kMostQuadEntries = 8'000'000;

/// Throws InputError for a network whose factor has more.
[[nodiscard]] std::unique_ptr<Equilibrium> make_equilibrium_quad(const Network& network,
                                                                 const EquilibriumOptions& options,
                                                                 PhaseTimes& times);

}  // namespace crackle
