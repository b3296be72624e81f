#include <gtest/gtest.h>

#include "crackle/factor/profile_factor.hpp"
#include "crackle/network/lattices.hpp"
#include "crackle/network/quad_bonds.hpp"
#include "support/dense_reference.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// K of a network without the broken bonds, factored; nothing is null.
ProfileFactor<Quad> factor_of(const Network& network, const QuadOrder& order,
                              std::span<const std::uint8_t> broken) {
  ProfileFactor<Quad> factor(order.first);
  const QuadBonds bonds = make_quad_bonds(network, order);
  factor.clear();
  for (const Dof slot : network.idle) factor.at(order.row[slot], order.row[slot]) = 1;
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (broken[e] != 0 || !network.can_stretch(e)) continue;
    for (int i = 0; i < bonds.width; ++i) {
      for (int j = 0; j < bonds.width; ++j) {
        const int row = bonds.rows(e)[i];
        const int column = bonds.rows(e)[j];
        if (row < column || bonds.values(e)[i] == 0 || bonds.values(e)[j] == 0) continue;
        factor.at(row, column) += network.stiffness[e] * bonds.values(e)[i] * bonds.values(e)[j];
      }
    }
  }
  EXPECT_TRUE(factor.factor([](int /*row*/, Quad pivot, Quad /*diagonal*/) { return pivot; }));
  return factor;
}

Quad downdate(ProfileFactor<Quad>& factor, const Network& network, const QuadOrder& order, BondId e) {
  const QuadBonds bonds = make_quad_bonds(network, order);
  std::vector<Quad> w(order.row.size(), Quad(0));
  int begin = factor.size();
  for (int i = 0; i < bonds.width; ++i) {
    if (bonds.values(e)[i] == 0) continue;
    w[bonds.rows(e)[i]] = bonds.values(e)[i];
    begin = std::min(begin, bonds.rows(e)[i]);
  }
  return factor.downdate(begin, w, network.stiffness[e]);
}

double largest_difference(std::span<const Quad> a, std::span<const Quad> b) {
  Quad difference = 0;
  Quad size = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference = std::max(difference, magnitude(a[i] - b[i]));
    size = std::max(size, magnitude(b[i]));
  }
  return static_cast<double>(difference / size);
}

TEST(ProfileFactor, DowndatedIsAFreshOneAndTellsTheSlack) {
  for (const test::NamedNetwork& named : test::triangular_networks(6)) {
    SCOPED_TRACE(named.name);
    const Network& network = named.network;
    const QuadOrder order = find_quad_order(network);
    std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
    ProfileFactor<Quad> factor = factor_of(network, order, broken);
    for (const BondId e : test::safe_removals(network, 12)) {
      const test::DenseFactor dense(test::dense_matrix(network, broken));
      const double slack = test::dense_slack(dense, network.unknowns, test::bond_change(network, e));
      EXPECT_NEAR(static_cast<double>(downdate(factor, network, order, e)), slack, 1e-14);
      broken[e] = 1;
      std::vector<Quad> found(order.row.size());
      std::vector<Quad> expected(order.row.size());
      factor.solve_last(found);
      factor_of(network, order, broken).solve_last(expected);
      EXPECT_LT(largest_difference(found, expected), 1e-29);
    }
  }
}

TEST(ProfileFactor, SolvesForAnyRightHandSide) {
  const Network network = test::triangular_networks(5)[3].network;
  const QuadOrder order = find_quad_order(network);
  const std::vector<std::uint8_t> whole(network.lattice.bond.size(), 0);
  const std::vector<double> load = test::mixed_values(order.row.size());
  std::vector<Quad> x(load.size());
  for (std::size_t i = 0; i < load.size(); ++i) x[order.row[i]] = load[i];
  factor_of(network, order, whole).solve(x);
  std::vector<double> found(load.size());
  for (std::size_t i = 0; i < load.size(); ++i) found[i] = static_cast<double>(x[order.row[i]]);
  EXPECT_LT(test::relative_difference(found, test::DenseFactor(test::dense_matrix(network)).solve(load)),
            1e-15);
}

/// The last bond of a chain takes all: the slack is 0, and there is no factor.
TEST(ProfileFactor, ASlackOfNothingIsTold) {
  const Network network = test::chain(3);
  const QuadOrder order = find_quad_order(network);
  ProfileFactor<Quad> factor = factor_of(network, order, std::vector<std::uint8_t>(3, 0));
  EXPECT_LT(static_cast<double>(downdate(factor, network, order, 1)), 1e-30);
}

/// A network whose nodes are numbered at random costs what it costs in order.
TEST(ProfileFactor, OrderFollowsTheNodesNotTheirNumbers) {
  const Lattice ordered = triangular_lattice(8, 1);
  Lattice shuffled = ordered;
  constexpr NodeId n = 81;
  ASSERT_EQ(ordered.nodes(), n);
  const auto place = [](NodeId i) { return static_cast<NodeId>((std::int64_t{i} * 37 + 5) % n); };
  for (NodeId i = 0; i < n; ++i) {
    shuffled.position[place(i)] = ordered.position[i];
    shuffled.grip[place(i)] = ordered.grip[i];
  }
  for (auto& bond : shuffled.bond) bond = {place(bond[0]), place(bond[1])};
  for (const Model model : {Model::spring, Model::fuse}) {
    const QuadOrder there = find_quad_order(make_network(ordered, model, Grips::clamped, {}));
    const QuadOrder here = find_quad_order(make_network(shuffled, model, Grips::clamped, {}));
    EXPECT_LT(profile_work(here.first), 1.5 * profile_work(there.first));
  }
}

/// Sums of squares of a direction are 1 to 113 bits, over every image.
TEST(QuadBonds, DirectionsAreUnitVectorsThatRoundToTheNetworks) {
  for (const double spacing : {1.0, 0.3, 1e5}) {
    const Network network = make_network(triangular_lattice(4, spacing), Model::spring, Grips::clamped, {});
    const QuadBonds bonds = make_quad_bonds(network, find_quad_order(network));
    for (BondId e = 0; e < network.bonds(); ++e) {
      if (!network.can_stretch(e)) continue;
      Quad squares = 0;
      int entries = 0;
      for (int i = 0; i < bonds.width; ++i) {
        EXPECT_NEAR(static_cast<double>(bonds.values(e)[i]), network.bond_values(e)[i], 1e-15);
        squares += bonds.values(e)[i] * bonds.values(e)[i];
        if (bonds.values(e)[i] != 0) ++entries;
      }
      if (entries < 4) continue;  // held at one end
      EXPECT_LT(static_cast<double>(magnitude(squares - 2)), 1e-32) << e;
    }
  }
}

/// What positions don't say, an explicit direction say, stays as it is.
TEST(QuadBonds, ADirectionOfItsOwnIsKept) {
  Lattice lattice = triangular_lattice(4, 1);
  lattice.direction[20] = {0.6, 0.8};
  const Network network = make_network(lattice, Model::spring, Grips::clamped, {});
  const QuadBonds bonds = make_quad_bonds(network, find_quad_order(network));
  for (int i = 0; i < bonds.width; ++i) EXPECT_EQ(bonds.values(20)[i], network.bond_values(20)[i]);
}

}  // namespace
}  // namespace crackle
