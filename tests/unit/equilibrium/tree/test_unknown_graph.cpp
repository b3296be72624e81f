#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "crackle/equilibrium/tree/unknown_graph.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

TEST(UnknownGraph, JoinsTheUnknownsThatShareABond) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    SCOPED_TRACE(named.name);
    const Network& network = named.network;
    const UnknownGraph graph = make_unknown_graph(network);
    std::vector<std::set<Dof>> expected(graph.unknowns());
    std::vector<std::uint8_t> on_plate(graph.unknowns(), 0);
    for (BondId e = 0; e < network.bonds(); ++e) {
      for (int i = 0; i < network.width(); ++i) {
        for (int j = 0; j < network.width(); ++j) {
          const Dof a = network.bond_dofs(e)[i];
          const Dof b = network.bond_dofs(e)[j];
          if (network.bond_values(e)[i] == 0 || network.bond_values(e)[j] == 0 || a == b ||
              a == network.plate)
            continue;
          if (b == network.plate) {
            on_plate[a] = 1;
          } else {
            expected[a].insert(b);
          }
        }
      }
    }
    EXPECT_EQ(graph.on_plate, on_plate);
    for (Dof i = 0; i < graph.unknowns(); ++i) {
      const auto row = graph.neighbours(i);
      EXPECT_TRUE(std::ranges::equal(row, expected[i])) << i;
    }
  }
}

TEST(UnknownGraph, CountsColumnsAndRowsOfLattices) {
  for (const LatticeKind& kind : lattice_kinds()) {
    for (const double spacing : {1.0, kLeastRowSpacing, 0.8660254, kLargestRowSpacing}) {
      SCOPED_TRACE(std::string(kind.name) + " " + std::to_string(spacing));
      const Network network = make_network(kind.make(12, spacing), Model::fuse, Grips::sliding, {});
      const UnknownGraph graph = make_unknown_graph(network);
      const bool shifted = std::string(kind.name) != "square";
      EXPECT_TRUE(graph.lattice);
      EXPECT_TRUE(graph.whole);
      EXPECT_EQ(graph.columns, shifted ? 26 : 13);
      for (NodeId node = 13; node < 12 * 13; ++node) {
        const Place place = graph.place[network.dof[node]];
        const NodeId row = node / 13;
        EXPECT_EQ(place.y, row);
        EXPECT_EQ(place.x, shifted ? 2 * (node % 13) + row % 2 : node % 13);
      }
    }
  }
}

TEST(UnknownGraph, KnowsALatticeWithGapsAndWhatIsNone) {
  const Lattice lattice = triangular_lattice(12, 1);
  std::vector<double> stiffness(lattice.bond.size(), 1.0);
  for (std::size_t e = 0; e < stiffness.size(); e += 10) stiffness[e] = 0;
  const UnknownGraph gapped =
      make_unknown_graph(make_network(lattice, Model::spring, Grips::sliding, stiffness));
  EXPECT_TRUE(gapped.lattice);
  EXPECT_FALSE(gapped.whole);

  Lattice moved = lattice;
  moved.position[40].x += 0.01;
  const UnknownGraph irregular = make_unknown_graph(make_network(
      make_lattice(13, moved.position, moved.grip, moved.bond), Model::fuse, Grips::sliding, {}));
  EXPECT_FALSE(irregular.lattice);
  EXPECT_FALSE(irregular.whole);

  test::Bonds bonds = lattice.bond;
  bonds.push_back({20, 120});
  const UnknownGraph far = make_unknown_graph(
      make_network(make_lattice(13, lattice.position, lattice.grip, bonds), Model::fuse, Grips::sliding, {}));
  EXPECT_FALSE(far.lattice);
}

}  // namespace
}  // namespace crackle
