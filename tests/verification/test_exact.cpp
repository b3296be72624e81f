/// Answers known without a solver.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "crackle/factor/cholmod_factor.hpp"
#include "crackle/network/disorder.hpp"
#include "crackle/network/lattices.hpp"
#include "verification.hpp"

namespace crackle::verification {

namespace {

/// L x L square fuse network between bus bars, periodic in x; bond 2 i is the vertical one above node i.
Network square_fuse(int size) {
  const NodeId width = size;
  std::vector<Vector2> position;
  std::vector<Grip> grip;
  std::vector<std::array<NodeId, 2>> bond;
  for (NodeId row = 0; row <= size; ++row) {
    for (NodeId column = 0; column < width; ++column) {
      position.push_back({static_cast<double>(column), static_cast<double>(row)});
      grip.push_back(row == 0 ? Grip::bottom : row == size ? Grip::top : Grip::free);
      const NodeId node = row * width + column;
      if (row < size) bond.push_back({node, node + width});
      if (row < size) bond.push_back({node, row * width + (column + 1) % width});
    }
  }
  return make_network(make_lattice(width, position, grip, bond), Model::fuse, Grips::sliding, {});
}

struct LoneBreak {
  double slack = 0;      ///< 1 - b^T K^-1 b of a bond amid the network
  double neighbour = 0;  ///< current beside the broken bond over the mean current
};

/// u after the break gives both: 1/F' = 1/F + f^2 / slack, and the current in the next bond.
LoneBreak break_one(int size) {
  const Network network = square_fuse(size);
  const BondId middle = 2 * (size / 2 * size + size / 2);
  std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
  const std::vector<double> intact = solve_afresh(network, broken);
  broken[middle] = 1;
  const std::vector<double> damaged = solve_afresh(network, broken);
  const double force = elongation(network, middle, intact);
  LoneBreak result;
  result.slack = force * force / (damaged.back() - intact.back());
  // at unit voltage the far current is that of the intact network: 1 over the height
  result.neighbour = elongation(network, middle + 2, damaged) / damaged.back() * size;
  return result;
}

TEST(Exact, LoneBrokenFuse) {
  const double neighbour = 4 / std::numbers::pi;
  LoneBreak last;
  for (const int size : {32, 64, 128}) {
    const LoneBreak now = break_one(size);
    std::printf("L = %d: slack - 1/2 = %.3g, neighbour's current - 4/pi = %.3g\n", size, now.slack - 0.5,
                now.neighbour - neighbour);
    if (size > 32) {
      EXPECT_NEAR((last.slack - 0.5) / (now.slack - 0.5), 4, 0.1);
      EXPECT_NEAR((last.neighbour - neighbour) / (now.neighbour - neighbour), 4, 0.1);
    }
    last = now;
  }
  EXPECT_NEAR(last.slack, 0.5, 1e-3);
  EXPECT_NEAR(last.neighbour, neighbour, 1e-3);
}

/// The intact triangular lattice under its plate: rows move by equal steps, inclined bonds carry all.
TEST(Exact, PatchOfTheIntactLattice) {
  for (const int size : {2, 7, 16}) {
    for (const double spacing : {0.5, 1.0, 3.0}) {
      const Network network =
          make_network(triangular_lattice(size, spacing), Model::spring, Grips::clamped, {});
      const std::vector<std::uint8_t> none(network.lattice.bond.size(), 0);
      const std::vector<double> u = solve_afresh(network, none);
      const double sine = spacing / std::hypot(0.5, spacing);
      const double per_bond = 1 / (2 * (size + 1) * sine);  // two bonds a node share the unit load
      for (BondId e = 0; e < network.bonds(); ++e) {
        const double expected = network.lattice.direction[e].y == 0 ? 0 : per_bond;
        EXPECT_NEAR(elongation(network, e, u), expected, 1e-13 * size);
      }
      EXPECT_NEAR(1 / u.back(), 2 * (size + 1) * sine * sine / size, 1e-11);
    }
  }
}

/// Moving everything, plate and all, stretches no bond that no grip holds.
TEST(Exact, RigidMotionCostsNothing) {
  const Network network = triangular({Model::spring, Grips::sliding, BreakOn::magnitude, 9});
  const Lattice& lattice = network.lattice;
  std::vector<double> u(static_cast<std::size_t>(network.unknowns), 0.0);
  for (NodeId node = 0; node < lattice.nodes(); ++node) {
    const Vector2 motion{0.3, -0.7};
    for (const int c : {0, 1}) {
      const Dof dof = network.dof[2 * node + c];
      if (dof != Network::kFixed) u[dof] = c == 0 ? motion.x : motion.y;
    }
  }
  int checked = 0;
  for (BondId e = 0; e < network.bonds(); ++e) {
    const auto [a, b] = lattice.bond[e];
    if (lattice.grip[a] == Grip::bottom || lattice.grip[b] == Grip::bottom) continue;
    EXPECT_NEAR(elongation(network, e, u), 0, 1e-15);
    ++checked;
  }
  EXPECT_EQ(checked, network.bonds() - 30);
}

/// Load through the cut above `row`: forces times their vertical direction (a fuse: currents upwards).
double through_cut(const Network& network, std::span<const double> u, const std::vector<std::uint8_t>& broken,
                   double height) {
  double sum = 0;
  for (BondId e = 0; e < network.bonds(); ++e) {
    const auto [a, b] = network.lattice.bond[e];
    const double low = network.lattice.position[a].y;
    const double high = network.lattice.position[b].y;
    if (broken[e] != 0 || low == high) continue;
    if (std::min(low, high) > height || std::max(low, high) < height) continue;
    const double along =
        network.model == Model::fuse ? (high > low ? 1 : -1) : network.lattice.direction[e].y;
    sum += network.stiffness[e] * elongation(network, e, u) * along;
  }
  return sum;
}

TEST(Exact, EveryCutCarriesThePlateForce) {
  for (const Model model : {Model::spring, Model::fuse}) {
    const Setting setting{model, Grips::sliding, BreakOn::magnitude, 12};
    const Network network = triangular(setting);
    PhaseTimes times;
    const auto equilibrium = start(kUpdown, network, setting.break_on, times);
    std::vector<double> threshold(network.lattice.bond.size());
    draw_uniform_thresholds(3, 0, threshold);
    equilibrium->reset(threshold);
    Critical next;
    int breaks = 0;
    // past F = 1e-3 a unit load means displacements of 1e3, and so much more rounding
    while (equilibrium->find_critical(next) == State::carrying && next.stiffness > 1e-3) {
      for (int row = 0; row < setting.size; ++row) {
        const double load =
            through_cut(network, equilibrium->displacements(), equilibrium->broken(), row + 0.5);
        ASSERT_NEAR(load, 1, 1e-11) << "row " << row << " after break " << breaks;
      }
      equilibrium->remove(next.bond);
      ++breaks;
    }
    EXPECT_GT(breaks, 40);
  }
}

}  // namespace

}  // namespace crackle::verification
