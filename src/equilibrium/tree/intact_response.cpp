#include "crackle/equilibrium/tree/intact_response.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace crackle {

namespace {

/// The making of it. Panels hold kLanes columns of G0 side by side: [panels][stretchable][kLanes], 0 fills up.
class IntactSolver {
 public:
  IntactSolver(const Network& network, const SeparatorTree& tree, const TreeBonds& bonds,
               const TreeFactor& factor, const TreeKernels& kernels, IntactResponse& made)
      : network_(network), tree_(tree), bonds_(bonds), factor_(factor), kernels_(kernels), made_(made) {
    for (BondId e = 0; e < network.bonds(); ++e) {
      if (!network.can_stretch(e)) continue;
      made.bond.push_back(e);
      made.root.push_back(std::sqrt(network.stiffness[e]));
    }
    count_ = made.bond.size();
    made.size = whole_blocks(static_cast<int>(count_));
    made.unknowns = whole_blocks(network.unknowns);
    made.gram.resize(count_ * made.size);
    made.displacement.resize(count_ * made.unknowns);
    made.stretch.resize(made.size);
    made.at_rest.resize(made.unknowns);
    panels_ = (count_ + kLanes - 1) / kLanes;
    panel_.resize(panels_ * count_ * kLanes);
    x_.resize(static_cast<std::size_t>(tree.positions()) * kLanes);
  }

  /// Refined once: what is left of the load is the bonds' own.
  void solve_at_rest() {
    const auto n = static_cast<std::size_t>(network_.unknowns);
    const std::span<double> u(made_.at_rest.data(), n);
    std::vector<double> left(n);
    factor_.solve_plate(u);
    residual(network_, std::vector<std::uint8_t>(network_.bonds(), 0), u, left);
    std::ranges::fill(x_, 0.0);
    for (Position at = 0; at < tree_.positions(); ++at) x_[at * kLanes] = left[tree_.dof[at]];
    solve();
    for (Position at = 0; at < tree_.positions(); ++at) u[tree_.dof[at]] += x_[at * kLanes];
    made_.bent = u[network_.plate];
    for (std::size_t e = 0; e < count_; ++e)
      made_.stretch[e] = made_.root[e] * elongation(network_, made_.bond[e], u);
  }

  void solve_bonds() {
    for (std::size_t p = 0; p < panels_; ++p) {
      std::ranges::fill(x_, 0.0);
      const std::size_t lanes = std::min<std::size_t>(kLanes, count_ - p * kLanes);
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        const BondId e = made_.bond[p * kLanes + lane];
        for (int i = 0; i < bonds_.width; ++i) x_[bonds_.rows(e)[i] * kLanes + lane] += bonds_.values(e)[i];
      }
      solve();
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        double* u = made_.displacement.data() + (p * kLanes + lane) * made_.unknowns;
        for (Position at = 0; at < tree_.positions(); ++at) u[tree_.dof[at]] = x_[at * kLanes + lane];
      }
      for (std::size_t e = 0; e < count_; ++e) stretch(made_.bond[e], panel(p) + e * kLanes);
    }
  }

  /// The columns of G = G0 + E, stretches of some displacements, are where G0 projects to: G0 E = E. So
  /// G + G^T - G^T G = G0 - E^T E, right to rounding.
  void square_error() {
    const std::vector<double> minus(count_, -1.0);
    std::array<double, static_cast<std::size_t>(kLanes) * kLanes> tile{};
    for (std::size_t p = 0; p < panels_; ++p) {
      for (std::size_t q = 0; q <= p; ++q) {
        tile.fill(0);
        kernels_.gram(panel(p), kLanes, panel(q), minus.data(), static_cast<int>(count_), tile.data(),
                      kLanes);
        const std::size_t rows = std::min<std::size_t>(kLanes, count_ - p * kLanes);
        for (std::size_t a = 0; a < rows; ++a) {
          for (std::size_t b = 0; b < kLanes && q * kLanes + b <= p * kLanes + a; ++b) {
            const std::size_t i = p * kLanes + a;
            const std::size_t j = q * kLanes + b;
            const double value = tile[a * kLanes + b] + panel(p)[j * kLanes + a] + panel(q)[i * kLanes + b];
            made_.gram[i * made_.size + j] = value;
            made_.gram[j * made_.size + i] = value;
          }
        }
      }
    }
  }

  void measure_defect() {
    std::vector<double> diagonal(network_.unknowns);
    for (std::size_t e = 0; e < count_; ++e) {
      const auto dofs = network_.bond_dofs(made_.bond[e]);
      for (std::size_t i = 0; i < dofs.size(); ++i)
        diagonal[dofs[i]] += std::pow(made_.root[e] * network_.bond_values(made_.bond[e])[i], 2);
    }
    std::vector<double> left(network_.unknowns);
    left[network_.plate] = 1;
    for (std::size_t e = 0; e < count_; ++e) add_load(e, -made_.stretch[e], left);
    note(norm_of(left, diagonal));
    for (std::size_t j = 0; j < count_; ++j) {
      const double* own = made_.column(static_cast<int>(j));
      std::ranges::fill(left, 0.0);
      for (std::size_t e = 0; e < count_; ++e) add_load(e, (e == j ? 1 : 0) - own[e], left);
      note(norm_of(left, diagonal));
      note(std::abs(std::inner_product(own, own + count_, own, -own[j])));
    }
  }

 private:
  [[nodiscard]] double* panel(std::size_t p) { return panel_.data() + p * count_ * kLanes; }

  /// x_ becomes K0^-1 x_, in all lanes.
  void solve() {
    for (FrontId f = 0; f < tree_.fronts(); ++f) {
      const Front& front = tree_.front[f];
      double* pivots = x_.data() + static_cast<std::size_t>(front.first) * kLanes;
      kernels_.forward(factor_.block(f), pivots, x_.data(), 0, kLanes);
      for (int i = 0; i < front.pivots * kLanes; ++i) pivots[i] *= factor_.inverse_pivots(f)[i / kLanes];
    }
    for (FrontId f = tree_.fronts() - 1; f >= 0; --f) {
      double* pivots = x_.data() + static_cast<std::size_t>(tree_.front[f].first) * kLanes;
      kernels_.backward(factor_.block(f), pivots, x_.data());
    }
  }

  /// g_e . x_ in all lanes.
  void stretch(BondId e, double* sum) const {
    std::fill_n(sum, kLanes, 0.0);
    for (int i = 0; i < bonds_.width; ++i) {
      const double value = bonds_.values(e)[i];
      const double* x = x_.data() + static_cast<std::size_t>(bonds_.rows(e)[i]) * kLanes;
      for (int lane = 0; lane < kLanes; ++lane) sum[lane] += value * x[lane];
    }
  }

  void add_load(std::size_t e, double times, std::vector<double>& load) const {
    const double force = times * made_.root[e];
    const auto dofs = network_.bond_dofs(made_.bond[e]);
    const auto values = network_.bond_values(made_.bond[e]);
    for (std::size_t i = 0; i < dofs.size(); ++i) load[dofs[i]] += force * values[i];
  }

  [[nodiscard]] static double norm_of(const std::vector<double>& load, const std::vector<double>& diagonal) {
    double square = 0;
    for (std::size_t i = 0; i < load.size(); ++i)
      square += diagonal[i] > 0 ? load[i] * load[i] / diagonal[i] : 0;
    return std::sqrt(square);
  }

  void note(double defect) {
    made_.defect =
        std::isnan(defect) ? std::numeric_limits<double>::infinity() : std::max(made_.defect, defect);
  }

  const Network& network_;
  const SeparatorTree& tree_;
  const TreeBonds& bonds_;
  const TreeFactor& factor_;
  const TreeKernels& kernels_;
  IntactResponse& made_;
  std::size_t count_ = 0;  // stretchable
  std::size_t panels_ = 0;
  AlignedVector panel_;
  AlignedVector x_;  // [positions][kLanes]
};

}  // namespace

IntactResponse make_intact_response(const Network& network, const SeparatorTree& tree, const TreeBonds& bonds,
                                    const TreeFactor& factor, const TreeKernels& kernels) {
  IntactResponse made;
  IntactSolver solver(network, tree, bonds, factor, kernels, made);
  solver.solve_at_rest();
  solver.solve_bonds();
  solver.square_error();
  solver.measure_defect();
  return made;
}

}  // namespace crackle
