#include <gtest/gtest.h>

#include "crackle/equilibrium/criterion.hpp"
#include "crackle/network/quad_bonds.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

template <class Real>
class Criterion : public testing::Test {};
using Reals = testing::Types<double, long double, Quad>;
class RealNames {
 public:
  template <class Real>
  static std::string GetName(int /*i*/) {  // NOLINT(readability-identifier-naming): what gtest asks for
    return sizeof(Real) == sizeof(double) ? "double" : std::is_same_v<Real, Quad> ? "quad" : "long_double";
  }
};
TYPED_TEST_SUITE(Criterion, Reals, RealNames);

TYPED_TEST(Criterion, OfRatiosWithinATieTheLowestBondBreaks) {
  const std::vector<double> threshold{1, 1, 1, 1};
  Critical next;
  const std::vector<TypeParam> tied{0.5, TypeParam(1 - 0.5 * kTie), 1, 1};
  ASSERT_TRUE(find_largest_ratio<TypeParam>(tied, threshold, BreakOn::magnitude, next));
  EXPECT_EQ(next.bond, 1);
  EXPECT_EQ(next.load, 1) << "the largest ratio's";
  const std::vector<TypeParam> apart{0.5, TypeParam(1 - 2 * kTie), 1, 1};
  ASSERT_TRUE(find_largest_ratio<TypeParam>(apart, threshold, BreakOn::magnitude, next));
  EXPECT_EQ(next.bond, 2);
}

TYPED_TEST(Criterion, TensionLeavesWhatIsPressed) {
  const std::vector<double> threshold{1, 1, kNever};
  const std::vector<TypeParam> force{-2, 1, 5};
  Critical next;
  ASSERT_TRUE(find_largest_ratio<TypeParam>(force, threshold, BreakOn::magnitude, next));
  EXPECT_EQ(next.bond, 0);
  ASSERT_TRUE(find_largest_ratio<TypeParam>(force, threshold, BreakOn::tension, next));
  EXPECT_EQ(next.bond, 1);
  EXPECT_FALSE(
      find_largest_ratio<TypeParam>(std::vector<TypeParam>{-2, -1, 5}, threshold, BreakOn::tension, next));
}

TYPED_TEST(Criterion, RatiosBeyondDoubleTie) {
  const std::vector<double> threshold{1, 1e-310, 0.0, -0.0};
  const std::vector<TypeParam> force{1, 1, 1, 1};
  Critical next;
  ASSERT_TRUE(find_largest_ratio<TypeParam>(force, threshold, BreakOn::tension, next));
  EXPECT_EQ(next.bond, 1);
  EXPECT_EQ(next.load, 0);
}

TYPED_TEST(Criterion, NothingIsLittleElongationAndLittleForceTogether) {
  const Nothing<TypeParam> nothing(TypeParam(2), TypeParam(8));
  const TypeParam length = nothing.elongation();
  const TypeParam force = nothing.force();
  EXPECT_FALSE(nothing.is_less_than(length, force)) << "the bounds themselves";
  EXPECT_TRUE(nothing.is_less_than(2 * length, force / 2));
  EXPECT_TRUE(nothing.is_less_than(length / 2, 2 * force)) << "a stiff bond";
  EXPECT_FALSE(nothing.is_less_than(-length * 2, -2 * force)) << "pressed, where tension is what counts";
  EXPECT_TRUE(nothing.is_less_than_force(3 * length, TypeParam(2))) << "3/2 of the elongation";
  EXPECT_FALSE(nothing.is_less_than_force(3 * length, TypeParam(4)));
  EXPECT_TRUE(nothing.is_less_than_force(2 * force, TypeParam(1e9)));
}

/// From displacements in double it is the same rule, one bond at a time.
TEST(Criterion, AScanIsTheSameRule) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    const Network& network = named.network;
    std::vector<double> u = test::mixed_values(static_cast<std::size_t>(network.unknowns));
    u[network.plate] = 1;
    std::vector<double> threshold(network.lattice.bond.size(), 1.0);
    for (BondId e = 0; e < network.bonds(); ++e) {
      if (!network.can_stretch(e)) threshold[e] = kNever;
    }
    for (const BreakOn break_on : {BreakOn::magnitude, BreakOn::tension}) {
      std::vector<double> force(threshold.size());
      for (BondId e = 0; e < network.bonds(); ++e) {
        force[e] = network.stiffness[e] * elongation(network, e, u);
      }
      Critical expected;
      ASSERT_TRUE(find_largest_ratio<double>(force, threshold, break_on, expected)) << named.name;
      std::vector<double> ratio(force.size());
      Critical next;
      ASSERT_TRUE(scan_ratios(network, threshold, u, break_on, ratio, next)) << named.name;
      EXPECT_EQ(next.bond, expected.bond) << named.name;
      EXPECT_EQ(next.load, expected.load) << named.name;
      EXPECT_EQ(next.stiffness, 1) << named.name;
    }
  }
}

}  // namespace
}  // namespace crackle
