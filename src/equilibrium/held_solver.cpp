#include "crackle/equilibrium/held_solver.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "crackle/equilibrium/criterion.hpp"
#include "crackle/network/matrix_rows.hpp"

namespace crackle {

namespace {

/// Refinement ends when the corrections still to come, if they go on shrinking as the last ones did, change no force by
/// more than this fraction of the largest, and gives up when one doesn't halve the last, or after so many steps.
constexpr double kConverged = 1e-18;
constexpr double kConvergedWide = 1e-24;
constexpr int kMostSteps = 60;
/// Forces that balance what rounding leaves of the load are at most this multiple of it.
constexpr double kForcePerLoad = 10;
/// A force is taken to be in error by at most this multiple of the corrections still to come.
constexpr double kErrorPerCorrection = 10;
/// A motion that stretches no bond by more than this part of itself is free: rounding of directions, and of the motion.
constexpr double kFreeStretch = 1e-12;
/// A bond whose direction has a component below this, and above so many times what rounding of positions has turned
/// bonds by, may be all that holds a motion that looks free.
constexpr double kSlightDirection = 1e-10;
constexpr double kRoundingsOfTurn = 16;
/// Small pivots that are looked at one by one for the smallest.
constexpr std::size_t kMostLookedAt = 200;

QuadOrder network_order(const Network& network) {
  QuadOrder order;
  order.row.resize(static_cast<std::size_t>(network.unknowns));
  std::iota(order.row.begin(), order.row.end(), 0);
  return order;
}

double largest_of(std::span<const double> x) {
  double largest = 0;
  for (const double entry : x) largest = std::max(largest, std::abs(entry));
  return largest;
}

}  // namespace

HeldSolver::HeldSolver(const Network& network, PhaseTimes& times)
    : network_(network),
      times_(times),
      bonds_(make_quad_bonds(network, network_order(network))),
      twice_(network, bonds_),
      gone_(network.bonds(), 0),
      high_(static_cast<std::size_t>(network.unknowns)),
      low_(high_.size()),
      force_(network.bonds()),
      load_(high_.size()),
      step_(high_.size()) {}

NetworkMatrix& HeldSolver::matrix() {
  if (!matrix_) matrix_ = std::make_unique<NetworkMatrix>(network_);
  return *matrix_;
}

/// K without the broken bonds, and without what couples the plate to the rest.
bool HeldSolver::factor(std::span<const std::uint8_t> broken) {
  const PhaseScope scope(times_, Phase::factor);
  std::vector<BondId> changed;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (gone_[e] != broken[e] && network_.can_stretch(e)) changed.push_back(e);
  }
  matrix().update(changed, broken);
  std::ranges::copy(broken, gone_.begin());
  const MatrixRows view(matrix().get());
  const SymmetricRows K = view.rows();
  value_.assign(K.value, K.value + K.start[K.n]);
  for (int row = 0; row < K.n; ++row) {
    for (int i = K.start[row]; i < K.start[row + 1]; ++i) {
      const bool at_plate = row == network_.plate || K.column[i] == network_.plate;
      if (at_plate) value_[i] = row == K.column[i] ? 1 : 0;
    }
  }
  const SymmetricRows held{K.n, K.start, K.column, value_.data()};
  if (!factor_) factor_ = std::make_unique<CholmodFactor>(held, network_.components);
  return factor_->factor(held);
}

/// A bond that carries force holds no motion alone: breaks make no new free one.
bool HeldSolver::holds(std::span<const std::uint8_t> broken) {
  return factor(broken) && factor_->pinned().size() <= free_motions_;
}

HeldSolver::Outcome HeldSolver::solve_by(HeldFactor& own, std::span<const std::uint8_t> broken, double none) {
  if (!own.move_plate(high_) || own.held_pins() > free_motions_) return Outcome::vague;
  const PhaseScope scope(times_, Phase::solve);
  // of all motions that move the plate equilibrium has the least energy, F
  if (energy(network_, broken, high_) <= none) return Outcome::loose;
  return refine(broken, none, [&own](std::span<const double> load, std::span<double> x) {
    return own.solve_held(load, x);
  });
}

HeldSolver::Outcome HeldSolver::solve(std::span<const std::uint8_t> broken, double none, HeldFactor* own) {
  assert(broken.size() == gone_.size());
  if (own != nullptr) {
    const Outcome outcome = solve_by(*own, broken, none);
    if (outcome != Outcome::vague) return outcome;
  }
  if (!holds(broken)) return Outcome::vague;
  const PhaseScope scope(times_, Phase::solve);
  std::ranges::fill(high_, 0.0);
  high_[network_.plate] = 1;
  return refine(broken, none, [this](std::span<const double> load, std::span<double> x) {
    factor_->solve(load, x);
    return true;
  });
}

HeldSolver::Outcome HeldSolver::solve_wide(std::span<const std::uint8_t> broken, double none) {
  if (!holds(broken)) return Outcome::vague;
  const PhaseScope scope(times_, Phase::solve);
  return refine_wide(broken, none);
}

/// In any force, by step_.
double HeldSolver::largest_change(std::span<const std::uint8_t> broken) const {
  double change = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (broken[e] == 0) {
      change = std::max(change, network_.stiffness[e] * std::abs(elongation(network_, e, step_)));
    }
  }
  return change;
}

/// From high_ on. A step's own change of forces and F is taken in double: it is smaller than they by all the digits that
/// double has, when it is the last.
template <class Solve>
HeldSolver::Outcome HeldSolver::refine(std::span<const std::uint8_t> broken, double none, Solve solve) {
  std::ranges::fill(low_, 0.0);
  double last = 0;
  for (int i = 0; i < kMostSteps; ++i) {
    const TwiceSums sums = twice_.fill(broken, high_, low_, load_, force_);
    if (i == 0) last = sums.terms;  // what equilibrium has changed since nothing but the plate had moved
    if (sums.energy <= none) return Outcome::loose;
    load_[network_.plate] = 0;
    if (!solve(load_, step_)) return Outcome::vague;
    const double change = largest_change(broken);
    for (std::size_t j = 0; j < high_.size(); ++j) {
      const double sum = high_[j] + step_[j];
      const double part = sum - high_[j];
      low_[j] += (high_[j] - (sum - part)) + (step_[j] - part);
      high_[j] = sum;
    }
    const double shrinks = change / last;
    last = change;
    if (i > 0 && !(shrinks < 0.5)) return Outcome::vague;
    // a motion too stiff in the factor gets the same small step again and again: only the second one shows it
    if (i == 0 || !(change * shrinks <= kConverged * sums.largest)) continue;
    stiffness_ = sums.energy - std::inner_product(load_.begin(), load_.end(), step_.begin(), 0.0);
    if (stiffness_ <= none) return Outcome::loose;
    take_forces(broken, change * shrinks, sums.terms);
    return Outcome::solved;
  }
  return Outcome::vague;
}

void HeldSolver::take_forces(std::span<const std::uint8_t> broken, double error, double terms) {
  const double rounding =
      kForcePerLoad * std::sqrt(static_cast<double>(high_.size())) * TwiceBonds::kRounding;
  uncertain_ = (kErrorPerCorrection * error + rounding * terms) / stiffness_;
  const Nothing<double> nothing(1, stiffness_);
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (broken[e] != 0) continue;
    const double force = force_[e] + network_.stiffness[e] * elongation(network_, e, step_);
    const double stretch = force / network_.stiffness[e];
    force_[e] = nothing.is_less_than(std::abs(stretch), std::abs(force)) ? force / stiffness_ : 0;
  }
}

/// load_ = -K v_ from the bonds, 0 at the plate; the energy of v_ and its largest force on the way.
void HeldSolver::fill_load(std::span<const std::uint8_t> broken) {
  std::ranges::fill(r_, Quad(0));
  energy_ = 0;
  largest_ = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (broken[e] != 0 || !network_.can_stretch(e)) continue;
    const Quad stretch = bonds_.stretch(e, v_);
    const Quad force = network_.stiffness[e] * stretch;
    energy_ += force * stretch;
    largest_ = std::max(largest_, static_cast<double>(magnitude(force)));
    const auto rows = bonds_.rows(e);
    const auto values = bonds_.values(e);
    for (std::size_t i = 0; i < rows.size(); ++i) r_[rows[i]] -= values[i] * force;
  }
  r_[network_.plate] = 0;
  std::ranges::transform(r_, load_.begin(), [](Quad x) { return static_cast<double>(x); });
}

HeldSolver::Outcome HeldSolver::refine_wide(std::span<const std::uint8_t> broken, double none) {
  v_.assign(high_.size(), Quad(0));
  r_.resize(high_.size());
  v_[network_.plate] = 1;
  double last = 0;
  for (int i = 0; i < kMostSteps; ++i) {
    fill_load(broken);
    if (energy_ <= none) return Outcome::loose;
    factor_->solve(load_, step_);
    const double change = largest_change(broken);
    for (std::size_t j = 0; j < v_.size(); ++j) v_[j] += step_[j];
    const double shrinks = i == 0 ? 1 : change / last;
    if (i > 0 && !(shrinks < 0.5)) return Outcome::vague;
    if (i > 0 && change * shrinks <= kConvergedWide * largest_) {
      note_forces(broken);
      return stiffness_ <= none ? Outcome::loose : Outcome::solved;
    }
    last = change;
  }
  return Outcome::vague;
}

void HeldSolver::note_forces(std::span<const std::uint8_t> broken) {
  fill_load(broken);
  stiffness_ = static_cast<double>(energy_);
  uncertain_ = kErrorPerCorrection * kConvergedWide * largest_ / stiffness_;
  const Nothing<Quad> nothing(1, 1);
  for (BondId e = 0; e < network_.bonds(); ++e) {
    force_[e] = 0;
    if (broken[e] != 0 || !network_.can_stretch(e)) continue;
    const Quad stretch = bonds_.stretch(e, v_);
    const Quad force = network_.stiffness[e] * stretch / energy_;
    if (nothing.is_less_than(magnitude(stretch), magnitude(force))) force_[e] = static_cast<double>(force);
  }
  for (std::size_t j = 0; j < v_.size(); ++j) high_[j] = static_cast<double>(v_[j]);
}

void HeldSolver::get_displacements(std::span<double> u) const {
  assert(u.size() == high_.size() && stiffness_ > 0);
  std::ranges::transform(high_, u.begin(), [this](double x) { return x / stiffness_; });
}

bool HeldSolver::is_free(std::span<const double> motion) const {
  double most = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (network_.can_stretch(e)) most = std::max(most, std::abs(elongation(network_, e, motion)));
  }
  return most <= kFreeStretch * largest_of(motion);
}

NodeId HeldSolver::node_of(Dof dof) const {
  const auto slot = std::ranges::find(network_.dof, dof) - network_.dof.begin();
  return static_cast<NodeId>(slot / network_.components);
}

/// A motion in double doesn't show what a bond nearly at right angles to it holds; what rounding has turned holds nothing.
SoftSpot HeldSolver::find_slight_direction() const {
  const double turned = kRoundingsOfTurn * bonds_.turned;
  for (BondId e = 0; network_.components > 1 && e < network_.bonds(); ++e) {
    const Vector2 d = network_.lattice.direction[e];
    const double slight = std::min(std::abs(d.x), std::abs(d.y));
    if (slight > turned && slight < kSlightDirection && network_.can_stretch(e)) {
      return {true, network_.lattice.bond[e][0], slight * slight};
    }
  }
  return {};
}

SoftSpot HeldSolver::find_soft_spot(double least) {
  SoftSpot spot;
  const std::vector<std::uint8_t> none(gone_.size(), 0);
  if (!factor(none)) return {.found = true};
  const std::vector<int> small = factor_->small_pivots(least);
  // energies of these motions add up, and they touch one another nowhere: free together, free each
  std::ranges::fill(step_, 0.0);
  for (const int dof : small) step_[dof] = 1;
  factor_->back_substitute(step_);
  if (small.empty()) return spot;
  if (is_free(step_)) {
    spot = find_slight_direction();
    free_motions_ = spot.found ? 0 : factor_->pinned().size();
    return spot;
  }
  std::vector<double> diagonal(step_.size(), 0.0);
  for (BondId e = 0; e < network_.bonds(); ++e) {
    for (std::size_t i = 0; i < network_.bond_dofs(e).size(); ++i) {
      const double value = network_.bond_values(e)[i];
      diagonal[network_.bond_dofs(e)[i]] += network_.stiffness[e] * value * value;
    }
  }
  for (std::size_t i = 0; i < std::min(small.size(), kMostLookedAt); ++i) {
    std::ranges::fill(step_, 0.0);
    step_[small[i]] = 1;
    factor_->back_substitute(step_);
    if (is_free(step_)) continue;
    const double pivot = energy(network_, none, step_) / diagonal[small[i]];
    if (!spot.found || pivot < spot.pivot) spot = {true, node_of(small[i]), pivot};
  }
  spot.found = true;
  return spot;
}

}  // namespace crackle
