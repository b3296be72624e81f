#include "crackle/referee.hpp"

#include <algorithm>

#include "crackle/equilibrium_quad.hpp"
#include "crackle/error.hpp"
#include "crackle/wide_criterion.hpp"

namespace crackle {

Referee::Referee(const Network& network, BreakOn break_on, PhaseTimes& times)
    : network_(network),
      break_on_(break_on),
      times_(times),
      held_(network, times),
      broken_(network.bonds(), 0),
      u_(static_cast<std::size_t>(network.unknowns)) {}

Referee::~Referee() = default;

void Referee::begin(std::span<const double> threshold, std::span<const BondId> bonds,
                    double intact_stiffness) {
  threshold_ = threshold;
  removed_.assign(bonds.begin(), bonds.end());
  std::ranges::fill(broken_, std::uint8_t{0});
  for (const BondId e : bonds) broken_[e] = 1;
  intact_stiffness_ = intact_stiffness;
  in_quad_ = false;
  complaint_.clear();
}

void Referee::remove(BondId bond) {
  broken_[bond] = 1;
  removed_.push_back(bond);
  if (in_quad_) quad_->remove(bond);
}

State Referee::decide(Critical& next) {
  if (in_quad_) return decide_wide(next);
  const double whole = intact_stiffness_ > 0 ? intact_stiffness_ : network_.plate_diagonal;
  switch (held_.solve(broken_, kFailedStiffness * whole)) {
    case HeldSolver::Outcome::solved:
      return judge(next);
    case HeldSolver::Outcome::loose:
      return State::failed;
    case HeldSolver::Outcome::vague:
      break;
  }
  return decide_wide(next);
}

State Referee::judge(Critical& next) {
  const PhaseScope scope(times_, Phase::search);
  next.stiffness = held_.stiffness();
  if (intact_stiffness_ == 0) intact_stiffness_ = next.stiffness;
  return find_largest_ratio(held_.force(), threshold_, break_on_, next) ? State::carrying : State::held;
}

State Referee::decide_wide(Critical& next) {
  try {
    if (!quad_) quad_ = make_equilibrium_quad(network_, {.strategy = "quad", .break_on = break_on_}, times_);
  } catch (const InputError& error) {
    complaint_ = std::string("double precision can't tell which bond breaks next, and ") + error.what();
    return State::unsolved;
  }
  if (!in_quad_) {
    std::vector<double> threshold(threshold_.begin(), threshold_.end());
    quad_->resume(threshold, removed_, intact_stiffness_);
    in_quad_ = true;
  }
  const State state = quad_->find_critical(next);
  intact_stiffness_ = quad_->intact_stiffness();
  complaint_ = quad_->complaint();
  return state;
}

std::span<const double> Referee::displacements() {
  if (in_quad_) return quad_->displacements();
  held_.get_displacements(u_);
  return u_;
}

std::vector<double> Referee::forces() const {
  if (in_quad_) return quad_->forces();
  std::vector<double> force(held_.force().size());
  std::ranges::transform(held_.force(), force.begin(), [](Quad f) { return static_cast<double>(f); });
  return force;
}

}  // namespace crackle
