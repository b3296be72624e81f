#include <gtest/gtest.h>

#include <cmath>

#include "crackle/compare/compare_reference.hpp"
#include "crackle/equilibrium/quad/equilibrium_quad.hpp"
#include "crackle/equilibrium/quad_search.hpp"
#include "crackle/equilibrium/quad_solver.hpp"
#include "support/break_record.hpp"
#include "support/dense_reference.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

using Thresholds = std::vector<double>;

void expect_dense_breaks(const Network& network, const Thresholds& threshold, BreakOn break_on) {
  const SampleRecord dense =
      test::break_record(network, {.strategy = "dense", .common = {.break_on = break_on}}, threshold);
  const SampleRecord quad =
      test::break_record(network, {.strategy = "quad", .common = {.break_on = break_on}}, threshold);
  ASSERT_EQ(quad.bond, dense.bond);
  EXPECT_EQ(quad.summary.n_p, dense.summary.n_p);
  for (std::size_t i = 0; i < dense.bond.size(); ++i) {
    EXPECT_NEAR(quad.load[i], dense.load[i], 1e-9 * dense.load[i]) << i;
    EXPECT_NEAR(quad.stiffness[i] / dense.stiffness[i], 1, 1e-9) << i;
  }
}

TEST(EquilibriumQuad, BreaksTheBondsThatDenseBreaks) {
  for (const int size : {1, 2, 3, 6}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      for (const BreakOn break_on : {BreakOn::magnitude, BreakOn::tension}) {
        SCOPED_TRACE(named.name + " " + std::to_string(size));
        for (const std::int64_t sample : {0, 1}) {
          expect_dense_breaks(named.network, test::uniform_thresholds(named.network, sample), break_on);
        }
      }
    }
  }
}

TEST(EquilibriumQuad, BreaksTiesAndZeroThresholdsByNumber) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    SCOPED_TRACE(named.name);
    Thresholds threshold = test::uniform_thresholds(named.network, 3);
    for (double& t : threshold) t = t < 0.3 ? 0 : t;
    expect_dense_breaks(named.network, threshold, BreakOn::magnitude);
    expect_dense_breaks(named.network, Thresholds(threshold.size(), 0.7), BreakOn::magnitude);
  }
}

/// A bridge almost in balance: what flows through its stiff bond is far above rounding, what that stretches isn't.
TEST(EquilibriumQuad, AndEveryStrategyBreakAStiffBondForAForceThatItsElongationHides) {
  struct Bridge {
    double stiffness, imbalance;
  };
  for (const Bridge bridge : {Bridge{1e5, 1e-9}, Bridge{1e3, 1e-11}, Bridge{1e4, 1e-12}, Bridge{1, 1e-9}}) {
    SCOPED_TRACE(bridge.stiffness);
    const Network network = test::fuses_between(4, {{0, 1}, {1, 3}, {0, 2}, {2, 3}, {1, 2}},
                                                {1, 1, 1, 1 + bridge.imbalance, bridge.stiffness});
    const Thresholds threshold{1, 1.1, 1.2, 1.3, 1e-100};
    for (const char* strategy : {"quad", "tree", "ksp", "dense"}) {
      const SampleRecord record = test::break_record(network, {.strategy = strategy}, threshold);
      EXPECT_EQ(record.bond, (std::vector<BondId>{4, 0, 2})) << strategy;
    }
  }
}

TEST(EquilibriumQuad, BreaksDilutedNetworksAndCountsWhatIsFloppy) {
  for (const bool hanging : {true, false}) {
    const Network network = test::with_node_hanging(hanging);
    expect_dense_breaks(network, test::uniform_thresholds(network, 0), BreakOn::magnitude);
    PhaseTimes times;
    const auto equilibrium = make_equilibrium_quad(network, {}, times);
    equilibrium->reset(test::uniform_thresholds(network, 0));
    Critical next;
    ASSERT_EQ(equilibrium->find_critical(next), State::carrying);
    EXPECT_EQ(equilibrium->counts().null_pivots, hanging ? 1 : 0);
    EXPECT_EQ(equilibrium->counts().unknowns, network.unknowns);
    EXPECT_GT(equilibrium->counts().factor_entries, network.unknowns);
  }
}

/// Downdates against a new factor after every break: the forces agree in every bit of a double but the last, and the
/// strategy makes none on the way but the one that finds nothing to carry.
TEST(EquilibriumQuad, DowndatesAreAsGoodAsNewFactors) {
  for (const test::NamedNetwork& named : test::triangular_networks(7)) {
    SCOPED_TRACE(named.name);
    const Network& network = named.network;
    PhaseTimes times;
    const auto equilibrium = make_equilibrium_quad(network, {}, times);
    Reference fresh(network, BreakOn::magnitude, ReferenceKind::quad);
    equilibrium->reset(test::uniform_thresholds(network, 2));
    fresh.reset(test::uniform_thresholds(network, 2));
    Critical next;
    while (equilibrium->find_critical(next) == State::carrying) {
      const ReferenceState& expected = fresh.solve();
      ASSERT_EQ(next.bond, expected.critical.bond);
      EXPECT_DOUBLE_EQ(next.load, expected.critical.load);
      EXPECT_DOUBLE_EQ(next.stiffness, expected.critical.stiffness);
      const std::vector<double> force = equilibrium->forces();
      for (BondId e = 0; e < network.bonds(); ++e) {
        EXPECT_NEAR(force[e], expected.force[e], 1e-20 + 3e-16 * std::abs(expected.force[e])) << e;
      }
      equilibrium->remove(next.bond);
      fresh.remove(next.bond);
    }
    EXPECT_EQ(fresh.solve().state, State::failed);
    EXPECT_EQ(equilibrium->counts().factorizations, 2);
    EXPECT_EQ(equilibrium->counts().refactors, 1);
    EXPECT_LT(equilibrium->counts().smallest_slack, 0.5);
  }
}

/// Stiff and soft fuses in a row: every one carries the load, the weakest breaks, whatever the others' stiffness.
TEST(EquilibriumQuad, StiffnessesDecadesApartChangeNoChain) {
  for (const double contrast : {1e12, 1e15, 1e18, 1e22}) {
    for (const std::size_t weakest : {0, 1, 2}) {
      for (const std::size_t stiff : {0, 1, 2}) {
        Thresholds stiffness(3, 1.0);
        stiffness[stiff] = contrast;
        Thresholds threshold(3, 1.0);
        threshold[weakest] = 0.1;
        const Network network = test::fuses_between(4, {{0, 1}, {1, 2}, {2, 3}}, stiffness);
        const SampleRecord record = test::break_record(network, {.strategy = "quad"}, threshold);
        ASSERT_EQ(record.bond, std::vector{static_cast<BondId>(weakest)});
        EXPECT_NEAR(record.load[0], 0.1, std::max(1e-16, 1e-34 * contrast));
        EXPECT_NEAR(record.stiffness[0], 1 / (2 + 1 / contrast), 1e-15);
      }
    }
  }
}

/// A soft fuse beside a stiff one carries little, and breaks when its threshold is less.
TEST(EquilibriumQuad, SoftBondsBesideStiffOnesCarryTheirPart) {
  const Network network = test::bundle(3, {1e15, 1, 1e-3});
  const SampleRecord record = test::break_record(network, {.strategy = "quad"}, Thresholds{1, 1e-16, 1e-17});
  EXPECT_EQ(record.bond, (std::vector<BondId>{1, 0, 2}));
  EXPECT_DOUBLE_EQ(record.load[0], 1e-16 * (1e15 + 1 + 1e-3));
}

/// Two springs, clamped, whose middle node is `off` the line of their ends.
Network kinked(double x, double off) {
  return make_network(make_lattice(0, {{0, 0}, {x + off, 1}, {2 * x, 2}},
                                   {Grip::bottom, Grip::free, Grip::top}, {{0, 1}, {1, 2}}),
                      Model::spring, Grips::clamped, {});
}

/// On the line they carry; off it they are a mechanism, as small as the kink may be. One that rounding may have made
/// is none, and where nobody can know that is said.
TEST(EquilibriumQuad, TellsAKinkFromALineAndFromRounding) {
  const auto look = [](double x, double off) {
    const Network network = kinked(x, off);
    PhaseTimes times;
    const auto equilibrium = make_equilibrium_quad(network, {}, times);
    equilibrium->reset(Thresholds{0.3, 0.2});
    Critical next;
    const State state = equilibrium->find_critical(next);
    if (state == State::carrying) {
      EXPECT_EQ(next.bond, 1);
      EXPECT_NEAR(next.stiffness, 0.5 / (1 + x * x), 1e-14);
      EXPECT_EQ(equilibrium->counts().null_pivots, 1);
    }
    if (state == State::unsolved) {
      EXPECT_NE(equilibrium->complaint().find("node 1 (bonds 0, 1)"), std::string::npos);
    }
    return state;
  };
  EXPECT_EQ(look(0.5, 0), State::carrying);
  EXPECT_EQ(look(0.3, 0), State::carrying);
  EXPECT_EQ(look(0.3, 1e-16), State::carrying);
  EXPECT_EQ(look(0.3, 3e-14), State::unsolved);
  for (const double off : {1e-11, 1e-9, 1e-6, 1e-3, 0.1}) EXPECT_EQ(look(0.3, off), State::failed) << off;
}

/// Rows so far apart that only 1e-22 of an inclined bond's force holds a node sideways: it is held all the same, as
/// one by one in 700 digits; where rounding hides it, that is said.
TEST(EquilibriumQuad, HoldsWhatIsHeldAtRightAngles) {
  const auto network_of = [](double spacing) {
    return make_network(triangular_lattice(5, spacing), Model::spring, Grips::sliding, {});
  };
  const Network near = network_of(1e5);
  const Network far = network_of(1e22);
  const Thresholds threshold = test::uniform_thresholds(near, 0);
  const SampleRecord expected = test::break_record(near, {.strategy = "quad"}, threshold);
  const SampleRecord found = test::break_record(far, {.strategy = "quad"}, threshold);
  EXPECT_EQ(expected.bond.size(), 15U);
  EXPECT_EQ(found.bond, expected.bond);
  EXPECT_NEAR(found.summary.peak_load, 2.29014, 1e-5);
  PhaseTimes times;
  const Network farthest = network_of(1e60);
  const auto equilibrium = make_equilibrium_quad(farthest, {}, times);
  equilibrium->reset(threshold);
  Critical next;
  EXPECT_EQ(equilibrium->find_critical(next), State::unsolved);
  EXPECT_NE(equilibrium->complaint().find("whether it is held"), std::string::npos);
}

/// Genuine breaks go on where F has fallen below 1e-9 of what it was; then nothing is left.
TEST(EquilibriumQuad, GoesOnUntilNothingCarries) {
  const Network network = make_network(triangular_lattice(16, 1), Model::spring, Grips::sliding, {});
  Thresholds threshold(network.lattice.bond.size());
  draw_uniform_thresholds(102, 1710, threshold);
  const SampleRecord record = test::break_record(network, {.strategy = "quad"}, threshold);
  EXPECT_EQ(record.bond.size(), 199U);
  EXPECT_NEAR(record.stiffness.back() / record.stiffness.front(), 2.2e-10, 0.1e-10);
  EXPECT_NEAR(record.stiffness[184] / record.stiffness.front(), 8.5e-9, 0.1e-9);
}

TEST(EquilibriumQuad, HasNoMemoryOfEarlierSamples) {
  PhaseTimes times;
  const Network network = test::triangular_networks(4)[1].network;
  const auto equilibrium = make_equilibrium_quad(network, {}, times);
  const SampleRecord first = test::break_record(*equilibrium, test::uniform_thresholds(network, 0));
  (void)test::break_record(*equilibrium, test::uniform_thresholds(network, 1));
  const SampleRecord again = test::break_record(*equilibrium, test::uniform_thresholds(network, 0));
  EXPECT_EQ(again.bond, first.bond);
  EXPECT_EQ(again.load, first.load);
  EXPECT_EQ(again.stiffness, first.stiffness);
}

TEST(EquilibriumQuad, RefusesWhatIsTooLarge) {
  PhaseTimes times;
  const Network network = make_network(triangular_lattice(128, 1), Model::spring, Grips::sliding, {});
  const std::size_t entries = profile_entries(find_quad_order(network).first);
  ASSERT_GT(entries, kMostQuadEntries);
  test::expect_refused([&] { (void)make_equilibrium_quad(network, {}, times); },
                       {"-equilibrium quad", std::to_string(network.unknowns), std::to_string(entries),
                        std::to_string(kMostQuadEntries)});
}

}  // namespace
}  // namespace crackle
