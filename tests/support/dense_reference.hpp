/// The stiffness matrix in full and in long double, from the geometry alone: what sparse ones are held to.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "crackle/factor/cholmod_factor.hpp"
#include "crackle/network/network.hpp"

namespace crackle::test {

using Real = long double;

/// A square matrix, by rows.
struct DenseMatrix {
  std::size_t n = 0;
  std::vector<Real> value{};

  explicit DenseMatrix(std::size_t size) : n(size), value(size * size, 0) {}
  [[nodiscard]] Real& operator()(std::size_t row, std::size_t column) { return value[row * n + column]; }
  [[nodiscard]] Real operator()(std::size_t row, std::size_t column) const { return value[row * n + column]; }
};

/// The unit vector along bond e from the nodes' positions; (1) for a fuse.
inline std::array<Real, 2> bond_axis(const Network& network, BondId e) {
  if (network.components == 1) return {1, 0};
  const auto [a, b] = network.lattice.bond[e];
  const Vector2 from = network.lattice.position[a];
  const Vector2 to = network.lattice.position[b];
  const Real period = network.lattice.period_x;
  Real dx = Real{to.x} - from.x;
  const Real dy = Real{to.y} - from.y;
  while (period > 0 && dx > period / 2) dx -= period;
  while (period > 0 && dx <= -period / 2) dx += period;
  const Real length = std::sqrt(dx * dx + dy * dy);
  return {dx / length, dy / length};
}

/// K: k d d^T between the two ends of every bond that isn't broken, 1 on the diagonal of an idle slot. Of
/// the network it takes lattice, stiffness and the numbers of the unknowns, not its b_e.
inline DenseMatrix dense_matrix(const Network& network, std::span<const std::uint8_t> broken) {
  DenseMatrix K(static_cast<std::size_t>(network.unknowns));
  const int c = network.components;
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (broken[e] != 0) continue;
    const auto axis = bond_axis(network, e);
    for (int i = 0; i < 2 * c; ++i) {
      for (int j = 0; j < 2 * c; ++j) {
        const Dof row = network.dof[network.lattice.bond[e][i / c] * c + i % c];
        const Dof column = network.dof[network.lattice.bond[e][j / c] * c + j % c];
        if (row == Network::kFixed || column == Network::kFixed) continue;
        const Real sign = i / c == j / c ? 1 : -1;
        K(row, column) += sign * network.stiffness[e] * axis[i % c] * axis[j % c];
      }
    }
  }
  for (const Dof slot : network.idle) K(slot, slot) = 1;
  return K;
}

inline DenseMatrix dense_matrix(const Network& network) {
  return dense_matrix(network, std::vector<std::uint8_t>(network.lattice.bond.size(), 0));
}

inline std::vector<Real> multiply(const DenseMatrix& K, std::span<const double> u) {
  std::vector<Real> product(K.n, 0);
  for (std::size_t row = 0; row < K.n; ++row) {
    for (std::size_t column = 0; column < K.n; ++column) product[row] += K(row, column) * u[column];
  }
  return product;
}

/// K = L D L^T: D on the diagonal, L below it.
class DenseFactor {
 public:
  explicit DenseFactor(DenseMatrix K) : factor_(std::move(K)) {
    const std::size_t n = factor_.n;
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t i = j + 1; i < n; ++i) {
        const Real ratio = factor_(i, j) / factor_(j, j);
        for (std::size_t k = i; k < n; ++k) factor_(k, i) -= ratio * factor_(k, j);
      }
      for (std::size_t i = j + 1; i < n; ++i) factor_(i, j) /= factor_(j, j);
    }
  }

  [[nodiscard]] std::vector<double> solve(std::span<const double> b) const {
    const std::size_t n = factor_.n;
    std::vector<Real> x(b.begin(), b.end());
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t i = j + 1; i < n; ++i) x[i] -= factor_(i, j) * x[j];
    }
    for (std::size_t j = n; j-- > 0;) {
      x[j] /= factor_(j, j);
      for (std::size_t i = j + 1; i < n; ++i) x[j] -= factor_(i, j) * x[i];
    }
    return {x.begin(), x.end()};
  }

  [[nodiscard]] Real determinant() const {
    Real product = 1;
    for (std::size_t j = 0; j < factor_.n; ++j) product *= factor_(j, j);
    return product;
  }

 private:
  DenseMatrix factor_;
};

/// Displacements at unit plate load.
inline std::vector<double> dense_displacements(const Network& network, std::span<const std::uint8_t> broken) {
  std::vector<double> load(static_cast<std::size_t>(network.unknowns), 0.0);
  load.back() = 1;
  return DenseFactor(dense_matrix(network, broken)).solve(load);
}

/// w of the change K - w w^T when bond e loses the fraction `share` of its stiffness.
inline RankOne bond_change(const Network& network, BondId e, double share = 1) {
  RankOne w;
  for (std::size_t i = 0; i < network.bond_dofs(e).size(); ++i) {
    if (network.bond_values(e)[i] == 0) continue;
    w.row[w.size] = network.bond_dofs(e)[i];
    w.value[w.size++] = std::sqrt(share * network.stiffness[e]) * network.bond_values(e)[i];
  }
  return w;
}

/// 1 - w^T K^-1 w.
inline double dense_slack(const DenseFactor& factor, std::size_t n, const RankOne& w) {
  std::vector<double> full(n, 0.0);
  for (int i = 0; i < w.size; ++i) full[w.row[i]] = w.value[i];
  const std::vector<double> x = factor.solve(full);
  Real slack = 1;
  for (int i = 0; i < w.size; ++i) slack -= Real{w.value[i]} * x[w.row[i]];
  return static_cast<double>(slack);
}

/// Bonds that can go one after the other, each with a slack of 0.05 or more when its turn comes.
inline std::vector<BondId> safe_removals(const Network& network, std::size_t count) {
  std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
  std::vector<BondId> bonds;
  for (BondId i = 0; i < network.bonds() && bonds.size() < count; ++i) {
    const BondId e = static_cast<BondId>((std::int64_t{i} * 7919 + 5) % network.bonds());
    if (!network.can_stretch(e) || broken[e] != 0) continue;
    const DenseFactor factor(dense_matrix(network, broken));
    const auto n = static_cast<std::size_t>(network.unknowns);
    if (dense_slack(factor, n, bond_change(network, e)) < 0.05) continue;
    broken[e] = 1;
    bonds.push_back(e);
  }
  return bonds;
}

/// max|a - b| / max|b|.
inline double relative_difference(std::span<const double> a, std::span<const double> b) {
  double difference = 0;
  double size = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference = std::max(difference, std::abs(a[i] - b[i]));
    size = std::max(size, std::abs(b[i]));
  }
  return difference / size;
}

}  // namespace crackle::test
