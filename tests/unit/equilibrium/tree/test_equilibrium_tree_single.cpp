#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/equilibrium/tree/equilibrium_tree.hpp"
#include "support/break_record.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

using Thresholds = std::vector<double>;

/// A factor from the first break on, whatever the network's size.
TreeOptions by_factor(Precision precision, const TreeKernels* kernels = nullptr) {
  return {.precision = precision, .responses = false, .kernels = kernels};
}

/// Relative rounding of loads and stiffnesses in double, times F_1 / F_k.
constexpr double kRounding = 1e-11;

/// The bonds that dense solves break, in both precisions, at loads that are as near as F lets them be.
void expect_dense_breaks(const Network& network, const Thresholds& threshold, BatchCounts& counts,
                         BreakOn break_on = BreakOn::magnitude, double rounding = kRounding) {
  const EquilibriumOptions options{.break_on = break_on};
  const SampleRecord dense = test::break_record(network, {.strategy = "dense", .common = options}, threshold);
  for (const Precision precision : {Precision::single, Precision::all_double}) {
    SCOPED_TRACE(precision == Precision::single ? "single" : "double");
    PhaseTimes times;
    const auto tree = make_equilibrium_tree(network, options, times, by_factor(precision));
    const SampleRecord found = test::break_record(*tree, threshold);
    ASSERT_EQ(found.bond, dense.bond);
    for (std::size_t i = 0; i < dense.bond.size(); ++i) {
      const double allowed = rounding * dense.stiffness[0] / dense.stiffness[i];
      EXPECT_NEAR(found.load[i], dense.load[i], allowed * dense.load[i]) << i;
      EXPECT_NEAR(found.stiffness[i], dense.stiffness[i], allowed * dense.stiffness[i]) << i;
    }
    const BatchCounts batch = tree_counts(*tree).batch;
    EXPECT_LE(batch.used_margin, 1);
    EXPECT_TRUE(precision == Precision::single || batch.single == 0);
    counts.single += batch.single;
    counts.undecided += batch.undecided;
    counts.contenders += batch.contenders;
  }
}

Network with_stiffness(const Network& network, std::vector<double> stiffness) {
  return make_network(network.lattice, network.model, network.grips, std::move(stiffness));
}

/// Stiffnesses of contrast^r, r uniform on [0, 1).
Network contrasted(const Network& network, double contrast) {
  std::vector<double> stiffness(network.bonds());
  draw_uniform_thresholds(5, 0, stiffness);
  for (double& k : stiffness) k = std::pow(contrast, k);
  return with_stiffness(network, std::move(stiffness));
}

TEST(EquilibriumTreeSingle, BreaksTheSameBondsWhereStiffnessesAreFarApart) {
  BatchCounts counts;
  for (const double contrast : {1e4, 1e8}) {
    for (const test::NamedNetwork& named : test::triangular_networks(7)) {
      const Network network = contrasted(named.network, contrast);
      for (const BreakOn break_on : {BreakOn::magnitude, BreakOn::tension}) {
        for (const std::int64_t sample : {0, 1}) {
          SCOPED_TRACE(named.name + " contrast " + std::to_string(contrast) + " " + std::to_string(sample));
          expect_dense_breaks(network, test::uniform_thresholds(network, sample), counts, break_on,
                              std::max(kRounding, 1e-16 * contrast));
        }
      }
    }
  }
  EXPECT_GT(counts.single, 100);
}

bool carries(const Network& network) {
  PhaseTimes times;
  const auto equilibrium = make_equilibrium(network, {.strategy = "dense"}, times);
  equilibrium->reset(Thresholds(network.bonds(), 1.0));
  Critical next;
  return equilibrium->find_critical(next) == State::carrying;
}

/// From a whole lattice to where springs hold no longer together: what is loose from the start is pinned.
TEST(EquilibriumTreeSingle, BreaksDilutedNetworksToTheLossOfRigidity) {
  BatchCounts counts;
  int loose = 0;
  for (const double share : {0.1, 0.2, 0.3, 0.4, 0.45}) {
    for (const test::NamedNetwork& named : test::triangular_networks(9)) {
      for (const std::uint64_t seed : {21, 22}) {
        SCOPED_TRACE(named.name + " without " + std::to_string(share) + ", " + std::to_string(seed));
        std::vector<double> stiffness(named.network.bonds());
        draw_uniform_thresholds(seed, 0, stiffness);
        for (double& k : stiffness) k = k < share ? 0 : 1;
        const Network network = with_stiffness(named.network, stiffness);
        if (carries(network)) {
          expect_dense_breaks(network, test::uniform_thresholds(network, 0), counts);
        } else {
          ++loose;
        }
      }
    }
  }
  EXPECT_TRUE(loose > 0 && loose < 20) << loose << " of 40 networks, so the others have come near to it";
  EXPECT_GT(counts.single, 10);
}

TEST(EquilibriumTreeSingle, LeavesToDoubleWhatItsRangeCannotHold) {
  for (const test::NamedNetwork& named : test::triangular_networks(8)) {
    SCOPED_TRACE(named.name);
    BatchCounts counts;
    Thresholds threshold = test::uniform_thresholds(named.network, 0);
    for (double& t : threshold) t = std::pow(10, 15 - 30 * t);
    expect_dense_breaks(named.network, threshold, counts);
    EXPECT_EQ(counts.single, 0);
  }
}

/// Once bonds of no strength are gone, and the factor has taken them in, what is left is in range.
TEST(EquilibriumTreeSingle, BreaksBondsOfNoStrengthFirst) {
  for (const test::NamedNetwork& named : test::triangular_networks(20)) {
    SCOPED_TRACE(named.name);
    Thresholds threshold = test::uniform_thresholds(named.network, 0);
    for (double& t : threshold) t = t < 0.12 ? 0 : t;
    PhaseTimes times;
    const auto single = make_equilibrium_tree(named.network, {}, times, by_factor(Precision::single));
    const auto wide = make_equilibrium_tree(named.network, {}, times, by_factor(Precision::all_double));
    EXPECT_EQ(test::break_record(*single, threshold).bond, test::break_record(*wide, threshold).bond);
    EXPECT_GT(tree_counts(*single).batch.single, 0);
  }
}

TEST(EquilibriumTreeSingle, HasTheDisplacementsOfAFullSolveAtEveryBreak) {
  std::int64_t single = 0;
  for (const test::NamedNetwork& named : test::triangular_networks(10)) {
    SCOPED_TRACE(named.name);
    PhaseTimes times;
    const auto tree = make_equilibrium_tree(named.network, {}, times, by_factor(Precision::single));
    const auto dense = make_equilibrium(named.network, {.strategy = "dense"}, times);
    tree->reset(test::uniform_thresholds(named.network, 3));
    dense->reset(test::uniform_thresholds(named.network, 3));
    std::vector<double> r(named.network.unknowns);
    Critical next;
    Critical expected;
    int breaks = 0;
    for (; dense->find_critical(expected) == State::carrying; ++breaks) {
      ASSERT_EQ(tree->find_critical(next), State::carrying);
      ASSERT_EQ(next.bond, expected.bond) << breaks;
      const auto u = tree->displacements();
      const auto v = dense->displacements();
      EXPECT_LT(backward_error(named.network, tree->broken(), u, r), 1e-13) << breaks;
      for (BondId e = 0; e < named.network.bonds(); ++e) {
        if (tree->broken()[e] != 0) continue;
        EXPECT_NEAR(elongation(named.network, e, u) / v.back(), elongation(named.network, e, v) / v.back(),
                    1e-9)
            << e;
      }
      tree->remove(next.bond);
      dense->remove(next.bond);
    }
    EXPECT_EQ(tree->find_critical(next), State::failed);
    single += tree_counts(*tree).batch.single;
    EXPECT_GT(breaks, 20);
  }
  EXPECT_GT(single, 10);
}

auto bits(const SampleRecord& record) {
  return std::tuple(record.bond, record.load, record.stiffness);
}

TEST(EquilibriumTreeSingle, HasTheSameBitsInAnyOrderOfSamples) {
  for (const test::NamedNetwork& named : test::triangular_networks(20)) {
    SCOPED_TRACE(named.name);
    PhaseTimes times;
    const auto alone = make_equilibrium_tree(named.network, {}, times, by_factor(Precision::single));
    const auto last = make_equilibrium_tree(named.network, {}, times, by_factor(Precision::single));
    const SampleRecord expected = test::break_record(*alone, test::uniform_thresholds(named.network, 3));
    for (const std::int64_t sample : {0, 1, 2})
      (void)test::break_record(*last, test::uniform_thresholds(named.network, sample));
    const std::int64_t before = tree_counts(*last).batch.candidates;
    EXPECT_EQ(bits(test::break_record(*last, test::uniform_thresholds(named.network, 3))), bits(expected));
    EXPECT_EQ(tree_counts(*last).batch.candidates - before, tree_counts(*alone).batch.candidates);
    EXPECT_GT(tree_counts(*alone).batch.single, 0);
  }
}

}  // namespace
}  // namespace crackle
