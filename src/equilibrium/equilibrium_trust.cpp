/// What Equilibrium believes of a strategy's answers, and when it asks the Referee instead.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "crackle/equilibrium/equilibrium.hpp"
#include "crackle/equilibrium/referee.hpp"

namespace crackle {

namespace {

/// A break that leaves a slack below this has made something that hardly resists.
constexpr double kSoftSlack = 1e-8;
/// A residual of the intact network above this, relative to the load, is that of no solver.
constexpr double kNoSolution = 1e-3;

template <class... Numbers>
std::string describe(const char* format, Numbers... numbers) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), format, static_cast<double>(numbers)...);
  return text.data();
}

}  // namespace

std::string describe_doubt(const EquilibriumCounts& counts) {
  std::string text;
  if (counts.soft_contrast > 0)
    text = describe("stiffnesses that span a factor of %.2g", counts.soft_contrast);
  if (counts.soft_node < 0) return text;
  return (text.empty() ? "" : text + "; ") + name_node(counts.soft_node, counts.soft_bonds) +
         describe(
             " hardly resists some motion, with a pivot of %.1g of its stiffness: bonds almost in line, or "
             "far "
             "softer than others",
             counts.soft_pivot);
}

Referee& Equilibrium::referee() {
  if (!referee_) referee_ = std::make_unique<Referee>(network_, options_.break_on, times_);
  return *referee_;
}

State Equilibrium::look(Critical& next) {
  if (knows_its_error()) return search(next);
  if (is_soft()) return hand_over(next);
  complaint_.clear();
  State state = search(next);
  const auto broken = static_cast<std::int64_t>(removed_.size());
  if (state == State::carrying && options_.check_every > 0 && broken % options_.check_every == 0) {
    state = double_check(next);
  }
  if (state == State::failed) return confirm_end(next);
  if (state != State::carrying) return state;
  if (is_foreign() && has_softened(next)) return hand_over(next);
  if (!iterates() && may_hide_one(network_, threshold_, slight_, next)) return consult(next);
  const bool looks = suspicious_ || is_foreign() || iterates() || broken % kTrustEvery == 0 ||
                     next.stiffness < kDoubtfulStiffness * intact_stiffness_ ||
                     is_tiny(network_, threshold_, next);
  return looks ? look_for_doubt(next) : state;
}

/// Once for a network: whether double can't tell a pivot of the intact one from 0.
bool Equilibrium::is_soft() {
  if (classified_) return soft_;
  classified_ = true;
  const double widest = contrast(network_);
  const double least = least_certain_pivot(widest);
  if (smallest_pivot() >= least) return false;
  const SoftSpot spot = referee().find_soft_spot(least);
  soft_ = spot.found;
  if (spot.pivot < kSoftPivot) counts_.soft_node = spot.node;
  if (spot.pivot < kSoftPivot) counts_.soft_pivot = spot.pivot;
  if (spot.pivot < kSoftPivot) counts_.soft_bonds = bonds_at(network_, spot.node);
  if (soft_ && least > kSoftPivot) counts_.soft_contrast = widest;
  return soft_;
}

/// The last break has left a slack that double hardly tells from 0.
bool Equilibrium::has_softened(const Critical& next) {
  const double bent = 1 / next.stiffness;
  const double slack = slack_of_break(last_energy_, last_bent_, bent);
  const bool known = last_energy_ > 0 && last_broken_ + 1 == removed_.size();
  const double force = threshold_[next.bond] / next.load;
  last_energy_ = force * force / network_.stiffness[next.bond];
  last_bent_ = bent;
  last_broken_ = removed_.size();
  return known && slack < kSoftSlack;
}

/// A strategy that isn't believed about the intact network has found no F of it either.
void Equilibrium::begin_referee() {
  referee().begin(threshold_, removed_, removed_.empty() ? 0 : intact_stiffness_);
}

/// From here to the end of the sample.
State Equilibrium::hand_over(Critical& next) {
  refereed_ = true;
  begin_referee();
  return ask_referee(next);
}

/// This break alone.
State Equilibrium::consult(Critical& next) {
  begin_referee();
  const State state = ask_referee(next);
  complaint_ = referee().complaint();
  intact_stiffness_ = referee().intact_stiffness();
  counts_.refereed += state == State::carrying ? 1 : 0;
  return state;
}

/// Pivots of a soft network are no factor to lend.
State Equilibrium::ask_referee(Critical& next) {
  return referee().decide(next, soft_ ? nullptr : held_factor());
}

/// The strategy found nothing that carries, or too little for double, or gave up: the end of the network, or its own?
State Equilibrium::confirm_end(Critical& next) {
  const std::string why = complaint_;
  if (why.empty()) return hand_over(next);
  ++counts_.confirmations;
  const State state = consult(next);
  if (state != State::carrying || !iterates()) return state;
  if (next.stiffness < kRefereedStiffness * intact_stiffness_) return hand_over(next);
  complaint_ = why +
               " though the network still carries: try a direct solver (-pc_type updown), a tighter "
               "-ksp_rtol, or more -ksp_max_it";
  return State::unsolved;
}

State Equilibrium::double_check(Critical& next) {
  r_.resize(static_cast<std::size_t>(network_.unknowns));
  ++counts_.checks;
  double error = backward_error(network_, broken_, displacements(), r_);
  if (!(error <= options_.check_bound)) {
    const State state = renew() ? search(next) : State::failed;
    if (state != State::carrying) return state;
    error = backward_error(network_, broken_, displacements(), r_);
  }
  counts_.largest_residual = std::max(counts_.largest_residual, error);
  if (error <= options_.check_bound) return State::carrying;
  complaint_ =
      describe("-equilibrium_check: even from scratch the solver leaves a backward error of %.2g, above %.2g",
               error, options_.check_bound);
  return State::unsolved;
}

State Equilibrium::look_for_doubt(Critical& next) {
  if (!is_doubtful(next)) return State::carrying;
  if (iterates()) {
    ++counts_.doubtful;
    if (counts_.first_doubtful == 0) counts_.first_doubtful = std::ssize(removed_) + 1;
    return State::carrying;
  }
  const State state = renew() ? search(next) : State::failed;
  if (state == State::failed) return confirm_end(next);
  if (state != State::carrying || !is_doubtful(next)) return state;
  if (is_foreign() && removed_.empty() && !(last_residual_ < kNoSolution)) {
    complaint_ = describe(
        "the solver leaves a residual of %.2g of the load: it doesn't solve; try -ksp_type cg with "
        "this -pc_type, or -pc_type updown",
        last_residual_);
    return State::unsolved;
  }
  return consult(next);
}

/// By a new look at the residual.
bool Equilibrium::is_doubtful(const Critical& next) {
  r_.resize(static_cast<std::size_t>(network_.unknowns));
  const auto u = displacements();
  residual(network_, broken_, u, r_);
  const double norm = std::sqrt(std::inner_product(r_.begin(), r_.end(), r_.begin(), 0.0));
  counts_.loosest_residual = std::max(counts_.loosest_residual, norm);
  last_residual_ = norm;
  suspicious_ = !(norm <= kDoubtfulResidual);
  const SolvedState state{network_, threshold_, options_.break_on, intact_stiffness_, u, next};
  return is_left_open(state, norm, iterates());
}

}  // namespace crackle
