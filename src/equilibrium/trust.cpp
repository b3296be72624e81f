#include "crackle/equilibrium/trust.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace crackle {

namespace {

constexpr double kRounding = std::numeric_limits<double>::epsilon();

/// Another bond may have the largest ratio, every force being in error by `uncertain`.
bool has_rival(const SolvedState& state, double uncertain) {
  const Network& network = state.network;
  const BondId critical = state.next.bond;
  const auto ratio = [&](BondId e, double error) {
    const double stretch = elongation(network, e, state.u);
    const double size = state.break_on == BreakOn::magnitude ? std::abs(stretch) : stretch;
    const double force = network.stiffness[e] * size + error;
    return force > 0 ? force / state.threshold[e] : 0;
  };
  const double least = ratio(critical, -uncertain);
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (e == critical) continue;
    const double most = ratio(e, uncertain);
    if (most > least || (most == least && e < critical)) return true;
  }
  return false;
}

}  // namespace

double least_certain_pivot(double contrast) {
  return std::max(kSoftPivot, kPivotRoundings * kRounding * contrast);
}

double slack_of_break(double energy, double bent_before, double bent_after) {
  return energy / std::max(bent_after - bent_before, kPivotRoundings * kRounding * bent_after);
}

bool is_tiny(const Network& network, std::span<const double> threshold, const Critical& next) {
  const double force = threshold[next.bond] / next.load;
  return !(force > kTinyElongation * network.stiffness[next.bond] / next.stiffness);
}

bool may_hide_one(const Network& network, std::span<const double> threshold, std::span<const BondId> slight,
                  const Critical& next) {
  const double per_stiffness = kHiddenElongation / next.stiffness;
  return std::ranges::any_of(slight, [&](BondId e) {
    const double hidden = per_stiffness * network.stiffness[e];
    return std::isfinite(threshold[e]) && hidden > kHiddenForce && threshold[e] <= hidden * next.load;
  });
}

bool is_left_open(const SolvedState& state, double norm, bool iterates) {
  assert(std::ssize(state.u) == state.network.unknowns);
  const Critical& next = state.next;
  const double amplified =
      kForcePerResidual * std::sqrt(std::max(1.0, state.intact_stiffness / next.stiffness));
  const double uncertain = amplified * norm;
  const double critical_force =
      state.network.stiffness[next.bond] * std::abs(elongation(state.network, next.bond, state.u));
  if (!(critical_force > uncertain)) return true;
  const bool loads_are_off = !(kForcePerResidual * norm <= kUncertainForce * std::max(1.0, critical_force));
  if (loads_are_off && !iterates) return true;
  if (norm <= kDoubtfulResidual && !iterates) return false;
  return has_rival(state, uncertain);
}

}  // namespace crackle
