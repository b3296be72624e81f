#include "crackle/compare/compare_reference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/equilibrium/criterion.hpp"
#include "crackle/equilibrium/quad_solver.hpp"
#include "crackle/factor/cholmod_factor.hpp"
#include "crackle/network/matrix_rows.hpp"
#include "crackle/network/network_matrix.hpp"

namespace crackle {

namespace {

/// Refinement ends when a correction changes no force by more than this fraction, when it no longer halves, or
/// after so many steps.
constexpr double kConverged = 1e-17;
constexpr int kMostSteps = 40;
/// A factor that has lost more than this, or makes the error shrink more slowly, is made anew.
constexpr double kLeastSlack = 1e-6;
constexpr double kWanted = 1e-15;
/// F of the intact network below this fraction of the plate's diagonal entry is rounding.
constexpr double kNoStiffness = 1e-12;

/// b_e . u
template <class Real>
Real stretch(const Network& network, BondId e, std::span<const Real> u) {
  Real sum = 0;
  for (std::size_t i = 0; i < network.bond_dofs(e).size(); ++i) {
    sum += static_cast<Real>(network.bond_values(e)[i]) * u[network.bond_dofs(e)[i]];
  }
  return sum;
}

/// r = e_plate - K u from the bonds.
template <class Real>
void fill_residual(const Network& network, std::span<const std::uint8_t> broken, std::span<const Real> u,
                   std::span<Real> r) {
  std::ranges::fill(r, Real(0));
  r[network.plate] = 1;
  for (const Dof slot : network.idle) r[slot] = -u[slot];
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (broken[e] != 0 || !network.can_stretch(e)) continue;
    const Real force = static_cast<Real>(network.stiffness[e]) * stretch(network, e, u);
    for (std::size_t i = 0; i < network.bond_dofs(e).size(); ++i) {
      r[network.bond_dofs(e)[i]] -= static_cast<Real>(network.bond_values(e)[i]) * force;
    }
  }
}

/// max_e |k b . u| over the bonds that are there.
template <class Real>
double largest_force(const Network& network, std::span<const std::uint8_t> broken, std::span<const Real> u) {
  double largest = 0;
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (broken[e] != 0 || !network.can_stretch(e)) continue;
    largest = std::max(largest, network.stiffness[e] * std::abs(static_cast<double>(stretch(network, e, u))));
  }
  return largest;
}

}  // namespace

/// Displacements of one state in long double, and how far off they may be.
struct Reference::Solved {
  std::vector<long double> u;
  double error = 0;
  bool singular = false;
};

/// A new factor for every state: what a strategy makes of downdates is held to it.
struct Reference::QuadState {
  QuadState(const Network& network, QuadOrder order) : solver(network, std::move(order), times) {}

  PhaseTimes times;
  QuadSolver solver;
};

struct Reference::RefinedSolver {
  explicit RefinedSolver(const Network& whole)
      : network(whole),
        matrix(whole),
        factor(MatrixRows(matrix.get()).rows(), whole.components),
        r(static_cast<std::size_t>(whole.unknowns)),
        load(r.size()),
        step(r.size()),
        step_wide(r.size()) {}

  void reset(std::span<const std::uint8_t> broken) {
    matrix.update(removed, broken);
    removed.clear();
    stale = true;
  }

  void remove(BondId bond, std::span<const std::uint8_t> broken) {
    removed.push_back(bond);
    matrix.update({&bond, 1}, broken);
    const RankOne w = break_change(network, bond);
    if (!stale) stale = !(factor.downdate({&w, 1}) > kLeastSlack);
  }

  /// Makes a factor; false when K is singular.
  bool refactor() {
    const MatrixRows view(matrix.get());
    stale = false;
    return factor.factor(view.rows());
  }

  void solve(std::span<const std::uint8_t> broken, Solved& solved) {
    const bool fresh = stale;
    solved.singular = stale && !refactor();
    if (!solved.singular) refine(broken, solved);
    if (solved.singular || fresh || solved.error < kWanted) return;
    solved.singular = !refactor();
    if (!solved.singular) refine(broken, solved);
  }

  /// From zero. The error is what the corrections still to come add up to, if they go on shrinking as the last
  /// ones did; one that no longer shrinks is the error itself.
  void refine(std::span<const std::uint8_t> broken, Solved& solved) {
    std::ranges::fill(solved.u, 0.0L);
    double last = 1;
    for (int i = 0; i < kMostSteps; ++i) {
      fill_residual<long double>(network, broken, solved.u, r);
      std::ranges::copy(r, load.begin());
      factor.solve(load, step);
      for (std::size_t j = 0; j < step.size(); ++j) solved.u[j] += step_wide[j] = step[j];
      const double change = largest_force<long double>(network, broken, step_wide) /
                            largest_force<long double>(network, broken, solved.u);
      const double shrinks = change / last;
      solved.error = shrinks < 0.5 ? change * shrinks / (1 - shrinks) : change;
      if (i > 0 && (change < kConverged || !(shrinks < 0.5))) break;
      last = change;
    }
    solved.error = std::max(solved.error, rounding(broken, solved));
  }

  /// Of a force k b . u with u in long double: relative to the largest force.
  double rounding(std::span<const std::uint8_t> broken, const Solved& solved) const {
    const auto magnitude = [](long double x) { return std::abs(x); };
    const long double u = std::abs(*std::ranges::max_element(solved.u, {}, magnitude));
    return static_cast<double>(std::numeric_limits<long double>::epsilon() * u) * network.norm /
           largest_force<long double>(network, broken, solved.u);
  }

  const Network& network;
  NetworkMatrix matrix;
  CholmodFactor factor;
  std::vector<BondId> removed;
  bool stale = true;
  std::vector<long double> r;
  std::vector<double> load, step;
  std::vector<long double> step_wide;
};

Reference::Reference(const Network& network, BreakOn break_on, ReferenceKind kind)
    : network_(network),
      break_on_(break_on),
      broken_(network.lattice.bond.size(), 0),
      threshold_(network.lattice.bond.size()) {
  state_.force.resize(network.lattice.bond.size());
  QuadOrder order = find_quad_order(network);
  const bool small = profile_work(order.first) <= kMostQuadWork;
  if (kind == ReferenceKind::quad || (kind == ReferenceKind::automatic && small)) {
    quad_ = std::make_unique<QuadState>(network, std::move(order));
    return;
  }
  refined_ = std::make_unique<RefinedSolver>(network);
  solved_ = std::make_unique<Solved>();
  solved_->u.resize(static_cast<std::size_t>(network.unknowns));
}

Reference::~Reference() = default;

std::string Reference::name() const {
  return quad_ ? "quad: L D L^T in 113 bits after every break"
               : "refined: CHOLMOD, iterative refinement in long double";
}

void Reference::reset(std::span<const double> threshold) {
  std::ranges::fill(broken_, std::uint8_t{0});
  for (BondId e = 0; e < network_.bonds(); ++e) {
    threshold_[e] = network_.can_stretch(e) ? threshold[e] : std::numeric_limits<double>::infinity();
  }
  intact_stiffness_ = 0;
  if (quad_) quad_->solver.reset();
  if (refined_) refined_->reset(broken_);
}

void Reference::remove(BondId bond) {
  broken_[bond] = 1;
  threshold_[bond] = std::numeric_limits<double>::infinity();
  if (quad_) quad_->solver.renew();
  if (quad_) quad_->solver.remove(bond);
  if (refined_) refined_->remove(bond, broken_);
}

const ReferenceState& Reference::solve() {
  state_.state = State::failed;
  if (quad_) {
    solve_quad();
  } else {
    solve_refined();
  }
  return state_;
}

void Reference::solve_quad() {
  QuadSolver& solver = quad_->solver;
  const QuadSolver::Outcome outcome = solver.solve();
  if (outcome == QuadSolver::Outcome::vague) throw SolverError("the reference: " + solver.complaint());
  if (outcome == QuadSolver::Outcome::loose) return;
  const auto stiffness = static_cast<double>(solver.stiffness());
  if (intact_stiffness_ == 0) intact_stiffness_ = stiffness;
  if (!(stiffness > kFailedStiffness * intact_stiffness_)) return;
  std::ranges::transform(solver.force(), state_.force.begin(), [](Quad f) { return static_cast<double>(f); });
  state_.largest_force = solver.largest_force();
  state_.error = solver.uncertain() / solver.largest_force();
  state_.critical.stiffness = stiffness;
  if (find_largest_ratio(solver.force(), threshold_, break_on_, state_.critical))
    state_.state = State::carrying;
}

void Reference::solve_refined() {
  refined_->solve(broken_, *solved_);
  const std::span<const long double> u = solved_->u;
  const long double plate = u[network_.plate];
  const double stiffness = static_cast<double>(1 / plate);
  if (solved_->singular || !(plate > 0)) return;
  if (intact_stiffness_ == 0 && stiffness > kNoStiffness * network_.plate_diagonal)
    intact_stiffness_ = stiffness;
  if (!(stiffness > kFailedStiffness * intact_stiffness_) || intact_stiffness_ == 0) return;
  state_.error = solved_->error;
  state_.critical.stiffness = stiffness;
  state_.largest_force = 0;
  const Nothing<long double> nothing(plate, 1);
  std::vector<long double> force(threshold_.size(), 0.0L);
  long double energy = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    const bool there = broken_[e] == 0 && network_.can_stretch(e);
    const long double length = there ? stretch(network_, e, u) : 0.0L;
    const long double pull = network_.stiffness[e] * length;
    energy += pull * length;
    state_.force[e] = static_cast<double>(pull);
    state_.largest_force = std::max(state_.largest_force, std::abs(state_.force[e]));
    if (nothing.is_less_than(std::abs(length), std::abs(pull))) force[e] = pull;
  }
  // whatever u is worth: of all motions of the plate equilibrium has the least energy
  if (energy <= kFailedStiffness * intact_stiffness_ * plate * plate) return;
  if (find_largest_ratio<long double>(force, threshold_, break_on_, state_.critical)) {
    state_.state = State::carrying;
  }
}

}  // namespace crackle
