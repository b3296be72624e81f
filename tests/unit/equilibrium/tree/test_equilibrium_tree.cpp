#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <tuple>
#include <typeinfo>

#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/equilibrium/tree/equilibrium_tree.hpp"
#include "support/break_record.hpp"
#include "support/dense_reference.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

using Thresholds = std::vector<double>;

constexpr double kNever = std::numeric_limits<double>::infinity();

SampleRecord tree_record(const Network& network, BreakOn break_on, const TreeOptions& tree,
                         const Thresholds& threshold) {
  PhaseTimes times;
  const auto equilibrium = make_equilibrium_tree(network, {.break_on = break_on}, times, tree);
  return test::break_record(*equilibrium, threshold);
}

/// Relative rounding of loads and stiffnesses, times F_1 / F_k: conditioning grows as the stiffness F falls.
constexpr double kRounding = 1e-11;

/// The same bonds in the same order, loads and stiffnesses to rounding.
void expect_same_breaks(const SampleRecord& tree, const SampleRecord& other) {
  ASSERT_EQ(tree.bond, other.bond);
  EXPECT_EQ(tree.summary.n_p, other.summary.n_p);
  for (std::size_t i = 0; i < other.bond.size(); ++i) {
    const double allowed = kRounding * other.stiffness[0] / other.stiffness[i];
    EXPECT_NEAR(tree.load[i], other.load[i], allowed * other.load[i]) << i;
    EXPECT_NEAR(tree.stiffness[i], other.stiffness[i], allowed * other.stiffness[i]) << i;
  }
}

/// With every instruction set that this processor has, by responses as far as they go, and by a factor alone.
void expect_dense_breaks(const Network& network, const Thresholds& threshold,
                         BreakOn break_on = BreakOn::magnitude, TreeOptions tree = {}) {
  const SampleRecord dense =
      test::break_record(network, {.strategy = "dense", .common = {.break_on = break_on}}, threshold);
  for (const TreeKernels* kernels : tree_kernels()) {
    SCOPED_TRACE(kernels->name);
    tree.kernels = kernels;
    for (const bool responses : {true, false}) {
      SCOPED_TRACE(responses ? "responses" : "factor");
      tree.responses = responses;
      expect_same_breaks(tree_record(network, break_on, tree, threshold), dense);
    }
  }
}

TEST(EquilibriumTree, BreaksTheBondsThatDenseBreaks) {
  for (const int size : {1, 2, 3, 6, 9}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      for (const BreakOn break_on : {BreakOn::magnitude, BreakOn::tension}) {
        for (const std::int64_t sample : {0, 1, 2}) {
          SCOPED_TRACE(named.name + " " + std::to_string(size) + " sample " + std::to_string(sample));
          expect_dense_breaks(named.network, test::uniform_thresholds(named.network, sample), break_on);
        }
      }
    }
  }
}

TEST(EquilibriumTree, BreaksThemOnAnyDissection) {
  for (const test::NamedNetwork& named : test::triangular_networks(8)) {
    SCOPED_TRACE(named.name);
    expect_dense_breaks(named.network, test::uniform_thresholds(named.network, 4), BreakOn::magnitude,
                        {.dissection = Dissection::metis});
  }
}

TEST(EquilibriumTree, BreaksTheLowestBondOfATie) {
  for (const int size : {1, 2, 3, 6, 8}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      SCOPED_TRACE(named.name + " " + std::to_string(size));
      expect_dense_breaks(named.network, Thresholds(named.network.bonds(), 0.7));
    }
  }
  const Network network = test::bundle(7);
  const SampleRecord record = tree_record(network, BreakOn::magnitude, {}, Thresholds(7, 2.0));
  EXPECT_EQ(record.bond, (std::vector<BondId>{0, 1, 2, 3, 4, 5, 6}));
  for (int i = 0; i < 7; ++i) EXPECT_NEAR(record.load[i], 2.0 * (7 - i), 1e-13);
}

/// Uniform samples of which every threshold t has become change(t).
template <class Change>
void expect_dense_breaks_with(Change change) {
  for (const int size : {2, 6}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      for (const std::int64_t sample : {0, 1, 2}) {
        SCOPED_TRACE(named.name + " " + std::to_string(size) + " sample " + std::to_string(sample));
        Thresholds threshold = test::uniform_thresholds(named.network, sample);
        for (double& t : threshold) t = change(t);
        expect_dense_breaks(named.network, threshold);
      }
    }
  }
}

TEST(EquilibriumTree, BreaksBondsOfNoStrengthFirst) {
  expect_dense_breaks_with([](double t) { return t < 0.2 ? 0 : t; });
  const Network network = test::triangular_networks(4)[0].network;
  expect_dense_breaks(network, Thresholds(network.bonds(), 0.0));
}

TEST(EquilibriumTree, FollowsThresholdsOverThirtyDecades) {
  expect_dense_breaks_with([](double t) { return std::pow(10, -30 * t); });
  expect_dense_breaks_with([](double t) { return std::pow(10, 15 - 30 * t); });
}

/// Balanced bridges side by side: their middle fuses carry rounding, which over a minute threshold is the largest
/// ratio by far. What is predicted from that must not keep a pass from looking at every bond.
TEST(EquilibriumTree, IsNotMisledByRoundingOverMinuteThresholds) {
  constexpr NodeId kBridges = 40;
  constexpr NodeId kTop = 1 + 2 * kBridges;
  test::Bonds bonds;
  std::vector<double> stiffness;
  Thresholds threshold;
  for (NodeId i = 0; i < kBridges; ++i) {
    const NodeId left = 1 + 2 * i;
    bonds.insert(bonds.end(), {{0, left}, {0, left + 1}, {left, left + 1}, {left, kTop}, {left + 1, kTop}});
    const double a = 0.1 + 0.07 * i;
    stiffness.insert(stiffness.end(), {a, 0.3 * a, 0.7, 1.1 * a, 0.33 * a});
    for (const double t : {1.0, 1.3, 1e-30, 1.1, 1.7}) threshold.push_back(t * (1 + 0.013 * i));
  }
  const Network network = test::fuses_between(kTop + 1, bonds, stiffness);
  expect_dense_breaks(network, threshold);
  PhaseTimes times;
  const auto equilibrium = make_equilibrium_tree(network, {}, times, {.verify = true, .responses = false});
  test::break_record(*equilibrium, threshold);
  const TreeCounts counts = tree_counts(*equilibrium);
  EXPECT_GT(counts.batch.repeated, 0) << "no rounding was taken for a force";
  EXPECT_GT(counts.checked, 2 * kBridges);
  EXPECT_EQ(counts.differences, 0);
}

TEST(EquilibriumTree, NeverBreaksABondOfInfiniteStrength) {
  expect_dense_breaks_with([](double t) { return t < 0.3 ? kNever : t; });
  for (const test::NamedNetwork& named : test::triangular_networks(4)) {
    PhaseTimes times;
    const auto equilibrium = make_equilibrium_tree(named.network, {}, times);
    equilibrium->reset(Thresholds(named.network.bonds(), kNever));
    Critical next;
    EXPECT_EQ(equilibrium->find_critical(next), State::held) << named.name;
    Thresholds threshold(named.network.bonds(), kNever);
    threshold[1] = 0.5;
    EXPECT_EQ(test::break_record(*equilibrium, threshold).bond, std::vector<BondId>{1}) << named.name;
  }
}

/// Fuses between random points, one of ten with no stiffness, an island of two nodes, and lone ones.
Network irregular_fuses() {
  const auto place = test::mixed_values(160);
  std::vector<Vector2> position;
  std::vector<Grip> grip;
  test::Bonds bonds;
  for (NodeId i = 0; i < 80; ++i) {
    position.push_back({9 * place[2 * i], 9 * place[2 * i + 1]});
    grip.push_back(position[i].y < -3 ? Grip::bottom : position[i].y > 3 ? Grip::top : Grip::free);
    for (NodeId j = 0; j < i; ++j) {
      if (std::hypot(position[i].x - position[j].x, position[i].y - position[j].y) < 1.7)
        bonds.push_back({i, j});
    }
  }
  for (NodeId node = 80; node < 120; ++node) {
    position.push_back({10, 0.1 * node});
    grip.push_back(Grip::free);
  }
  bonds.push_back({80, 81});
  std::vector<double> stiffness(bonds.size(), 1.0);
  for (std::size_t e = 3; e < stiffness.size(); e += 10) stiffness[e] = 0;
  return make_network(make_lattice(0, position, grip, bonds), Model::fuse, Grips::sliding, stiffness);
}

TEST(EquilibriumTree, BreaksIrregularAndDisconnectedNetworks) {
  const Network network = irregular_fuses();
  for (const std::int64_t sample : {0, 1, 2, 3}) {
    for (const Dissection how : {Dissection::coordinates, Dissection::metis}) {
      expect_dense_breaks(network, test::uniform_thresholds(network, sample), BreakOn::magnitude,
                          {.dissection = how});
    }
  }
  PhaseTimes times;
  const auto equilibrium = make_equilibrium_tree(network, {}, times);
  equilibrium->reset(test::uniform_thresholds(network, 0));
  EXPECT_GE(equilibrium->counts().null_pivots, 1) << "the island";
  const Network loose = test::inclined_chain(Grips::sliding);
  const auto none = make_equilibrium_tree(loose, {}, times);
  Critical next;
  none->reset(Thresholds{0.3, 0.2});
  EXPECT_EQ(none->find_critical(next), State::failed);
}

/// Compares to the last bit.
auto bits(const SampleRecord& record) {
  return std::tuple(record.bond, record.load, record.stiffness);
}

TEST(EquilibriumTree, ForgetsEarlierSamples) {
  for (const bool many : {true, false}) {
    for (const test::NamedNetwork& named : test::triangular_networks(7)) {
      SCOPED_TRACE(named.name);
      PhaseTimes times;
      const auto equilibrium = make_equilibrium_tree(named.network, {.many_samples = many}, times);
      const Thresholds threshold = test::uniform_thresholds(named.network, 0);
      const auto first = bits(test::break_record(*equilibrium, threshold));
      EXPECT_EQ(bits(test::break_record(*equilibrium, threshold)), first);
      const Thresholds other = test::uniform_thresholds(named.network, 1);
      (void)test::break_record(*equilibrium, other, {.kind = StopRule::Kind::breaks, .value = 5});
      EXPECT_EQ(bits(test::break_record(*equilibrium, threshold)), first) << "after half of another";
      EXPECT_EQ(bits(test::break_record(*equilibrium, other)),
                bits(tree_record(named.network, BreakOn::magnitude, {}, other)));
    }
  }
}

TEST(EquilibriumTree, ChecksEveryBreakWhenItVerifies) {
  for (const test::NamedNetwork& named : test::triangular_networks(8)) {
    SCOPED_TRACE(named.name);
    PhaseTimes times;
    const auto equilibrium = make_equilibrium_tree(named.network, {}, times, {.verify = true});
    std::int64_t breaks = 0;
    for (const std::int64_t sample : {0, 1}) {
      breaks +=
          std::ssize(test::break_record(*equilibrium, test::uniform_thresholds(named.network, sample)).bond);
    }
    EXPECT_EQ(tree_counts(*equilibrium).checked, breaks + 2) << "and the end of either sample";
    EXPECT_EQ(tree_counts(*equilibrium).differences, 0);
  }
}

/// Both strategies name the same bond, and every force is the same.
void expect_same_state(Equilibrium& tree, Equilibrium& dense, const Critical& next,
                       const Critical& expected) {
  const Network& network = tree.network();
  ASSERT_EQ(next.bond, expected.bond);
  EXPECT_NEAR(next.load / expected.load, 1, 1e-9);
  EXPECT_NEAR(next.stiffness / expected.stiffness, 1, 1e-9);
  std::vector<double> r(network.unknowns);
  const auto u = tree.displacements();
  const auto v = dense.displacements();
  EXPECT_LT(backward_error(network, tree.broken(), u, r), 1e-13);
  for (const Dof slot : network.idle) EXPECT_EQ(u[slot], 0);
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (tree.broken()[e] != 0) continue;
    EXPECT_NEAR(elongation(network, e, u) / v.back(), elongation(network, e, v) / v.back(), 1e-9) << e;
  }
}

/// Breaks a sample with both strategies: first `at_once`, unasked, then in step s what removals(tree, bond,
/// s) gives for the bond that is named.
template <class Removals>
void expect_lockstep(const Network& network, const std::vector<BondId>& at_once, Removals removals) {
  PhaseTimes times;
  const auto tree = make_equilibrium_tree(network, {}, times);
  const auto dense = make_equilibrium(network, {.strategy = "dense"}, times);
  const auto remove = [&](const std::vector<BondId>& bonds) {
    for (const BondId e : bonds) {
      tree->remove(e);
      dense->remove(e);
    }
  };
  tree->reset(test::uniform_thresholds(network, 3));
  dense->reset(test::uniform_thresholds(network, 3));
  remove(at_once);
  Critical next;
  Critical expected;
  for (int step = 0; dense->find_critical(expected) == State::carrying; ++step) {
    SCOPED_TRACE(step);
    ASSERT_EQ(tree->find_critical(next), State::carrying);
    ASSERT_EQ(tree->find_critical(next), State::carrying) << "asked twice";
    expect_same_state(*tree, *dense, next, expected);
    if (::testing::Test::HasFailure()) return;
    remove(removals(*tree, next.bond, step));
  }
  EXPECT_EQ(tree->find_critical(next), State::failed);
  EXPECT_EQ(tree->find_critical(next), State::failed) << "and stays so";
}

TEST(EquilibriumTree, HasTheDisplacementsOfAFullSolveAtEveryBreak) {
  for (const test::NamedNetwork& named : test::triangular_networks(6)) {
    SCOPED_TRACE(named.name);
    expect_lockstep(named.network, {}, [](const Equilibrium&, BondId e, int) { return std::vector{e}; });
  }
}

/// The unbroken bond that follows `e` in number and can stretch; `e` itself when there is none.
BondId another(const Equilibrium& equilibrium, BondId e) {
  const Network& network = equilibrium.network();
  BondId other = e;
  do {
    other = (other + 1) % network.bonds();
  } while (other != e && (equilibrium.broken()[other] != 0 || !network.can_stretch(other)));
  return other;
}

TEST(EquilibriumTree, FollowsRemovalsThatItDidNotName) {
  for (const test::NamedNetwork& named : test::triangular_networks(7)) {
    SCOPED_TRACE(named.name);
    expect_lockstep(named.network, {8}, [](const Equilibrium& tree, BondId e, int step) {
      const BondId other = another(tree, e);
      if (step % 2 == 0 || other == e) return std::vector{e};
      return step % 4 == 1 ? std::vector{other} : std::vector{e, other};
    });
  }
}

TEST(EquilibriumTree, CountsWhatItDoes) {
  const Network network = test::triangular_networks(24)[0].network;
  PhaseTimes times;
  const auto equilibrium = make_equilibrium_tree(network, {}, times);
  const SampleRecord first = test::break_record(*equilibrium, test::uniform_thresholds(network, 0));
  const SampleRecord second = test::break_record(*equilibrium, test::uniform_thresholds(network, 1));
  const auto tree = make_separator_tree(network, Dissection::automatic);
  const EquilibriumCounts counts = equilibrium->counts();
  const TreeCounts more = tree_counts(*equilibrium);
  EXPECT_EQ(counts.breaks, std::ssize(first.bond) + std::ssize(second.bond));
  EXPECT_EQ(counts.unknowns, network.unknowns);
  EXPECT_EQ(counts.factor_entries, tree.factor_entries);
  EXPECT_EQ(counts.factorizations, 1 + counts.refactors) << "the intact network once for all samples";
  EXPECT_TRUE(counts.smallest_slack > 0 && counts.smallest_slack < 1);
  EXPECT_LT(counts.largest_residual, 1e-12);
  EXPECT_EQ(more.fronts, tree.fronts());
  EXPECT_EQ(more.refactors, counts.refactors);
  EXPECT_EQ(more.batch.verified, counts.breaks) << "every verified break is handed out";
  EXPECT_GT(more.batch.verified, 2 * more.batch.passes);
  EXPECT_LT(more.downdates, counts.breaks / 8);
  EXPECT_STREQ(more.kernels, tree_kernels().front()->name);
  EXPECT_NE(describe(more).find(std::to_string(tree.fronts()) + " fronts"), std::string::npos);
  const Network two = test::bundle(2);
  const auto dense = make_equilibrium(two, {.strategy = "dense"}, times);
  EXPECT_THROW((void)tree_counts(*dense), std::bad_cast);
}

}  // namespace
}  // namespace crackle
