#include <gtest/gtest.h>

#include <algorithm>

#include "crackle/network/lattices.hpp"
#include "crackle/network/network_file.hpp"
#include "support/expect_refused.hpp"

namespace crackle {
namespace {

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

}  // namespace
}  // namespace crackle
