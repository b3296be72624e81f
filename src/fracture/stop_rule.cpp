#include "crackle/fracture/stop_rule.hpp"

namespace crackle {

bool is_reached(const StopRule& stop, std::int64_t broken) {
  return stop.kind == StopRule::Kind::breaks && static_cast<double>(broken) >= stop.value;
}

bool is_reached(const StopRule& stop, std::int64_t broken, double intact_stiffness, const Critical& next) {
  switch (stop.kind) {
    case StopRule::Kind::failure:
      return false;
    case StopRule::Kind::stiffness:
      return next.stiffness < stop.value * intact_stiffness;
    case StopRule::Kind::breaks:
      return is_reached(stop, broken);
    case StopRule::Kind::displacement:
      return next.load / next.stiffness > stop.value;
  }
  return false;
}

}  // namespace crackle
