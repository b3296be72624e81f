#include <gtest/gtest.h>

#include <limits>

#include "crackle/equilibrium/trust.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Fuses of stiffness 1 and 1 side by side under a unit load: each carries 1/2.
struct Pair {
  Network network = test::bundle(2);
  std::vector<double> u = std::vector<double>(static_cast<std::size_t>(network.unknowns), 0.5);
  std::vector<double> threshold{0.5, 0.6};

  [[nodiscard]] bool is_open(double norm, bool iterates) const {
    const SolvedState state{network, threshold, BreakOn::magnitude,
                            2.0,     u,         {.bond = 0, .load = 1, .stiffness = 2}};
    return is_left_open(state, norm, iterates);
  }
};

TEST(Trust, AnIterationsResidualLeavesOpenWhatItsForcesMayTurn) {
  const Pair pair;
  // ratios 1 and 5/6: equal when each force is off by 1/22
  const double turns = 1.0 / 22 / kForcePerResidual;
  EXPECT_FALSE(pair.is_open(0.99 * turns, true));
  EXPECT_TRUE(pair.is_open(1.01 * turns, true));
}

TEST(Trust, ADirectSolversResidualMustBeSmallWhateverTheRatios) {
  Pair pair;
  pair.threshold[1] = 1e6;
  const double off = kUncertainForce / kForcePerResidual;
  EXPECT_TRUE(pair.is_open(1.01 * off, false));
  EXPECT_FALSE(pair.is_open(1.01 * off, true)) << "no bond comes near";
  EXPECT_FALSE(pair.is_open(0.99 * off, false));
  pair.threshold = {0.5, 0.5 * (1 + 1e-10)};
  EXPECT_TRUE(pair.is_open(1.01 * kDoubtfulResidual, false));
  EXPECT_FALSE(pair.is_open(kDoubtfulResidual, false)) << "what rounding leaves";
}

TEST(Trust, AResidualThatIsNotANumberLeavesEverythingOpen) {
  for (const bool iterates : {false, true}) {
    EXPECT_TRUE(Pair{}.is_open(std::numeric_limits<double>::quiet_NaN(), iterates));
  }
}

/// Fuses of stiffness 1/2 and 1/2 beside 1 and 1: F = 3/2 + 1/2; without the first, 3/2.
TEST(Trust, TheSlackOfABreakFollowsFromFBeforeAndAfter) {
  const double k = 0.5;
  const double before = 1 / 2.0;
  const double after = 1 / 1.5;
  const double force = k * before;
  EXPECT_NEAR(slack_of_break(force * force / k, before, after), 1 - k * before, 1e-15);
  EXPECT_GT(slack_of_break(1, 1, 1), 0) << "F that doesn't change says no more than rounding does";
  EXPECT_LT(slack_of_break(1, 1, 1), 1e14);
}

TEST(Trust, ACriticalBondIsTinyForItsThreshold) {
  const Network network = test::bundle(2);
  const Critical next{.bond = 1, .load = 2, .stiffness = 2};
  EXPECT_FALSE(is_tiny(network, std::vector{1.0, 1.01 * kTinyElongation}, next));
  EXPECT_TRUE(is_tiny(network, std::vector{1.0, 0.99 * kTinyElongation}, next));
  EXPECT_TRUE(is_tiny(network, std::vector{1.0, 0.0}, {.bond = 1, .load = 0, .stiffness = 2}));
}

TEST(Trust, AStiffBondWithASlightThresholdMayHideAForce) {
  const Network network = test::bundle(2, {1e6, 1});
  const Critical next{.bond = 1, .load = 1, .stiffness = 1};
  const double hidden = kHiddenElongation * 1e6;
  ASSERT_GT(hidden, kHiddenForce);
  const std::vector<BondId> slight{0};
  EXPECT_TRUE(may_hide_one(network, std::vector{0.99 * hidden, 1.0}, slight, next));
  EXPECT_FALSE(may_hide_one(network, std::vector{1.01 * hidden, 1.0}, slight, next));
  EXPECT_FALSE(may_hide_one(network, std::vector{0.0, 1.0}, {}, next)) << "not a slight one";
  EXPECT_FALSE(
      may_hide_one(network, std::vector{kNever, 1.0}, slight, {.bond = 1, .load = kNever, .stiffness = 1}))
      << "broken";
  const Network even = test::bundle(2);
  EXPECT_FALSE(may_hide_one(even, std::vector{0.0, 1.0}, slight, next)) << "too soft to hide anything";
}

TEST(Trust, PivotsAreCertainDownToTheRoundingOfTheStiffestBond) {
  EXPECT_EQ(least_certain_pivot(1), kSoftPivot);
  EXPECT_GT(least_certain_pivot(1e8), 1e-6);
}

}  // namespace
}  // namespace crackle
