#include "crackle/equilibrium/quad_solver.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "crackle/equilibrium/criterion.hpp"

namespace crackle {

namespace {

/// Rounding in 113 bits.
constexpr double kRounding = 1e-34;
/// A pivot below this fraction of its diagonal entry has its motion looked at.
constexpr double kSmallPivot = 1e-16;
/// A motion that stretches no bond by more than this part of itself is free: so many roundings of positions, or of the
/// motion, which is right to kRounding times the contrast; at least, and at most, this.
constexpr double kFreeTurns = 16;
constexpr double kFreeRoundings = 1e3;
constexpr double kLeastFree = 1e-22;
constexpr double kMostFree = 1e-8;
/// Between that and so many times that, nobody knows.
constexpr double kOpen = 100;
/// A bond nearly at right angles to a motion holds it by no more than its small component along it; no rounding makes
/// that, where it is more than this part of the terms that it is a sum of. (Components of the motion that are right to
/// 8 digits only count.)
constexpr double kOfItsTerms = 1e-6;
constexpr double kSureRoundings = 1e8;
constexpr double kOutweighs = 1e6;
/// Refinement ends when a correction changes no force by more than this fraction of the largest, when it no longer
/// halves, or after so many steps.
constexpr double kConverged = 1e-26;
constexpr int kMostSteps = 60;
/// A last correction above this fraction tells nothing.
constexpr double kTold = 1e-6;
/// A downdated factor is made anew when it has lost more than this at once, or leaves an error so many times that of
/// the last new one.
constexpr double kLeastSlack = 1e-8;
constexpr double kWorse = 100;
/// An error is taken to be at most this multiple of the last correction, and of the rounding of k |b| |u|.
constexpr double kErrorPerCorrection = 10;
constexpr double kErrorPerRounding = 16;

/// What rounding of positions alone brings.
double free_by_turns(double turned) {
  return std::min(std::max(kFreeTurns * turned, kLeastFree), kMostFree);
}

}  // namespace

QuadSolver::QuadSolver(const Network& network, QuadOrder order, PhaseTimes& times)
    : network_(network),
      times_(times),
      order_(std::move(order)),
      bonds_(make_quad_bonds(network, order_)),
      factor_(order_.first),
      motion_error_(kRounding * contrast(network)),
      free_refined_(free_by_turns(bonds_.turned)),
      free_(std::min(std::max(free_refined_, kFreeRoundings * motion_error_), kMostFree)),
      broken_(network.lattice.bond.size(), 0),
      u_(order_.row.size()),
      r_(u_.size()),
      force_(network.lattice.bond.size()) {
  for (const Dof slot : network.idle) idle_.push_back(order_.row[slot]);
}

void QuadSolver::reset() {
  std::ranges::fill(broken_, std::uint8_t{0});
  stale_ = true;
  asked_ = false;
}

void QuadSolver::remove(BondId bond) {
  assert(broken_[bond] == 0);
  broken_[bond] = 1;
  if (stale_ || !network_.can_stretch(bond)) return;
  const PhaseScope scope(times_, Phase::downdate);
  std::ranges::fill(r_, Quad(0));
  int begin = factor_.size();
  for (int i = 0; i < bonds_.width; ++i) {
    if (bonds_.values(bond)[i] == 0) continue;
    r_[bonds_.rows(bond)[i]] = bonds_.values(bond)[i];
    begin = std::min(begin, bonds_.rows(bond)[i]);
  }
  const auto slack = static_cast<double>(factor_.downdate(begin, r_, network_.stiffness[bond]));
  changed_ = true;
  stale_ = asked_ = !(slack > kLeastSlack);
  if (!stale_) counts_.smallest_slack = std::min(counts_.smallest_slack, slack);
}

void QuadSolver::get_displacements(std::span<double> u) const {
  assert(u.size() == u_.size());
  for (std::size_t i = 0; i < u.size(); ++i) u[i] = static_cast<double>(u_[order_.row[i]]);
}

void QuadSolver::assemble() {
  const PhaseScope scope(times_, Phase::assembly);
  factor_.clear();
  for (const int row : idle_) factor_.at(row, row) = 1;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (!acts(e)) continue;
    const auto rows = bonds_.rows(e);
    const auto values = bonds_.values(e);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = 0; j < rows.size(); ++j) {
        if (rows[i] < rows[j] || values[i] == 0 || values[j] == 0) continue;
        factor_.at(rows[i], rows[j]) += Quad(network_.stiffness[e]) * values[i] * values[j];
      }
    }
  }
}

/// Before a sample that starts with broken bonds: which motions of the intact network are free.
QuadSolver::Outcome QuadSolver::factor() {
  if (!is_intact() && was_free_.empty()) {
    const std::vector<std::uint8_t> broken(broken_);
    std::ranges::fill(broken_, std::uint8_t{0});
    const Outcome outcome = factor();
    std::ranges::copy(broken, broken_.begin());
    if (outcome == Outcome::vague) return outcome;
  }
  assemble();
  const PhaseScope scope(times_, Phase::factor);
  ++counts_.factorizations;
  if (std::exchange(asked_, false)) ++counts_.refactors;
  counts_.null_pivots = 0;
  complaint_.clear();
  changed_ = false;
  const bool whole =
      factor_.factor([this](int row, Quad pivot, Quad diagonal) { return judge(row, pivot, diagonal); });
  stale_ = !whole || factor_.is_pinned(factor_.size() - 1);
  if (!whole) return Outcome::vague;
  if (is_intact() && was_free_.empty()) {
    for (int row = 0; row < factor_.size(); ++row) was_free_.push_back(factor_.is_pinned(row) ? 1 : 0);
  }
  return stale_ ? Outcome::loose : Outcome::solved;
}

bool QuadSolver::is_intact() const {
  return std::ranges::find(broken_, std::uint8_t{1}) == broken_.end();
}

/// A small pivot is the energy of its motion, which an error of that motion enters squared; 0 for a free one, and
/// negative where that can't be told.
Quad QuadSolver::judge(int row, Quad pivot, Quad diagonal) {
  if (pivot > kSmallPivot * diagonal) return pivot;
  factor_.null_vector(row, r_);
  const bool plate = row + 1 == factor_.size();
  if (plate && !is_intact()) return energy(r_);  // F beside the intact one says what is 0
  const bool new_free = !is_intact() && !was_free_.empty() && was_free_[row] == 0;
  const Motion motion = look_at(r_, new_free ? kLeastFree : free_);
  if (motion == Motion::free) {
    if (!plate) ++counts_.null_pivots;
    return 0;
  }
  if (motion == Motion::stiff) return energy(r_);
  complaint_ = describe_open(row);
  return -1;
}

/// The one line that says which node it is.
std::string QuadSolver::describe_open(int row) const {
  const Dof unknown = static_cast<Dof>(std::ranges::find(order_.row, row) - order_.row.begin());
  const auto slot = std::ranges::find(network_.dof, unknown) - network_.dof.begin();
  std::array<char, 200> text{};
  std::snprintf(
      text.data(), text.size(),
      " can move and stretch no bond by more than %.1g of that: rounding leaves open whether it is held",
      largest_stretch_);
  const auto node = static_cast<NodeId>(slot / network_.components);
  return name_node(node, bonds_at(network_, node)) + text.data();
}

QuadSolver::Motion QuadSolver::look_at(std::span<const Quad> z, double free) {
  Quad way = 0;
  for (const Quad x : z) way = std::max(way, magnitude(x));
  Quad most = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (acts(e)) most = std::max(most, magnitude(bonds_.stretch(e, z)));
  }
  largest_stretch_ = static_cast<double>(most / way);
  if (largest_stretch_ >= kOpen * free) return Motion::stiff;
  const Motion across = look_across(z, way);
  if (across != Motion::free) return across;
  return largest_stretch_ <= free ? Motion::free : Motion::open;
}

/// Stiff by bonds nearly at right angles to it, beyond what rounding of positions may have turned them: if they bear
/// its energy. What cancels in the others may be rounding; if that has more, nobody knows.
QuadSolver::Motion QuadSolver::look_across(std::span<const Quad> z, Quad way) const {
  const Quad sure = kSureRoundings * motion_error_ * way;
  const Quad turned = kFreeTurns * bonds_.turned * way;
  Quad across = 0;
  Quad other = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (!acts(e)) continue;
    Quad part = 0;
    Quad terms = 0;
    for (int i = 0; i < bonds_.width; ++i) {
      const Quad x = z[bonds_.rows(e)[i]];
      if (magnitude(x) <= sure) continue;
      part += bonds_.values(e)[i] * x;
      terms += magnitude(bonds_.values(e)[i] * x);
    }
    const bool holds = magnitude(part) > turned && magnitude(part) > kOfItsTerms * terms;
    const Quad stretch = bonds_.stretch(e, z);
    (holds ? across : other) += network_.stiffness[e] * stretch * stretch;
  }
  if (across == 0) return Motion::free;
  return across > kOutweighs * other ? Motion::stiff : Motion::open;
}

Quad QuadSolver::energy(std::span<const Quad> x) const {
  Quad sum = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (!acts(e)) continue;
    const Quad stretch = bonds_.stretch(e, x);
    sum += network_.stiffness[e] * stretch * stretch;
  }
  return sum;
}

double QuadSolver::largest(std::span<const Quad> x) const {
  Quad most = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (acts(e)) most = std::max(most, network_.stiffness[e] * magnitude(bonds_.stretch(e, x)));
  }
  return static_cast<double>(most);
}

QuadSolver::Outcome QuadSolver::solve() {
  if (stale_) {
    const Outcome outcome = factor();
    if (outcome != Outcome::solved) return outcome;
  }
  double error = refine();
  if (changed_ && !(error <= kWorse * std::max(fresh_error_, kConverged))) {
    asked_ = true;
    const Outcome outcome = factor();
    if (outcome != Outcome::solved) return outcome;
    error = refine();
  }
  if (!changed_) fresh_error_ = error;
  const PhaseScope scope(times_, Phase::search);
  // what was held stays held while bonds that carry force break: F beside the intact one says what is 0
  // as long as refinement tells
  const bool open = is_intact() || !(error < kTold);
  if (open && look_at(u_, free_refined_) == Motion::free) return Outcome::loose;
  // of all motions with this plate displacement the true one has the least energy: an error enters squared
  const Quad plate = u_.back();
  stiffness_ = energy(u_) / (plate * plate);
  note_forces(error);
  return Outcome::solved;
}

/// r = e_plate - K u; held and idle unknowns bear nothing.
void QuadSolver::fill_residual() {
  std::ranges::fill(r_, Quad(0));
  r_.back() = 1;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (!acts(e)) continue;
    const Quad force = network_.stiffness[e] * bonds_.stretch(e, u_);
    for (int i = 0; i < bonds_.width; ++i) r_[bonds_.rows(e)[i]] -= bonds_.values(e)[i] * force;
  }
}

/// The last correction's largest force, relative to the largest.
double QuadSolver::refine() {
  const PhaseScope scope(times_, Phase::solve);
  factor_.solve_last(u_);
  double last = 1;
  for (int step = 0; step < kMostSteps; ++step) {
    fill_residual();
    factor_.solve(r_);
    for (std::size_t i = 0; i < u_.size(); ++i) u_[i] += r_[i];
    const double change = largest(r_) / largest(u_);
    if (change <= kConverged || (step > 0 && !(change < 0.5 * last))) return change;
    last = change;
  }
  return last;
}

void QuadSolver::note_forces(double error) {
  largest_force_ = 0;
  double rounded = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    force_[e] = 0;
    if (!acts(e)) continue;
    force_[e] = network_.stiffness[e] * bonds_.stretch(e, u_);
    largest_force_ = std::max(largest_force_, static_cast<double>(magnitude(force_[e])));
    double way = 0;
    for (int i = 0; i < bonds_.width; ++i) {
      way += std::abs(static_cast<double>(bonds_.values(e)[i] * u_[bonds_.rows(e)[i]]));
    }
    rounded = std::max(rounded, network_.stiffness[e] * way);
  }
  uncertain_ =
      std::max(kErrorPerCorrection * error * largest_force_, kErrorPerRounding * kRounding * rounded);
  const Nothing<Quad> nothing(u_.back(), 1);
  for (BondId e = 0; e < network_.bonds(); ++e) {
    const Quad size = magnitude(force_[e]);
    if (size <= uncertain_ || !nothing.is_less_than_force(size, network_.stiffness[e])) force_[e] = 0;
  }
}

}  // namespace crackle
