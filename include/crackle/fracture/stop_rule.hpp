/// When a sample ends, unless the network fails before, or nothing that is left can break (State::held).
#pragma once

#include <cstdint>

#include "crackle/equilibrium/criterion.hpp"

namespace crackle {

struct StopRule {
  enum class Kind : std::uint8_t {
    failure,       ///< nothing carries any more: F is 0
    stiffness,     ///< F below `value` times the intact F
    breaks,        ///< `value` bonds broken
    displacement,  ///< the next bond would break at a plate displacement above `value`
  };
  Kind kind = Kind::failure;
  double value = 0;
};

/// The sample ends after so many breaks, whatever the next one is.
[[nodiscard]] bool is_reached(const StopRule& stop, std::int64_t broken);

/// The sample ends after so many breaks: `next` is not broken. intact_stiffness: F before the first.
[[nodiscard]] bool is_reached(const StopRule& stop, std::int64_t broken, double intact_stiffness,
                              const Critical& next);

}  // namespace crackle
