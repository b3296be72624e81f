#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/equilibrium/tree/equilibrium_tree.hpp"
#include "crackle/equilibrium/tree/tree_response.hpp"
#include "support/break_record.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

using Thresholds = std::vector<double>;

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Breaks a sample by responses as far as they go; how often a factor had to go on is added to `left`.
SampleRecord record_by_responses(const Network& network, const Thresholds& threshold, BreakOn break_on,
                                 std::int64_t& left) {
  PhaseTimes times;
  const auto equilibrium = make_equilibrium_tree(network, {.break_on = break_on}, times);
  SampleRecord record = test::break_record(*equilibrium, threshold);
  left += tree_counts(*equilibrium).left;
  return record;
}

/// The bonds that 113 bits break, at the same loads: where F has fallen its error is that of a difference.
void expect_quad_breaks(const SampleRecord& found, const Network& network, const Thresholds& threshold,
                        BreakOn break_on = BreakOn::magnitude) {
  const SampleRecord quad =
      test::break_record(network, {.strategy = "quad", .common = {.break_on = break_on}}, threshold);
  ASSERT_EQ(found.bond, quad.bond);
  for (std::size_t i = 0; i < quad.bond.size(); ++i) {
    const double allowed = 1e-12 * quad.stiffness[0] / quad.stiffness[i];
    EXPECT_NEAR(found.load[i], quad.load[i], allowed * quad.load[i]) << i;
    EXPECT_NEAR(found.stiffness[i], quad.stiffness[i], allowed * quad.stiffness[i]) << i;
  }
}

TEST(TreeResponse, BreaksWholeSamplesAlone) {
  std::int64_t left = 0;
  std::int64_t samples = 0;
  for (const test::NamedNetwork& named : test::triangular_networks(7)) {
    for (const BreakOn break_on : {BreakOn::magnitude, BreakOn::tension}) {
      for (const std::int64_t sample : {0, 1, 2, 3}) {
        SCOPED_TRACE(named.name + " sample " + std::to_string(sample));
        const Thresholds threshold = test::uniform_thresholds(named.network, sample);
        expect_quad_breaks(record_by_responses(named.network, threshold, break_on, left), named.network,
                           threshold, break_on);
        ++samples;
      }
    }
  }
  EXPECT_LT(4 * left, samples) << "a factor went on with too many of them";
}

/// Thresholds in proportion to the intact network's forces, lower by `difference` times one of five numbers.
Thresholds nearly_tied(const Network& network, double difference) {
  PhaseTimes times;
  const auto equilibrium = make_equilibrium(network, {.strategy = "quad"}, times);
  Thresholds threshold(network.bonds(), 1.0);
  equilibrium->reset(threshold);
  Critical next;
  EXPECT_EQ(equilibrium->find_critical(next), State::carrying);
  const std::vector<double> force = equilibrium->forces();
  for (BondId e = 0; e < network.bonds(); ++e) {
    threshold[e] = force[e] == 0 ? kNever : std::abs(force[e]) * (1 - difference * ((7 * e) % 5));
  }
  return threshold;
}

TEST(TreeResponse, TellsNearTiesAsWideArithmeticDoes) {
  std::int64_t left = 0;
  for (const double difference : {1e-6, 1e-9, 4e-11, 1e-12, 1e-14, 0.0}) {
    for (const int size : {3, 7}) {
      for (const test::NamedNetwork& named : test::triangular_networks(size)) {
        SCOPED_TRACE(named.name + " difference " + std::to_string(1e15 * difference) + "e-15");
        const Thresholds threshold = nearly_tied(named.network, difference);
        expect_quad_breaks(record_by_responses(named.network, threshold, BreakOn::magnitude, left),
                           named.network, threshold);
      }
    }
  }
}

/// Ratios that differ by as much as ties may: nobody knows them so well, and a factor has the word.
TEST(TreeResponse, LeavesWhatLiesOnTheLimitOfTies) {
  const Network network = test::bundle(6);
  Thresholds threshold(6, 1.0);
  threshold[5] = 1 - kTie;
  std::int64_t left = 0;
  (void)record_by_responses(network, threshold, BreakOn::magnitude, left);
  EXPECT_EQ(left, 1);
  threshold[5] = 1 - 2 * kTie;
  EXPECT_EQ(record_by_responses(network, threshold, BreakOn::magnitude, left).bond.front(), 5);
  threshold[5] = 1 - 0.5 * kTie;
  EXPECT_EQ(record_by_responses(network, threshold, BreakOn::magnitude, left).bond.front(), 0);
  EXPECT_EQ(left, 1);
}

TEST(TreeResponse, EndsWithWhatIsLeftToAFactor) {
  std::int64_t left = 0;
  const Network uneven = test::bundle(4, {1, 1e-5, 1, 1e-5});
  const Thresholds same(4, 1.0);
  const SampleRecord record = record_by_responses(uneven, same, BreakOn::magnitude, left);
  EXPECT_EQ(record.bond, (std::vector<BondId>{0, 2, 1, 3}));
  EXPECT_NEAR(record.load[2], 2, 1e-9);
  EXPECT_EQ(left, 1) << "the third bond's slack is as small as its share of the stiffness";
  left = 0;
  const Network even = test::bundle(4);
  EXPECT_EQ(record_by_responses(even, same, BreakOn::magnitude, left).bond,
            (std::vector<BondId>{0, 1, 2, 3}));
  EXPECT_EQ(left, 0) << "nothing is left to tell";
}

/// Stiffnesses of c^r, r uniform on [-1, 0).
Network contrasted(const Network& network, double contrast) {
  std::vector<double> stiffness(network.bonds());
  draw_uniform_thresholds(5, 0, stiffness);
  for (double& k : stiffness) k = std::pow(contrast, -k);
  return make_network(network.lattice, network.model, network.grips, stiffness);
}

TEST(TreeResponse, BreaksTheSameBondsWhereStiffnessesAreFarApart) {
  for (const double contrast : {1e2, 1e4, 1e8, 1e12}) {
    for (const test::NamedNetwork& named : test::triangular_networks(5)) {
      const Network network = contrasted(named.network, contrast);
      for (const std::int64_t sample : {0, 1}) {
        SCOPED_TRACE(named.name + " contrast " + std::to_string(contrast));
        std::int64_t left = 0;
        const Thresholds threshold = test::uniform_thresholds(network, sample);
        const SampleRecord found = record_by_responses(network, threshold, BreakOn::magnitude, left);
        EXPECT_EQ(found.bond, test::break_record(network, {.strategy = "dense"}, threshold).bond);
      }
    }
  }
}

/// The parts of TreeResponse's surroundings, for a look at it alone.
struct Alone {
  const Network& network;
  SeparatorTree tree = make_separator_tree(network, Dissection::automatic);
  TreeBonds bonds = make_tree_bonds(network, tree);
  TreeScratch scratch{tree};
  TreeFactor factor{tree, bonds, *tree_kernels().front(), false, scratch};

  TreeResponse make() {
    factor.restore();
    const TreeKernels& kernels = *tree_kernels().front();
    return {network, make_intact_response(network, tree, bonds, factor, kernels), kernels,
            BreakOn::magnitude};
  }
};

TEST(TreeResponse, GivesTheDisplacementsOfEveryStateItVerifies) {
  for (const test::NamedNetwork& named : test::triangular_networks(6)) {
    SCOPED_TRACE(named.name);
    const Network& network = named.network;
    Alone alone{network};
    TreeResponse response = alone.make();
    ASSERT_TRUE(response.is_sound());
    ASSERT_TRUE(response.reset(test::uniform_thresholds(network, 2)));
    std::vector<std::uint8_t> broken(network.bonds(), 0);
    std::vector<double> u(network.unknowns);
    std::vector<double> r(network.unknowns);
    int breaks = 0;
    while (response.next(1e-6 * network.plate_diagonal) == ResponseResult::found) {
      for (int s = 0; s < std::ssize(response.verified()); ++s, ++breaks) {
        response.get_displacements(s, u);
        EXPECT_LT(backward_error(network, broken, u, r), 1e-14);
        EXPECT_NEAR(u[network.plate] * response.verified()[s].stiffness, 1, 1e-12);
        broken[response.verified()[s].bond] = 1;
      }
    }
    EXPECT_GT(breaks, 8);
    ASSERT_TRUE(response.get_free_motion(u));
    EXPECT_EQ(u[network.plate], 1);
    for (BondId e = 0; e < network.bonds(); ++e) {
      EXPECT_NEAR(broken[e] == 0 ? elongation(network, e, u) : 0, 0, 1e-11) << e;
    }
  }
}

TEST(TreeResponse, RefusesThresholdsOfNoStrengthAndNetworksItCannotTell) {
  const Network network = test::triangular_networks(3)[1].network;
  Alone alone{network};
  TreeResponse response = alone.make();
  Thresholds threshold = test::uniform_thresholds(network, 0);
  EXPECT_TRUE(response.reset(threshold));
  threshold[4] = 0;
  EXPECT_FALSE(response.reset(threshold));
  threshold[4] = 1e-200;
  EXPECT_FALSE(response.reset(threshold));
  threshold[4] = kNever;
  EXPECT_TRUE(response.reset(threshold));
  const Network far = contrasted(network, 1e12);
  EXPECT_FALSE(Alone{far}.make().is_sound());
  EXPECT_FALSE(TreeResponse::is_worthwhile(test::triangular_networks(32)[1].network));
}

}  // namespace
}  // namespace crackle
