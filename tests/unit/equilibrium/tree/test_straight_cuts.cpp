#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "crackle/equilibrium/tree/cut_patterns.hpp"
#include "crackle/equilibrium/tree/straight_cuts.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

constexpr int kLeaf = 4;

Network fuses(const LatticeKind& kind, int size) {
  return make_network(kind.make(size, 1), Model::fuse, Grips::sliding, {});
}

/// With every twentieth bond missing.
Network diluted(int size) {
  const Lattice lattice = triangular_lattice(size, 1);
  std::vector<double> stiffness(lattice.bond.size(), 1.0);
  for (std::size_t e = 0; e < stiffness.size(); e += 20) stiffness[e] = 0;
  return make_network(lattice, Model::spring, Grips::sliding, stiffness);
}

std::vector<Network> networks() {
  std::vector<Network> all;
  for (const int size : {5, 6, 11}) {
    for (test::NamedNetwork& named : test::triangular_networks(size)) all.push_back(std::move(named.network));
    for (const LatticeKind& kind : lattice_kinds()) all.push_back(fuses(kind, size));
  }
  all.push_back(diluted(12));
  return all;
}

/// Cuts the region and its parts down to a few unknowns; check(region, sides) after each.
template <class Check>
void cut_all(StraightCuts& cuts, const std::vector<Dof>& region, bool wrapped, std::vector<Dof> around,
             Check check) {
  std::vector<Side> side(region.size());
  if (region.size() <= kLeaf || !cuts.cut(region, wrapped, around, side)) return;
  check(region, side);
  for (const Side part : {Side::first, Side::second}) {
    std::vector<Dof> inside;
    for (std::size_t k = 0; k < region.size(); ++k) {
      if (side[k] == part) inside.push_back(region[k]);
    }
    ASSERT_LT(inside.size(), region.size());
    ASSERT_FALSE(inside.empty());
    cut_all(cuts, inside, wrapped, around, check);
  }
}

TEST(StraightCuts, LeaveNoBondBetweenTheTwoSides) {
  for (const Network& network : networks()) {
    const UnknownGraph graph = make_unknown_graph(network);
    StraightCuts cuts(graph, kLeaf);
    std::vector<Dof> all(graph.unknowns());
    std::iota(all.begin(), all.end(), 0);
    std::vector<int> of(graph.unknowns(), -1);
    int regions = 0;
    cut_all(cuts, all, graph.wrapped, {}, [&](const std::vector<Dof>& region, const std::vector<Side>& side) {
      ++regions;
      for (std::size_t k = 0; k < region.size(); ++k) of[region[k]] = static_cast<int>(side[k]);
      for (const Dof i : region) {
        for (const Dof j : graph.neighbours(i)) {
          EXPECT_FALSE(of[i] == static_cast<int>(Side::first) && of[j] == static_cast<int>(Side::second));
        }
      }
      for (const Dof i : region) of[i] = -1;
    });
    EXPECT_GT(regions, 1);
  }
}

TEST(StraightCuts, SayWhatTheirPartsTouch) {
  for (const Network& network : networks()) {
    const UnknownGraph graph = make_unknown_graph(network);
    StraightCuts cuts(graph, kLeaf);
    std::vector<Dof> all(graph.unknowns());
    std::iota(all.begin(), all.end(), 0);
    std::vector<Side> side(all.size());
    std::vector<Dof> around;
    bool wrapped = graph.wrapped;
    ASSERT_TRUE(cuts.cut(all, wrapped, around, side));
    std::vector<Dof> separator;
    for (const Dof i : all) {
      if (side[i] == Side::separator) separator.push_back(i);
    }
    std::ranges::sort(around);
    EXPECT_EQ(around, separator);
  }
}

/// Rows of a wide lattice, cut out of its middle.
std::vector<Dof> block(const UnknownGraph& graph, std::int32_t x, std::int32_t y) {
  std::vector<Dof> region;
  for (Dof i = 0; i < graph.unknowns(); ++i) {
    const Place place = graph.place[i];
    if (place.x >= x && place.x < x + 8 && place.y >= y && place.y < y + 4) region.push_back(i);
  }
  return region;
}

TEST(CutPatterns, AreOfRegionsThatArePlacedAndCoupledAlike) {
  const Network network = make_network(triangular_lattice(20, 1), Model::spring, Grips::sliding, {});
  const UnknownGraph graph = make_unknown_graph(network);
  CutPatterns patterns(graph, graph.place);
  const auto shape = [&](std::int32_t x, std::int32_t y) {
    return patterns.shape_of(block(graph, x, y), {});
  };
  EXPECT_EQ(shape(4, 4), shape(10, 4));
  EXPECT_EQ(shape(4, 4), shape(8, 10));
  EXPECT_NE(shape(4, 4), shape(4, 5));  // rows are shifted the other way
  EXPECT_NE(patterns.shape_of(block(graph, 4, 4), block(graph, 4, 8)), shape(4, 4));
  patterns.keep(shape(4, 4), {{1, 0}, {}});
  ASSERT_NE(patterns.find(shape(10, 4)), nullptr);
  EXPECT_EQ(patterns.find(shape(10, 4))->order, (std::vector<std::int32_t>{1, 0}));
  EXPECT_EQ(patterns.find(shape(4, 5)), nullptr);
}

TEST(CutPatterns, DifferWhereABondIsMissing) {
  const Lattice lattice = triangular_lattice(20, 1);
  const Network whole = make_network(lattice, Model::spring, Grips::sliding, {});
  const UnknownGraph graph = make_unknown_graph(whole);
  const std::vector<Dof> region = block(graph, 8, 8);
  const auto shape = [](const UnknownGraph& of, const std::vector<Dof>& unknowns) {
    return CutPatterns(of, of.place).shape_of(unknowns, {});
  };
  std::vector<double> stiffness(lattice.bond.size(), 1.0);
  BondId inside = 0;
  const auto holds = [&](NodeId node) { return std::ranges::binary_search(region, whole.dof[2 * node]); };
  while (!holds(lattice.bond[inside][0]) || !holds(lattice.bond[inside][1])) ++inside;
  stiffness[inside] = 0;
  const Network gapped = make_network(lattice, Model::spring, Grips::sliding, stiffness);
  EXPECT_NE(shape(graph, region), shape(make_unknown_graph(gapped), region));
}

}  // namespace
}  // namespace crackle
