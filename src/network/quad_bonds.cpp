#include "crackle/network/quad_bonds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace crackle {

namespace {

/// Directions that differ by less are the same, rounded at different places.
constexpr double kSameDirection = 1e-12;

using Axis = std::array<Quad, 2>;

/// Rows by ascending key of the unknowns, in their own order where keys are equal.
std::vector<int> rows_by(std::span<const double> key) {
  std::vector<int> unknown(key.size());
  std::iota(unknown.begin(), unknown.end(), 0);
  std::ranges::stable_sort(unknown, {}, [key](int i) { return key[i]; });
  std::vector<int> row(key.size());
  for (std::size_t i = 0; i < key.size(); ++i) row[unknown[i]] = static_cast<int>(i);
  return row;
}

QuadOrder order_by(const Network& network, std::span<const double> key) {
  QuadOrder order{rows_by(key), {}};
  order.first.resize(key.size());
  std::iota(order.first.begin(), order.first.end(), 0);
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (!network.can_stretch(e)) continue;
    const auto dofs = network.bond_dofs(e);
    const auto values = network.bond_values(e);
    int least = order.row[network.plate];
    for (std::size_t i = 0; i < dofs.size(); ++i) {
      if (values[i] != 0) least = std::min(least, order.row[dofs[i]]);
    }
    for (std::size_t i = 0; i < dofs.size(); ++i) {
      int& begin = order.first[order.row[dofs[i]]];
      if (values[i] != 0) begin = std::min(begin, least);
    }
  }
  return order;
}

/// Newton's steps from the double root: 16 digits, 32, all.
Quad root(Quad x) {
  Quad r = std::sqrt(static_cast<double>(x));
  for (int step = 0; step < 3; ++step) r = (r + x / r) / 2;
  return r;
}

/// From the first node to the second, over the image that has the network's direction.
Axis step_between(const Network& network, BondId e) {
  const auto [a, b] = network.lattice.bond[e];
  const Vector2 from = network.lattice.position[a];
  const Vector2 to = network.lattice.position[b];
  const Vector2 stated = network.lattice.direction[e];
  const double period = network.lattice.period_x;
  Axis step{Quad(to.x) - from.x, Quad(to.y) - from.y};
  if (period > 0 && stated.y != 0) {
    const double wanted = static_cast<double>(step[1]) * stated.x / stated.y;
    step[0] -= Quad(period) * std::round((static_cast<double>(step[0]) - wanted) / period);
  }
  return step;
}

Axis unit_axis(const Network& network, BondId e) {
  const Vector2 stated = network.lattice.direction[e];
  const Axis as_stated{stated.x, stated.y};
  if (stated.x == 0 || stated.y == 0) return as_stated;
  Axis step = step_between(network, e);
  const Quad size = std::max(magnitude(step[0]), magnitude(step[1]));
  if (!(size > 0)) return as_stated;
  for (Quad& s : step) s /= size;  // their squares stay within double's range
  const Quad length = root(step[0] * step[0] + step[1] * step[1]);
  for (Quad& s : step) s /= length;
  const Quad off = magnitude(step[0] - as_stated[0]) + magnitude(step[1] - as_stated[1]);
  return off < kSameDirection ? step : as_stated;
}

/// By how much a number may have been rounded, in units of epsilon: one of 24 bits isn't.
double rounded(double x) {
  int exponent = 0;
  const double digits = std::ldexp(std::frexp(x, &exponent), 24);
  return digits == std::trunc(digits) ? 0 : std::abs(x);
}

/// By what angle rounding of the nodes' coordinates may have turned a bond; equal ones are taken for exact.
double angle_turned(const Network& network, BondId e) {
  const auto [a, b] = network.lattice.bond[e];
  const Vector2 from = network.lattice.position[a];
  const Vector2 to = network.lattice.position[b];
  const Vector2 along = network.lattice.direction[e];
  const double dx = std::abs(to.x - from.x);
  const double dy = std::abs(to.y - from.y);
  const double period = network.lattice.period_x;
  const double x = dx == 0 ? 0 : rounded(from.x) + rounded(to.x) + (dx > period / 2 ? rounded(period) : 0);
  const double y = dy == 0 ? 0 : rounded(from.y) + rounded(to.y);
  const double length = dy > 0 ? dy / std::abs(along.y) : std::min(dx, std::abs(period - dx));
  const double across = std::abs(along.y) * x + std::abs(along.x) * y;
  return across == 0 ? 0 : std::numeric_limits<double>::epsilon() * across / length;
}

/// b_e as network.cpp fills it, entry by entry, from a direction in 113 bits.
void fill_bond(const Network& network, BondId e, std::span<Quad> value) {
  const Axis axis = unit_axis(network, e);
  const int components = network.components;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (network.bond_values(e)[i] == 0) continue;
    for (const int end : {0, 1}) {
      const NodeId node = network.lattice.bond[e][end];
      for (int c = 0; c < components; ++c) {
        const Dof dof = network.dof[static_cast<std::size_t>(node) * components + c];
        if (dof != network.bond_dofs(e)[i]) continue;
        value[i] += end == 0 ? -axis[c] : axis[c];
      }
    }
  }
}

}  // namespace

QuadOrder find_quad_order(const Network& network) {
  constexpr double kLast = std::numeric_limits<double>::infinity();
  std::vector<double> number(static_cast<std::size_t>(network.unknowns), kLast);
  std::vector<double> height = number;
  std::vector<double> along = number;
  for (std::size_t slot = 0; slot < network.dof.size(); ++slot) {
    const Dof dof = network.dof[slot];
    if (dof == Network::kFixed || dof == network.plate) continue;
    const Vector2 position = network.lattice.position[slot / network.components];
    number[dof] = static_cast<double>(dof);
    height[dof] = position.y;
    along[dof] = position.x;
  }
  QuadOrder best = order_by(network, number);
  for (const auto& key : {height, along}) {
    QuadOrder order = order_by(network, key);
    if (profile_work(order.first) < profile_work(best.first)) best = std::move(order);
  }
  return best;
}

QuadBonds make_quad_bonds(const Network& network, const QuadOrder& order) {
  QuadBonds bonds;
  bonds.width = network.width();
  bonds.row.resize(network.bond_dof.size());
  bonds.value.resize(network.bond_dof.size(), Quad(0));
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (!network.can_stretch(e)) continue;
    const std::size_t begin = static_cast<std::size_t>(e) * bonds.width;
    for (int i = 0; i < bonds.width; ++i) bonds.row[begin + i] = order.row[network.bond_dofs(e)[i]];
    const std::span value(bonds.value.data() + begin, static_cast<std::size_t>(bonds.width));
    if (network.components == 1) {
      std::ranges::copy(network.bond_values(e), value.begin());
    } else {
      fill_bond(network, e, value);
      bonds.turned = std::max(bonds.turned, angle_turned(network, e));
    }
  }
  return bonds;
}

}  // namespace crackle
