#include "crackle/compare_reference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "crackle/cholmod_factor.hpp"
#include "crackle/matrix_rows.hpp"
#include "crackle/network_matrix.hpp"
#include "crackle/profile_factor.hpp"

namespace crackle {

namespace {

/// A pivot in quadruple precision below this fraction of its diagonal entry is null. Stiffnesses may span 1e12 and
/// a network be near to failure on top of that; rounding leaves 1e-33.
constexpr double kNullQuad = 1e-26;
/// F of the intact network below this fraction of the plate's diagonal entry is rounding, in quadruple precision.
constexpr double kNoStiffnessQuad = 1e-26;
/// Refinement ends when a correction changes no force by more than this fraction, when it no longer halves, or
/// after so many steps.
constexpr double kConverged = 1e-17;
constexpr int kMostSteps = 40;
/// A factor that has lost more than this, or makes the error shrink more slowly, is made anew.
constexpr double kLeastSlack = 1e-6;
constexpr double kWanted = 1e-15;

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

std::vector<int> matrix_profile(const Network& network) {
  std::vector<int> first(static_cast<std::size_t>(network.unknowns));
  for (Dof row = 0; row < network.unknowns; ++row) first[row] = row;
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (!network.can_stretch(e)) continue;
    Dof least = network.plate;
    for (std::size_t i = 0; i < network.bond_dofs(e).size(); ++i) {
      if (network.bond_values(e)[i] != 0) least = std::min(least, network.bond_dofs(e)[i]);
    }
    for (std::size_t i = 0; i < network.bond_dofs(e).size(); ++i) {
      int& begin = first[network.bond_dofs(e)[i]];
      if (network.bond_values(e)[i] != 0) begin = std::min(begin, least);
    }
  }
  return first;
}

}  // namespace

/// Displacements of one state in long double, and how far off they may be.
struct Reference::Solved {
  std::vector<long double> u;
  double error = 0;
  bool singular = false;
};

struct Reference::QuadSolver {
  explicit QuadSolver(const Network& whole)
      : network(whole),
        factor(matrix_profile(whole)),
        u(static_cast<std::size_t>(whole.unknowns)),
        r(u.size()) {}

  void assemble(std::span<const std::uint8_t> broken) {
    factor.clear();
    for (const Dof slot : network.idle) factor.at(slot, slot) = 1;
    for (BondId e = 0; e < network.bonds(); ++e) {
      if (broken[e] != 0 || !network.can_stretch(e)) continue;
      const auto dofs = network.bond_dofs(e);
      const auto values = network.bond_values(e);
      for (std::size_t i = 0; i < dofs.size(); ++i) {
        for (std::size_t j = 0; j < dofs.size(); ++j) {
          if (dofs[i] < dofs[j] || values[i] == 0 || values[j] == 0) continue;
          factor.at(dofs[i], dofs[j]) += Quad(network.stiffness[e]) * values[i] * values[j];
        }
      }
    }
  }

  void solve(std::span<const std::uint8_t> broken, Solved& solved) {
    assemble(broken);
    factor.factor(kNullQuad);
    solved.singular = !(factor.last_pivot() > 0);
    if (solved.singular) return;
    std::ranges::fill(u, Quad(0));
    u.back() = 1;
    factor.solve(u);
    fill_residual<Quad>(network, broken, u, r);
    factor.solve(r);
    solved.error = largest_force<Quad>(network, broken, r) / largest_force<Quad>(network, broken, u);
    for (std::size_t i = 0; i < u.size(); ++i) solved.u[i] = static_cast<long double>(u[i] + r[i]);
  }

  const Network& network;
  ProfileFactor<Quad> factor;
  std::vector<Quad> u, r;
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
      solved_(std::make_unique<Solved>()),
      broken_(network.lattice.bond.size(), 0),
      threshold_(network.lattice.bond.size()) {
  solved_->u.resize(static_cast<std::size_t>(network.unknowns));
  state_.force.resize(network.lattice.bond.size());
  if (kind != ReferenceKind::refined) quad_ = std::make_unique<QuadSolver>(network);
  if (kind == ReferenceKind::automatic && quad_->factor.work() > kMostQuadWork) quad_.reset();
  if (quad_ == nullptr) refined_ = std::make_unique<RefinedSolver>(network);
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
  if (refined_) refined_->reset(broken_);
}

void Reference::remove(BondId bond) {
  broken_[bond] = 1;
  threshold_[bond] = std::numeric_limits<double>::infinity();
  if (refined_) refined_->remove(bond, broken_);
}

const ReferenceState& Reference::solve() {
  if (quad_) {
    quad_->solve(broken_, *solved_);
  } else {
    refined_->solve(broken_, *solved_);
  }
  state_.state = State::failed;
  const long double plate = solved_->u[network_.plate];
  const double stiffness = static_cast<double>(1 / plate);
  if (solved_->singular || !(plate > 0)) return state_;
  const double none = (quad_ ? kNoStiffnessQuad : kNoStiffness) * network_.plate_diagonal;
  if (intact_stiffness_ == 0 && stiffness > none) intact_stiffness_ = stiffness;
  if (!(stiffness > kFailedStiffness * intact_stiffness_) || intact_stiffness_ == 0) return state_;
  state_.error = solved_->error;
  state_.critical.stiffness = stiffness;
  find_critical();
  return state_;
}

void Reference::find_critical() {
  const std::span<const long double> u = solved_->u;
  std::vector<long double> ratio(threshold_.size(), 0.0L);
  long double largest = 0;
  state_.largest_force = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    const bool there = broken_[e] == 0 && network_.can_stretch(e);
    const long double length = there ? stretch(network_, e, u) : 0.0L;
    state_.force[e] = static_cast<double>(network_.stiffness[e] * length);
    state_.largest_force = std::max(state_.largest_force, std::abs(state_.force[e]));
    const long double size = break_on_ == BreakOn::magnitude ? std::abs(length) : length;
    if (!(size > kNoElongation * u[network_.plate])) continue;
    // as in double, what is beyond its range is infinite: those bonds tie
    ratio[e] = static_cast<double>(network_.stiffness[e] * size / threshold_[e]);
    largest = std::max(largest, ratio[e]);
  }
  if (!(largest > 0)) return;
  const auto tied = [limit = largest * (1 - static_cast<long double>(kTie))](long double r) {
    return r >= limit;
  };
  state_.critical.bond = static_cast<BondId>(std::ranges::find_if(ratio, tied) - ratio.begin());
  state_.critical.load = static_cast<double>(1 / largest);
  state_.state = State::carrying;
}

}  // namespace crackle
