#include <gtest/gtest.h>

#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/fracture/fracture.hpp"
#include "support/break_record.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

using Bonds = std::vector<BondId>;

void expect_near(const std::vector<double>& values, const std::vector<double>& expected) {
  ASSERT_EQ(values.size(), expected.size());
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], expected[i], 1e-14) << i;
}

TEST(Fracture, BundlesAndChainsBreakAsTheyMust) {
  // The weakest of n fuses side by side breaks at n times its threshold.
  {
    for (const char* strategy : {"ksp", "dense"}) {
      SCOPED_TRACE(strategy);
      const SampleRecord record =
          test::break_record(test::bundle(5), {.strategy = strategy}, std::vector{0.9, 0.25, 0.6, 0.1, 0.5});
      EXPECT_EQ(record.bond, (Bonds{3, 1, 4, 2, 0}));
      expect_near(record.load, {0.5, 1.0, 1.5, 1.2, 0.9});
      expect_near(record.stiffness, {5, 4, 3, 2, 1});
      EXPECT_EQ(record.summary.n_p, 3);
      EXPECT_EQ(record.summary.n_f, 5);
      EXPECT_NEAR(record.summary.peak_load, 1.5, 1e-14);
      EXPECT_NEAR(record.summary.peak_displacement, 0.5, 1e-14);
      EXPECT_NEAR(record.summary.initial_stiffness, 5, 1e-14);
    }
  }
  {
    for (const char* strategy : {"ksp", "dense"}) {
      SCOPED_TRACE(strategy);
      const SampleRecord record =
          test::break_record(test::chain(4), {.strategy = strategy}, std::vector{0.9, 0.7, 0.3, 0.8});
      EXPECT_EQ(record.bond, Bonds{2});
      expect_near(record.load, {0.3});
      expect_near(record.stiffness, {0.25});
      EXPECT_EQ(record.summary.n_p, 1);
      EXPECT_EQ(record.summary.n_f, 1);
      EXPECT_NEAR(record.summary.peak_displacement, 1.2, 1e-14);
    }
  }
}

/// Two fuses side by side (0, 1) under three (2, 3, 4): each bundle breaks at its fuses times the least
/// threshold among them.
TEST(Fracture, BundlesInSeriesBreakInTurn) {
  const Network network = test::fuses_between(3, {{0, 1}, {0, 1}, {1, 2}, {1, 2}, {1, 2}});
  for (const char* strategy : {"ksp", "dense"}) {
    SCOPED_TRACE(strategy);
    const SampleRecord record =
        test::break_record(network, {.strategy = strategy}, std::vector{0.3, 0.9, 0.25, 0.43, 0.7});
    EXPECT_EQ(record.bond, (Bonds{0, 2, 3, 4}));
    expect_near(record.load, {0.6, 0.75, 0.86, 0.7});
    expect_near(record.stiffness, {6.0 / 5, 3.0 / 4, 2.0 / 3, 1.0 / 2});
    EXPECT_EQ(record.summary.n_p, 3);
    EXPECT_EQ(record.summary.n_f, 4);
    EXPECT_NEAR(record.summary.peak_load, 0.86, 1e-14);
    EXPECT_NEAR(record.summary.peak_displacement, 1.29, 1e-14);
  }
}

/// Both fuses of stiffnesses 15 and 1 break at load 16, to the last bit.
TEST(Fracture, OfTwoEqualPeaksTheFirstCounts) {
  const Network network = test::bundle(2, {15, 1});
  const SampleRecord record = test::break_record(network, {.strategy = "dense"}, std::vector{15.0, 16.0});
  ASSERT_EQ(record.load, (std::vector{16.0, 16.0}));
  EXPECT_EQ(record.summary.n_p, 1);
  EXPECT_EQ(record.summary.n_f, 2);
}

SampleSummary bundle_until(const StopRule& stop) {
  return test::break_record(test::bundle(5), {}, std::vector{0.9, 0.25, 0.6, 0.1, 0.5}, stop).summary;
}

TEST(Fracture, StopsWhereItIsTold) {
  {
    for (const int breaks : {1, 2, 4, 5, 9}) {
      const SampleSummary summary = bundle_until({StopRule::Kind::breaks, static_cast<double>(breaks)});
      EXPECT_EQ(summary.n_f, std::min(breaks, 5));
      EXPECT_EQ(summary.n_p, std::min(breaks, 3));
    }
    const SampleSummary none = bundle_until({StopRule::Kind::breaks, 0});
    EXPECT_EQ(none.n_f, 0);
    EXPECT_EQ(none.n_p, 0);
    EXPECT_EQ(none.peak_load, 0);
    EXPECT_NEAR(none.initial_stiffness, 5, 1e-14) << "known without a break";
  }
  // F falls from 5 to 1 in fifths.
  {
    for (const int broken : {0, 1, 2, 3, 4}) {
      EXPECT_EQ(bundle_until({StopRule::Kind::stiffness, (4.5 - broken) / 5}).n_f, broken + 1);
    }
    EXPECT_EQ(bundle_until({StopRule::Kind::stiffness, 0}).n_f, 5) << "failure comes first";
  }
  // Each fuse breaks when the plate has moved by its threshold.
  {
    EXPECT_EQ(bundle_until({StopRule::Kind::displacement, 0.05}).n_f, 0);
    EXPECT_EQ(bundle_until({StopRule::Kind::displacement, 0.55}).n_f, 3);
    EXPECT_EQ(bundle_until({StopRule::Kind::displacement, 2}).n_f, 5);
  }
}

/// Writes down the order in which it is called.
class Diary final : public Observer {
 public:
  void sample_begins(std::int64_t index) override { text += "begin " + std::to_string(index); }
  void bond_breaks(std::int32_t number, const Critical& critical, Equilibrium& equilibrium) override {
    text += ", " + std::to_string(number) + ":" + std::to_string(critical.bond);
    EXPECT_EQ(equilibrium.broken()[critical.bond], 0) << "still there when it is told";
    EXPECT_NEAR(equilibrium.displacements().back(), 1 / critical.stiffness, 1e-14);
  }
  void sample_ends(const SampleSummary& summary) override { text += ", end " + std::to_string(summary.n_f); }
  std::string text;
};

TEST(Fracture, TellsObserversInOrderAndNamesASampleThatCarriesNothing) {
  {
    const Network network = test::bundle(3);
    PhaseTimes times;
    const auto equilibrium = make_equilibrium(network, {}, times);
    Diary diary;
    const std::vector<Observer*> observers{&diary};
    (void)break_sample(*equilibrium, 42, std::vector{0.9, 0.25, 0.6}, {}, observers);
    EXPECT_EQ(diary.text, "begin 42, 1:1, 2:2, 3:0, end 3");
  }
  {
    const Network network = test::inclined_chain(Grips::sliding);
    PhaseTimes times;
    for (const char* strategy : {"ksp", "dense"}) {
      const auto equilibrium = make_equilibrium(network, {.strategy = strategy}, times);
      Diary diary;
      const std::vector<Observer*> observers{&diary};
      test::expect_refused<SolverError>(
          [&] {
            (void)break_sample(*equilibrium, 42, std::vector{0.9, 0.2}, {}, observers);
          },
          {"sample 42", "after break 0", "no bond of the intact network carries load"});
      EXPECT_EQ(diary.text, "begin 42");
    }
  }
}

}  // namespace
}  // namespace crackle
