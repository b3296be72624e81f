#include <gtest/gtest.h>

#include "crackle/equilibrium/ksp/capacitance.hpp"

namespace crackle {
namespace {

/// C = [[0.5, 0.1, 0], [0.1, 0.4, -0.2], [0, -0.2, 0.9]], row by row.
TEST(Capacitance, GrowsAndSolves) {
  Capacitance capacitance;
  EXPECT_DOUBLE_EQ(capacitance.grow({}, 0.5), 0.5);
  EXPECT_NEAR(capacitance.grow(std::vector{0.1}, 0.4), 0.38, 1e-15);
  EXPECT_NEAR(capacitance.grow(std::vector{0.0, -0.2}, 0.9), 0.9 - 0.04 / 0.38, 1e-15);
  ASSERT_EQ(capacitance.size(), 3);
  std::vector<double> s{0.5 + 0.2, 0.1 + 0.8 - 0.6, -0.4 + 2.7};  // C (1, 2, 3)
  capacitance.solve(s);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(s[i], i + 1, 1e-14);
  capacitance.clear();
  EXPECT_EQ(capacitance.size(), 0);
  EXPECT_DOUBLE_EQ(capacitance.grow({}, 0.25), 0.25);
}

TEST(Capacitance, LeavesOutABondWithoutSlack) {
  Capacitance capacitance;
  ASSERT_GT(capacitance.grow({}, 0.25), 0);
  EXPECT_EQ(capacitance.grow(std::vector{0.25}, 0.25), 0) << "singular";
  EXPECT_EQ(capacitance.grow(std::vector{0.9}, 0.25), 0) << "indefinite";
  EXPECT_EQ(capacitance.size(), 1);
  std::vector<double> s{1};
  capacitance.solve(s);
  EXPECT_DOUBLE_EQ(s[0], 4);
}

}  // namespace
}  // namespace crackle
