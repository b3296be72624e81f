#include "crackle/equilibrium/quad_search.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/base/memory.hpp"
#include "crackle/equilibrium/trust.hpp"

namespace crackle {

namespace {

/// Forces in error by less than this fraction of the load decide as in exact arithmetic, but for what carries nothing.
constexpr double kCertain = 1e-14;
/// A break reads and writes the entries of the factor about so many times.
constexpr double kPassesPerBreak = 4;

QuadOrder affordable_order(const Network& network) {
  QuadOrder order = find_quad_order(network);
  const std::size_t entries = profile_entries(order.first);
  if (entries > kMostQuadEntries) {
    throw InputError("-equilibrium quad on a network of " + std::to_string(network.unknowns) +
                         " unknowns, whose factor has entries",
                     std::to_string(entries), "at most " + std::to_string(kMostQuadEntries) + " of 16 bytes");
  }
  demand_memory("-equilibrium quad of " + std::to_string(network.unknowns) + " unknowns",
                static_cast<double>(sizeof(Quad) * entries));
  return order;
}

double count_breaks_per_factor(const QuadOrder& order) {
  const double passes = profile_work(order.first) / static_cast<double>(profile_entries(order.first));
  return std::max(1.0, passes / kPassesPerBreak);
}

}  // namespace

QuadSearch::QuadSearch(const Network& network, BreakOn break_on, PhaseTimes& times)
    : QuadSearch(network, break_on, times, affordable_order(network)) {}

QuadSearch::QuadSearch(const Network& network, BreakOn break_on, PhaseTimes& times, QuadOrder order)
    : network_(network),
      break_on_(break_on),
      times_(times),
      breaks_per_factor_(count_breaks_per_factor(order)),
      solver_(network, std::move(order), times) {}

void QuadSearch::begin(std::span<const BondId> broken, double intact_stiffness) {
  solver_.reset();
  for (const BondId bond : broken) solver_.remove(bond);  // no factor yet: nothing to change
  intact_stiffness_ = intact_stiffness;
  null_pivots_ = 0;
  complaint_.clear();
}

State QuadSearch::find_critical(std::span<const double> threshold, Critical& next) {
  const QuadSolver::Outcome outcome = solver_.solve();
  if (outcome == QuadSolver::Outcome::loose) return State::failed;
  if (outcome == QuadSolver::Outcome::vague) {
    complaint_ = solver_.complaint();
    return State::unsolved;
  }
  const PhaseScope scope(times_, Phase::search);
  const auto stiffness = static_cast<double>(solver_.stiffness());
  if (intact_stiffness_ == 0) {
    intact_stiffness_ = stiffness;
    null_pivots_ = solver_.counts().null_pivots;
  }
  if (!(stiffness > kFailedStiffness * intact_stiffness_)) return State::failed;
  next.stiffness = stiffness;
  if (!(solver_.uncertain() < solver_.largest_force())) {
    complain("forces are uncertain by %.1g of the load even in 113 bits: stiffnesses are too far apart",
             solver_.uncertain());
    return State::unsolved;
  }
  if (!find_largest_ratio(solver_.force(), threshold, break_on_, next)) return State::held;
  return is_doubtful(threshold, next) ? State::unsolved : State::carrying;
}

/// Another bond may have the largest ratio, forces being as uncertain as they are. Equal ones are decided by number.
bool QuadSearch::is_doubtful(std::span<const double> threshold, const Critical& next) {
  const Quad error = solver_.uncertain();
  const auto force = solver_.force();
  const auto bound = [&](BondId e, Quad change) {
    const Quad size = break_on_ == BreakOn::magnitude ? magnitude(force[e]) : force[e];
    return break_ratio(size + change, threshold[e], BreakOn::tension);
  };
  const Quad tied = least_tied(Quad(1));
  const Quad least = bound(next.bond, -error);
  Quad largest = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) largest = std::max(largest, bound(e, -error));
  for (BondId e = 0; e < network_.bonds(); ++e) {
    const bool nothing = force[e] == 0 && error < kCertain;
    if (e == next.bond || nothing) continue;
    const Quad most = bound(e, error);
    const bool rivals = e < next.bond ? most >= tied * largest : tied * most > least;
    if (most > 0 && rivals) {
      complain("bonds %.0f and %.0f may both be the next: forces are uncertain by %.1g of the load",
               static_cast<double>(next.bond), static_cast<double>(e), solver_.uncertain());
      return true;
    }
  }
  return false;
}

std::vector<double> QuadSearch::forces() const {
  std::vector<double> force(solver_.force().size());
  std::ranges::transform(solver_.force(), force.begin(), [](Quad f) { return static_cast<double>(f); });
  return force;
}

template <class... Numbers>
void QuadSearch::complain(const char* format, Numbers... numbers) {
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), format, numbers...);
  complaint_ = text.data();
}

}  // namespace crackle
