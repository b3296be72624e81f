/// The model itself: find the critical bond, break it, repeat, until the scene's stop.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "crackle/equilibrium.hpp"
#include "crackle/observer.hpp"

namespace crackle {

/// When a sample ends, unless the network fails before.
struct StopRule {
  enum class Kind : std::uint8_t {
    failure,       ///< F below 1e-8 of the intact F
    stiffness,     ///< F below `value` times the intact F
    breaks,        ///< `value` bonds broken
    displacement,  ///< the next bond would break at a plate displacement above `value`
  };
  Kind kind = Kind::failure;
  double value = 0;
};

/// Breaks one sample from the intact network on. `threshold`: one a bond, >= 0.
///
/// Throws SolverError when the intact network carries nothing, or the strategy can't solve it; the message
/// names sample and break. Observers have then seen a sample that begins and doesn't end.
[[nodiscard]] SampleSummary break_sample(Equilibrium& equilibrium, std::int64_t index,
                                         std::span<const double> threshold, const StopRule& stop,
                                         std::span<Observer* const> observers);

}  // namespace crackle
