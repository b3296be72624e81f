/// Every strategy breaks the same bonds in the same order, and finds the same peak load.

#include <gtest/gtest.h>

#include <cmath>

#include "crackle/equilibrium/tree/equilibrium_tree.hpp"
#include "verification.hpp"

namespace crackle::verification {

namespace {

constexpr int kSeeds = 10;
constexpr double kPeakTolerance = 1e-10;

void expect_same(const Sequence& one, const Sequence& other, const std::string& what) {
  ASSERT_EQ(one.bond.size(), other.bond.size()) << what;
  for (std::size_t k = 0; k < one.bond.size(); ++k)
    ASSERT_EQ(one.bond[k], other.bond[k]) << what << ", break " << k;
  EXPECT_EQ(one.summary.n_p, other.summary.n_p) << what;
  EXPECT_LE(std::abs(one.summary.peak_load / other.summary.peak_load - 1), kPeakTolerance) << what;
}

/// Every strategy but the reference, `tree` with every instruction set that this processor has.
std::vector<Strategy> strategies() {
  std::vector<Strategy> all{kUpdown, kUpdownCg, kMumps, kCholmod};
  for (const TreeKernels* kernels : tree_kernels()) {
    all.push_back({.name = kernels->name, .equilibrium = "tree", .petsc_options = "", .kernels = kernels});
  }
  return all;
}

class SameBonds : public testing::TestWithParam<Setting> {};

TEST_P(SameBonds, AsDense) {
  const Setting setting = GetParam();
  const Network network = triangular(setting);
  PhaseTimes times;
  const auto dense = start(kDense, network, setting.break_on, times);
  std::vector<Sequence> reference;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    reference.push_back(break_whole(*dense, static_cast<std::uint64_t>(seed), seed));
    ASSERT_GT(reference.back().summary.n_f, setting.size);
  }
  for (const Strategy& strategy : strategies()) {
    const auto equilibrium = start(strategy, network, setting.break_on, times);
    for (int seed = 1; seed <= kSeeds; ++seed) {
      const Sequence sequence = break_whole(*equilibrium, static_cast<std::uint64_t>(seed), seed);
      expect_same(sequence, reference[seed - 1],
                  std::string(strategy.name) + ", seed " + std::to_string(seed));
    }
  }
}

std::vector<Setting> settings() {
  std::vector<Setting> all;
  for (const BreakOn break_on : {BreakOn::magnitude, BreakOn::tension}) {
    for (const int size : {4, 5, 8, 12, 16, 24}) {
      all.push_back({Model::spring, Grips::sliding, break_on, size});
      all.push_back({Model::spring, Grips::clamped, break_on, size});
      all.push_back({Model::fuse, Grips::clamped, break_on, size});
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Lattices, SameBonds, testing::ValuesIn(settings()),
                         testing::PrintToStringParamName());

TEST(SameBondsLarge, TreeAndUpdownAsMumpsAtSize64) {
  for (const Model model : {Model::spring, Model::fuse}) {
    const Network network = triangular({model, Grips::sliding, BreakOn::magnitude, 64});
    PhaseTimes times;
    const auto updown = start(kUpdown, network, BreakOn::magnitude, times);
    const auto mumps = start(kMumps, network, BreakOn::magnitude, times);
    const auto tree = start(kTree, network, BreakOn::magnitude, times);
    const Sequence reference = break_whole(*mumps, 1, 0);
    expect_same(break_whole(*updown, 1, 0), reference, "updown and mumps");
    expect_same(break_whole(*tree, 1, 0), reference, "tree and mumps");
    EXPECT_EQ(updown->counts().refactors, 0);
  }
}

TEST(SameBondsLarge, TreeVerifiedAtEveryBreak) {
  for (const Model model : {Model::spring, Model::fuse}) {
    const Network network = triangular({model, Grips::sliding, BreakOn::magnitude, 32});
    PhaseTimes times;
    const auto tree = start(kTreeVerified, network, BreakOn::magnitude, times);
    for (const int seed : {1, 2, 3}) (void)break_whole(*tree, static_cast<std::uint64_t>(seed), 0);
    const TreeCounts counts = tree_counts(*tree);
    EXPECT_GT(counts.checked, 900);
    EXPECT_EQ(counts.differences, 0);
  }
}

TEST(SameBondsLarge, TreeAsUpdownAtSize128) {
  const Network network = triangular({Model::spring, Grips::sliding, BreakOn::magnitude, 128});
  PhaseTimes times;
  const auto tree = start(kTree, network, BreakOn::magnitude, times);
  const auto updown = start(kUpdown, network, BreakOn::magnitude, times);
  for (const int seed : {1, 2, 3}) {
    const Sequence sequence = break_whole(*tree, static_cast<std::uint64_t>(seed), 0);
    expect_same(sequence, break_whole(*updown, static_cast<std::uint64_t>(seed), 0),
                "seed " + std::to_string(seed));
    EXPECT_GT(sequence.summary.n_f, 4000);
  }
}

}  // namespace

}  // namespace crackle::verification
