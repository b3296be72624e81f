#include <gtest/gtest.h>

#include <set>

#include "crackle/equilibrium/strategies/strategies.hpp"
#include "support/break_record.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

TEST(Strategies, EveryRowBreaksTheSameBonds) {
  for (const test::NamedNetwork& named : test::triangular_networks(6)) {
    const std::vector<double> threshold = test::uniform_thresholds(named.network, 0);
    std::vector<BondId> expected;
    for (const StrategyKind& kind : strategy_kinds()) {
      PhaseTimes times;
      const auto equilibrium = kind.make(named.network, {}, times);
      const SampleRecord record = test::break_record(*equilibrium, threshold);
      if (expected.empty()) expected = record.bond;
      EXPECT_GT(record.bond.size(), 10U) << kind.name << ", " << named.name;
      EXPECT_EQ(record.bond, expected) << kind.name << ", " << named.name;
    }
  }
}

TEST(Strategies, RowsHaveNamesOfTheirOwnAndAMeaningOfOneLine) {
  std::set<std::string> names;
  for (const StrategyKind& kind : strategy_kinds()) {
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
    EXPECT_EQ(&find_strategy(kind.name), &kind);
    EXPECT_FALSE(std::string(kind.meaning).empty()) << kind.name;
    EXPECT_EQ(std::string(kind.meaning).find('\n'), std::string::npos) << kind.name;
  }
  EXPECT_STREQ(strategy_kinds().front().name, ChosenStrategy{}.strategy.c_str()) << "the default";
}

TEST(Strategies, WhatARowDescribesIsOfTheStrategyThatItMakes) {
  const Network network = test::triangular_networks(4).front().network;
  for (const StrategyKind& kind : strategy_kinds()) {
    if (kind.describe == nullptr) continue;
    PhaseTimes times;
    const auto equilibrium = kind.make(network, {}, times);
    (void)test::break_record(*equilibrium, test::uniform_thresholds(network, 0));
    const std::string text = kind.describe(*equilibrium);
    EXPECT_TRUE(text.starts_with(kind.name)) << text;
    EXPECT_TRUE(text.ends_with('\n')) << text;
  }
}

TEST(Strategies, RefuseANameThatNoneHas) {
  const Network network = test::bundle(1);
  PhaseTimes times;
  const auto make = [&] { (void)make_equilibrium(network, {.strategy = "guess"}, times); };
  test::expect_refused(make, {"-equilibrium", "guess", "tree, ksp, dense or quad"});
  EXPECT_EQ(equilibrium_names(), "tree, ksp, dense or quad");
}

}  // namespace
}  // namespace crackle
