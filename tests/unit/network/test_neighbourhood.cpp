#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "crackle/network/neighbourhood.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// The same by rounds over all bonds.
std::set<BondId> near_by_rounds(const Network& network, BondId e, int hops) {
  std::set<NodeId> reached(network.lattice.bond[e].begin(), network.lattice.bond[e].end());
  std::set<BondId> near;
  for (int hop = 0; hop <= hops; ++hop) {
    std::set<NodeId> further = reached;
    for (BondId other = 0; other < network.bonds(); ++other) {
      const auto [a, b] = network.lattice.bond[other];
      if (!network.can_stretch(other) || (!reached.contains(a) && !reached.contains(b))) continue;
      near.insert(other);
      further.insert({a, b});
    }
    reached = further;
  }
  return near;
}

TEST(Neighbourhood, IsWhatRoundsOverAllBondsFind) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    SCOPED_TRACE(named.name);
    Network network = named.network;
    for (BondId e = 0; e < network.bonds(); e += 5) network.stiffness[e] = 0;
    Neighbourhood neighbourhood(network);
    for (int hops = 0; hops <= 3; ++hops) {
      for (BondId e = 0; e < network.bonds(); ++e) {
        if (!network.can_stretch(e)) continue;
        std::vector<BondId> near{-7};  // to be replaced
        std::vector<std::size_t> ring{99};
        neighbourhood.find(e, hops, near, ring);
        const std::set<BondId> found(near.begin(), near.end());
        EXPECT_EQ(found.size(), near.size()) << "a bond twice";
        ASSERT_EQ(ring.size(), static_cast<std::size_t>(hops) + 1);
        for (int fewer = 0; fewer <= hops; ++fewer) {
          const std::set<BondId> inside(near.begin(),
                                        near.begin() + static_cast<std::ptrdiff_t>(ring[fewer]));
          ASSERT_EQ(inside, near_by_rounds(network, e, fewer)) << "bond " << e << ", hops " << fewer;
        }
        EXPECT_TRUE(found.contains(e));
      }
    }
  }
}

TEST(Neighbourhood, GrowsBondByBondAlongAChain) {
  const Network network = test::chain(9);
  Neighbourhood neighbourhood(network);
  for (const auto& [hops, expected] :
       std::vector<std::pair<int, std::vector<BondId>>>{{0, {3, 4, 5}},
                                                        {1, {2, 3, 4, 5, 6}},
                                                        {2, {1, 2, 3, 4, 5, 6, 7}},
                                                        {9, {0, 1, 2, 3, 4, 5, 6, 7, 8}}}) {
    std::vector<BondId> near;
    std::vector<std::size_t> ring;
    neighbourhood.find(4, hops, near, ring);
    std::ranges::sort(near);
    EXPECT_EQ(near, expected) << hops;
  }
}

}  // namespace
}  // namespace crackle
