#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "crackle/base/named.hpp"
#include "crackle/network/lattices.hpp"
#include "crackle/network/network_file.hpp"
#include "support/break_record.hpp"
#include "support/expect_refused.hpp"

namespace crackle {
namespace {

Lattice make(const char* kind, int size) {
  return find_named(lattice_kinds(), kind)->make(size, 1);
}

/// Bonds of each node that no grip holds.
std::set<int> free_coordination(const Lattice& lattice) {
  std::vector<int> count(lattice.position.size(), 0);
  for (const auto& ends : lattice.bond) {
    for (const NodeId node : ends) ++count[node];
  }
  std::set<int> seen;
  for (NodeId node = 0; node < lattice.nodes(); ++node) {
    if (lattice.grip[node] == Grip::free) seen.insert(count[node]);
  }
  return seen;
}

double intact_stiffness(const char* kind, int size) {
  NetworkOptions options;
  options.lattice = find_named(lattice_kinds(), kind);
  options.size = size;
  options.model = Model::fuse;
  const Network network = load_network(options).network;
  return test::break_record(network, {.strategy = "dense"}, test::uniform_thresholds(network, 0))
      .stiffness[0];
}

TEST(Lattices, EveryKindIsWhatItsRowSays) {
  for (const LatticeKind& kind : lattice_kinds()) {
    SCOPED_TRACE(kind.name);
    EXPECT_STRNE(kind.meaning, "");
    for (const int size : {1, 2, 5}) {
      const Lattice lattice = kind.make(size, 0.7);
      EXPECT_EQ(lattice.nodes(), (size + 1) * (size + 1));
      EXPECT_EQ(std::ranges::count(lattice.grip, Grip::bottom), size + 1);
      EXPECT_EQ(std::ranges::count(lattice.grip, Grip::top), size + 1);
      EXPECT_NEAR(lattice.position.back().y, 0.7 * size, 1e-15 * size);
    }
    NetworkOptions springs;
    springs.lattice = &kind;
    springs.size = 4;
    if (kind.floppy == nullptr) {
      EXPECT_NO_THROW((void)load_network(springs));
    } else {
      test::expect_refused([&] { (void)load_network(springs); },
                           {"-lattice", kind.name, kind.floppy, "fuse"});
    }
    springs.model = Model::fuse;
    EXPECT_NO_THROW((void)load_network(springs));
  }
}

TEST(Lattices, DiamondHasTwoBondsUpFromEveryNode) {
  for (const int size : {1, 2, 3, 8}) {
    const Lattice lattice = make("diamond", size);
    EXPECT_EQ(lattice.bonds(), 2 * size * (size + 1));
    EXPECT_EQ(free_coordination(lattice), size > 1 ? std::set<int>{4} : std::set<int>{});
    // rows are equipotential: L resistances of 1 / (2(L+1)) in a row
    EXPECT_NEAR(intact_stiffness("diamond", size), 2.0 * (size + 1) / size, 1e-12);
  }
}

TEST(Lattices, SquareHasBondsAlongAndUp) {
  for (const int size : {2, 3, 8}) {
    const Lattice lattice = make("square", size);
    EXPECT_EQ(lattice.bonds(), (2 * size + 1) * (size + 1));
    EXPECT_EQ(free_coordination(lattice), std::set<int>{4});
    EXPECT_NEAR(intact_stiffness("square", size), (size + 1.0) / size, 1e-12);
  }
}

}  // namespace
}  // namespace crackle
