#include <gtest/gtest.h>

#include "crackle/fracture/peak.hpp"
#include "crackle/fracture/stop_rule.hpp"

namespace crackle {
namespace {

using Kind = StopRule::Kind;

TEST(StopRule, OnlyANumberOfBreaksIsReachedWithoutTheNextState) {
  const StopRule three{Kind::breaks, 3};
  EXPECT_FALSE(is_reached(three, 2));
  EXPECT_TRUE(is_reached(three, 3));
  EXPECT_TRUE(is_reached(three, 4));
  EXPECT_TRUE(is_reached({Kind::breaks, 0}, 0));
  for (const Kind other : {Kind::failure, Kind::stiffness, Kind::displacement}) {
    EXPECT_FALSE(is_reached({other, 0}, 1'000'000));
  }
}

TEST(StopRule, TheNextStateEndsASampleAboveOrBelowItsBoundNotAtIt) {
  const Critical next{.bond = 7, .load = 3, .stiffness = 2};
  EXPECT_FALSE(is_reached({Kind::stiffness, 0.5}, 9, 4, next));
  EXPECT_TRUE(is_reached({Kind::stiffness, 0.51}, 9, 4, next));
  EXPECT_FALSE(is_reached({Kind::displacement, 1.5}, 9, 4, next));
  EXPECT_TRUE(is_reached({Kind::displacement, 1.49}, 9, 4, next));
  EXPECT_TRUE(is_reached({Kind::breaks, 9}, 9, 4, next));
  EXPECT_FALSE(is_reached({Kind::breaks, 10}, 9, 4, next));
  EXPECT_FALSE(is_reached({Kind::failure, 0}, 9, 4, {.bond = 7, .load = 3, .stiffness = 0}));
}

TEST(Peak, IsTheFirstOfTheLargestLoads) {
  EXPECT_TRUE(is_new_peak(0, 0, 0)) << "any first break is one, at no load, too";
  EXPECT_FALSE(is_new_peak(0, 0, 1));
  EXPECT_FALSE(is_new_peak(16, 16, 1));
  EXPECT_TRUE(is_new_peak(16.5, 16, 1));
  EXPECT_FALSE(is_new_peak(15, 16, 1));
}

}  // namespace
}  // namespace crackle
