#include "crackle/equilibrium/referee.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/equilibrium/trust.hpp"

namespace crackle {

namespace {

/// A ratio is known when its error is below this part of it.
constexpr double kKnown = 1e-14;

}  // namespace

Referee::Referee(const Network& network, BreakOn break_on, PhaseTimes& times)
    : network_(network),
      break_on_(break_on),
      times_(times),
      held_(network, times),
      broken_(network.bonds(), 0),
      u_(static_cast<std::size_t>(network.unknowns)) {}

void Referee::begin(std::span<const double> threshold, std::span<const BondId> bonds,
                    double intact_stiffness) {
  assert(threshold.size() == broken_.size());
  assert((intact_stiffness > 0 || bonds.empty()) &&
         "F of the intact network is known once a bond has broken");
  threshold_ = threshold;
  removed_.assign(bonds.begin(), bonds.end());
  std::ranges::fill(broken_, std::uint8_t{0});
  for (const BondId e : bonds) broken_[e] = 1;
  intact_stiffness_ = intact_stiffness;
  in_quad_ = false;
  complaint_.clear();
}

void Referee::remove(BondId bond) {
  assert(broken_[bond] == 0);
  broken_[bond] = 1;
  removed_.push_back(bond);
  if (in_quad_) quad_->remove(bond);
}

State Referee::decide(Critical& next, HeldFactor* own) {
  if (in_quad_) return decide_wide(next);
  const double none =
      kFailedStiffness * (intact_stiffness_ > 0 ? intact_stiffness_ : network_.plate_diagonal);
  HeldSolver::Outcome outcome = held_.solve(broken_, none, own);
  if (outcome == HeldSolver::Outcome::solved) {
    const State state = judge(next);
    if (state == State::held || is_sure(next)) return state;
    outcome = held_.solve_wide(broken_, none);
    if (outcome == HeldSolver::Outcome::solved) return judge(next);
  }
  return outcome == HeldSolver::Outcome::loose ? State::failed : decide_wide(next);
}

State Referee::judge(Critical& next) {
  const PhaseScope scope(times_, Phase::search);
  next.stiffness = held_.stiffness();
  if (intact_stiffness_ == 0) intact_stiffness_ = next.stiffness;
  return find_largest_ratio(held_.force(), threshold_, break_on_, next) ? State::carrying : State::held;
}

/// The ratio of every bond that may have the largest is known far better than ties are told.
bool Referee::is_sure(const Critical& next) const {
  const auto force = held_.force();
  const double known = kKnown / next.load;
  const double contends = (1 - 2 * kTie) / next.load;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    // whether it carries anything is all that matters of a threshold of 0, and told for any other by what is none
    const double size = std::abs(force[e]);
    const bool told = held_.uncertain() <= kKnown * (size == 0 ? 1 : size);
    if (told && (size == 0 || threshold_[e] == 0)) continue;
    const double uncertain = held_.uncertain() / std::abs(threshold_[e]);
    const double ratio = break_ratio(force[e], threshold_[e], break_on_);
    if (!(uncertain <= known) && !(ratio + uncertain < contends)) return false;
  }
  return true;
}

State Referee::decide_wide(Critical& next) {
  try {
    if (!quad_) quad_ = std::make_unique<QuadSearch>(network_, break_on_, times_);
  } catch (const InputError& error) {
    complaint_ = std::string("double precision can't tell which bond breaks next, and ") + error.what();
    return State::unsolved;
  }
  if (!std::exchange(in_quad_, true)) quad_->begin(removed_, intact_stiffness_);
  const State state = quad_->find_critical(threshold_, next);
  intact_stiffness_ = quad_->intact_stiffness();
  complaint_ = quad_->complaint();
  return state;
}

std::span<const double> Referee::displacements() {
  if (in_quad_) {
    quad_->solver().get_displacements(u_);
  } else {
    held_.get_displacements(u_);
  }
  return u_;
}

std::vector<double> Referee::forces() const {
  if (in_quad_) return quad_->forces();
  return {held_.force().begin(), held_.force().end()};
}

}  // namespace crackle
