#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "crackle/network/lattices.hpp"
#include "crackle/network/network.hpp"
#include "support/dense_reference.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

std::vector<std::uint8_t> none_broken(const Network& network) {
  return std::vector<std::uint8_t>(network.lattice.bond.size(), 0);
}

TEST(Network, FusesHaveOneUnknownANodeAndThePlate) {
  for (const int size : {1, 2, 3, 8}) {
    SCOPED_TRACE(size);
    const Network network = make_network(triangular_lattice(size, 1), Model::fuse, Grips::sliding, {});
    EXPECT_EQ(network.components, 1);
    EXPECT_EQ(network.unknowns, (size - 1) * (size + 1) + 1);
    EXPECT_EQ(network.plate, network.unknowns - 1);
    EXPECT_TRUE(network.idle.empty());
    EXPECT_EQ(network.stretchable, network.bonds() - 2 * (size + 1)) << "all but the bus bars";
  }
}

TEST(Network, ANodeIsNamedWithItsBonds) {
  const Network network = make_network(triangular_lattice(4, 1), Model::spring, Grips::sliding, {});
  const auto name = [&network](NodeId node) { return name_node(node, bonds_at(network, node)); };
  EXPECT_EQ(name(21), "node 21 (bonds 46, 50, 60, 61)") << "of the top row";
  EXPECT_EQ(name(6), "node 6 (bonds 4, 8, 15, 18, 19, 20)") << "six are named in full";
  Lattice star =
      make_lattice(0, {{0, 0}, {0, 1}, {0, 2}, {1, 1}}, {Grip::bottom, Grip::free, Grip::top, Grip::free},
                   {{0, 1}, {1, 2}, {0, 1}, {1, 2}, {0, 1}, {1, 2}, {1, 0}, {0, 2}});
  const Network many = make_network(star, Model::fuse, Grips::sliding, {1, 1, 0, 1, 1, 1, 1, 1});
  EXPECT_EQ(name_node(1, bonds_at(many, 1)), "node 1 (bonds 0, 1, 3, 4, 5, 6)")
      << "not those of no stiffness";
  const Network more = make_network(std::move(star), Model::fuse, Grips::sliding, {});
  EXPECT_EQ(name_node(1, bonds_at(more, 1)), "node 1 (bonds 0, 1, 2, 3, 4, 5, ...)");
  EXPECT_EQ(name_node(3, bonds_at(more, 3)), "node 3");
}

TEST(Network, SlidingSpringsHoldAllButTheSidewaysMotionOfTheGrips) {
  for (const int size : {1, 2, 3, 8}) {
    SCOPED_TRACE(size);
    const Network network = make_network(triangular_lattice(size, 1), Model::spring, Grips::sliding, {});
    const auto idle = static_cast<Dof>(network.idle.size());
    EXPECT_EQ(network.unknowns - idle, 2 * (size - 1) * (size + 1) + (2 * size + 1) + 1);
    EXPECT_EQ(network.unknowns % 2, 0);
    EXPECT_EQ(network.stretchable, network.bonds());
    EXPECT_EQ(network.dof[0], Network::kFixed) << "x of the first bottom node is pinned";
    for (NodeId node = 0; node < network.lattice.nodes(); ++node) {
      const Grip grip = network.lattice.grip[node];
      if (node > 0) {
        EXPECT_NE(network.dof[2 * node], Network::kFixed) << node;
      }
      if (grip == Grip::bottom) {
        EXPECT_EQ(network.dof[2 * node + 1], Network::kFixed);
      }
      if (grip == Grip::top) {
        EXPECT_EQ(network.dof[2 * node + 1], network.plate);
      }
    }
  }
}

TEST(Network, ClampedSpringsLeaveOnlyThePlateOfTheGrips) {
  for (const int size : {1, 2, 3, 8}) {
    SCOPED_TRACE(size);
    const Network network = make_network(triangular_lattice(size, 1), Model::spring, Grips::clamped, {});
    EXPECT_EQ(network.unknowns - static_cast<Dof>(network.idle.size()), 2 * (size - 1) * (size + 1) + 1);
    EXPECT_EQ(network.stretchable, network.bonds() - 2 * (size + 1)) << "bonds in the grips can't stretch";
    for (BondId e = 0; e < network.bonds(); ++e) {
      const auto [a, b] = network.lattice.bond[e];
      const bool in_grip =
          network.lattice.grip[a] != Grip::free && network.lattice.grip[a] == network.lattice.grip[b];
      EXPECT_EQ(network.can_stretch(e), !in_grip) << e;
    }
  }
}

/// A translation along one axis, plate included, stretches no bond but those at what holds still.
TEST(Network, ATranslationCostsNothing) {
  for (const test::NamedNetwork& named : test::triangular_networks(4)) {
    SCOPED_TRACE(named.name);
    const Network& network = named.network;
    for (int along = 0; along < network.components; ++along) {
      std::vector<double> u(static_cast<std::size_t>(network.unknowns), 0.0);
      for (std::size_t slot = 0; slot < network.dof.size(); ++slot) {
        const bool moves = static_cast<int>(slot) % network.components == along;
        if (moves && network.dof[slot] != Network::kFixed) u[network.dof[slot]] = 0.3;
      }
      int free_bonds = 0;
      for (BondId e = 0; e < network.bonds(); ++e) {
        const auto held = [&](NodeId node) {
          return network.dof[node * network.components + along] == Network::kFixed;
        };
        if (held(network.lattice.bond[e][0]) || held(network.lattice.bond[e][1])) continue;
        EXPECT_EQ(elongation(network, e, u), 0) << "bond " << e;
        ++free_bonds;
      }
      EXPECT_GT(free_bonds, network.bonds() / 2);
    }
  }
}

/// Even rows against odd ones: u_y = y stretches every inclined bond alike, which every node balances.
TEST(Network, UniformStretchIsTheIntactEquilibrium) {
  for (const int size : {1, 2, 5}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      if (named.name == "uneven springs") continue;
      SCOPED_TRACE(named.name + " " + std::to_string(size));
      const Network& network = named.network;
      const double stiffness = test::intact_stiffness(size, network.model);
      std::vector<double> u(static_cast<std::size_t>(network.unknowns), 0.0);
      for (NodeId node = 0; node < network.lattice.nodes(); ++node) {
        const Dof dof = network.dof[(node + 1) * network.components - 1];
        if (dof != Network::kFixed) u[dof] = network.lattice.position[node].y / (size * stiffness);
      }
      std::vector<double> r(u.size());
      residual(network, none_broken(network), u, r);
      for (const double force : r) EXPECT_NEAR(force, 0, 1e-15);
      EXPECT_LT(backward_error(network, none_broken(network), u, r), 1e-16);
    }
  }
}

/// The triangular lattice without the bonds around its edge: a strain along x is possible.
Network open_network(int size) {
  const Lattice periodic = triangular_lattice(size, 1);
  std::vector<std::array<NodeId, 2>> bonds;
  for (BondId e = 0; e < periodic.bonds(); ++e) {
    const auto [a, b] = periodic.bond[e];
    if (std::abs(periodic.position[a].x - periodic.position[b].x) <= 1) bonds.push_back(periodic.bond[e]);
  }
  return make_network(make_lattice(0, periodic.position, periodic.grip, bonds), Model::spring, Grips::sliding,
                      {});
}

TEST(Network, UniformStrainLeavesInteriorNodesForceFree) {
  const int size = 6;
  const Network network = open_network(size);
  std::vector<double> u(static_cast<std::size_t>(network.unknowns), 0.0);
  std::vector<int> coordination(network.lattice.position.size(), 0);
  for (const auto& [a, b] : network.lattice.bond) ++coordination[a], ++coordination[b];
  for (NodeId node = 0; node < network.lattice.nodes(); ++node) {
    const auto [x, y] = network.lattice.position[node];
    const Dof dof_x = network.dof[2 * node];
    const Dof dof_y = network.dof[2 * node + 1];
    if (dof_x != Network::kFixed) u[dof_x] = 0.7 * x - 0.4 * y;
    if (dof_y != Network::kFixed) u[dof_y] = 0.3 * y;
  }
  std::vector<double> r(u.size());
  residual(network, none_broken(network), u, r);
  int interior = 0;
  for (NodeId node = 0; node < network.lattice.nodes(); ++node) {
    if (coordination[node] != 6) continue;
    ++interior;
    EXPECT_NEAR(r[network.dof[2 * node]], 0, 1e-14) << "node " << node;
    EXPECT_NEAR(r[network.dof[2 * node + 1]], 0, 1e-14) << "node " << node;
  }
  EXPECT_EQ(interior, (size - 1) * (size - 1));
  EXPECT_GT(std::abs(*std::ranges::max_element(r)), 0.1) << "the grips do feel it";
}

TEST(Network, ResidualIsTheDenseProduct) {
  for (const int size : {1, 2, 4}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      SCOPED_TRACE(named.name + " " + std::to_string(size));
      const Network& network = named.network;
      std::vector<std::uint8_t> broken = none_broken(network);
      for (BondId e = 0; e < network.bonds(); e += 5) broken[e] = 1;
      const std::vector<double> u = test::mixed_values(static_cast<std::size_t>(network.unknowns));
      const std::vector<long double> product = test::multiply(test::dense_matrix(network, broken), u);
      std::vector<double> r(u.size(), -1);
      residual(network, broken, u, r);
      for (Dof dof = 0; dof < network.unknowns; ++dof) {
        const double load = dof == network.plate ? 1 : 0;
        EXPECT_NEAR(r[dof], static_cast<double>(load - product[dof]), 1e-14) << dof;
      }
    }
  }
}

TEST(Network, BoundsNormAndBackwardError) {
  for (const test::NamedNetwork& named : test::triangular_networks(3)) {
    SCOPED_TRACE(named.name);
    const test::DenseMatrix K = test::dense_matrix(named.network);
    EXPECT_NEAR(named.network.plate_diagonal, static_cast<double>(K(K.n - 1, K.n - 1)), 1e-14);
    for (std::size_t row = 0; row < K.n; ++row) {
      long double sum = 0;
      for (std::size_t column = 0; column < K.n; ++column) sum += std::abs(K(row, column));
      EXPECT_LE(sum, named.network.norm);
    }
  }
  const Network network = test::bundle(3);
  const std::vector<double> u{0.0};
  std::vector<double> r(1);
  EXPECT_EQ(backward_error(network, none_broken(network), u, r), 1);
}

TEST(Network, HasOneEntryForABondBetweenTheGripsAndNoneWithoutStiffness) {
  {
    const Lattice lattice =
        make_lattice(0, {{0, 0}, {0, 1}, {0, 2}, {1, 1}}, {Grip::bottom, Grip::free, Grip::top, Grip::free},
                     {{0, 1}, {1, 2}, {1, 3}});
    const Network network = make_network(lattice, Model::fuse, Grips::sliding, {1, 1, 0});
    EXPECT_EQ(network.stretchable, 2);
    EXPECT_FALSE(network.can_stretch(2));
    EXPECT_EQ(network.idle, std::vector<Dof>{network.dof[3]});
  }
  // A bond from grip to grip acts on the plate alone; the drop counts from its second node to its first.
  {
    const Network network = test::fuses_between(2, {{0, 1}, {1, 0}});
    ASSERT_EQ(network.unknowns, 1);
    const std::vector<double> u{0.5};
    EXPECT_EQ(elongation(network, 0, u), 0.5);
    EXPECT_EQ(elongation(network, 1, u), -0.5);
  }
}

TEST(Network, RefusesStiffnessesAndGripsThatNothingJoins) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double k : {nan, -1.0, infinity}) {
    test::expect_refused([&] { (void)test::bundle(3, {1, k, 1}); }, {"stiffness of bond 1"});
  }
  test::expect_refused([] { (void)test::bundle(3, {1, 1}); }, {"number of stiffnesses", "2", "3 bonds"});
  const std::vector<std::string> message{"network", "path", "grips"};
  test::expect_refused([] { (void)test::fuses_between(3, {{0, 1}}); }, message);
  test::expect_refused([] { (void)test::fuses_between(3, {{0, 1}, {1, 2}}, {1, 0}); }, message);
  test::expect_refused([] { (void)test::fuses_between(3, {}); }, message);
}

}  // namespace
}  // namespace crackle
