#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "crackle/equilibrium/tree/equilibrium_tree.hpp"
#include "support/break_record.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// A bundle of fuses below, chains side by side above, and a stiff fuse in parallel with all chains. The bundle's fuses
/// break one by one at slowly growing loads, then the stiff fuse, and then, at a lower load, the middle of one of two
/// chains: nine tenths of their load are new to them, they are far from the fuse that broke and from each other, and were
/// below every fuse of the bundle in rank.
struct Shielded {
  static constexpr int kBundle = 200;
  static constexpr int kBefore = 21;  // of the bundle, that break before the stiff fuse
  static constexpr int kChains = 60;
  static constexpr int kLinks = 7;
  static constexpr double kStiff = 1e4;

  std::vector<double> chain;  // [kChains] stiffness of its links
  double chains = 0;          // stiffness of all
  Network network;
  std::vector<double> threshold;

  Shielded() : chain(kChains), network(make()), threshold(network.bonds(), 10.0) {
    for (int i = 0; i < kBundle; ++i) threshold[i] = (1 + 1e-4 * i) / (kBundle - i);
    threshold[kBundle] = kStiff / (kStiff + chains) * (1 + 1e-4 * (kBefore - 0.5));
  }
  Network make() {
    draw_uniform_thresholds(31, 0, chain);
    test::Bonds bonds(kBundle, {0, 1});
    std::vector<double> stiffness(kBundle, 1.0);
    constexpr NodeId kTop = 2 + kChains * (kLinks - 1);
    bonds.push_back({1, kTop});
    stiffness.push_back(kStiff);
    for (int c = 0; c < kChains; ++c) {
      chain[c] = 105 * (1 + 0.3 * chain[c]);
      chains += chain[c] / kLinks;
      const NodeId first = 2 + c * (kLinks - 1);
      for (int i = 0; i < kLinks; ++i) {
        bonds.push_back({i == 0 ? 1 : first + i - 1, i + 1 == kLinks ? kTop : first + i});
        stiffness.push_back(chain[c]);
      }
    }
    return test::fuses_between(kTop + 1, bonds, stiffness);
  }
  /// The middle link of a chain, which from now on breaks at this load, once the stiff fuse is gone.
  BondId weaken(int c, double load) {
    const BondId e = kBundle + 1 + c * kLinks + kLinks / 2;
    threshold[e] = chain[c] / kLinks / chains * load;
    return e;
  }
};

TEST(TreeBatch, TellsNearTiesOfBondsThatNobodyFollowed) {
  Shielded made;
  constexpr double kLoad = 0.99;
  const BondId first = made.weaken(5, kLoad);
  for (const double difference : {1e-5, -1e-5, 1e-7, -1e-7, 1e-9, -1e-9, 1e-10, -1e-10, 1e-12, -1e-12}) {
    const BondId second = made.weaken(44, kLoad * (1 + difference));
    const bool tied = std::abs(difference) < kTie;
    for (const TreeKernels* kernels : tree_kernels()) {
      for (const Precision precision : {Precision::single, Precision::all_double}) {
        const bool single = precision == Precision::single;
        SCOPED_TRACE(std::string(kernels->name) + (single ? " single " : " double ") +
                     std::to_string(1e12 * difference) + "e-12");
        PhaseTimes times;
        const auto tree = make_equilibrium_tree(
            made.network, {}, times, {.precision = precision, .responses = false, .kernels = kernels});
        const SampleRecord record = test::break_record(
            *tree, made.threshold, {.kind = StopRule::Kind::breaks, .value = Shielded::kBefore + 2});
        ASSERT_EQ(record.bond.size(), Shielded::kBefore + 2);
        for (BondId e = 0; e < Shielded::kBefore; ++e) EXPECT_EQ(record.bond[e], e);
        EXPECT_EQ(record.bond[Shielded::kBefore], Shielded::kBundle) << "the stiff fuse";
        EXPECT_EQ(record.bond.back(), difference > 0 || tied ? first : second);
        EXPECT_NEAR(record.load.back(), kLoad * (1 + std::min(0.0, difference)), 1e-11);
        EXPECT_EQ(tree_counts(*tree).batch.contenders, single ? 2 : 0) << "neither had a column";
      }
    }
  }
}

}  // namespace
}  // namespace crackle
