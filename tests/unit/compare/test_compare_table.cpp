#include <gtest/gtest.h>

#include <limits>
#include <sstream>

#include "crackle/compare/compare_table.hpp"

namespace crackle {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

ReferenceRun reference_run() {
  ReferenceRun run;
  run.name = "by hand";
  run.error = {1e-15, 3e-15};
  run.failed = true;
  run.peak_load = 4;
  run.n_p = 30;
  run.n_f = 50;
  return run;
}

/// 50 breaks, in three repetitions.
StrategyRun strategy_run() {
  StrategyRun run;
  run.choice.name = "some";
  run.total = {0.2, 0.1, 0.6};
  run.residual = {kUnknown, 1e-9, 2e-8};
  run.force_error = {3e-7, 1e-7};
  run.load_error = {0, 4e-6};
  run.peak_load = 4.2;
  run.n_p = 31;
  run.n_f = 50;
  run.memory = 3 << 20;
  run.counts.iterations = 125;
  return run;
}

/// The words of a strategy's row.
std::vector<std::string> row_of(const StrategyRun& run, const ReferenceRun& reference) {
  std::istringstream lines(format_comparison(reference, std::vector{run}, {}));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(run.choice.name + " ")) continue;
    std::istringstream words(line);
    return {std::istream_iterator<std::string>(words), {}};
  }
  return {};
}

using Words = std::vector<std::string>;

TEST(CompareTable, ARowHasTheMedianTimeAndTheLargestErrors) {
  EXPECT_EQ(row_of(strategy_run(), reference_run()),
            (Words{"some", "4.000", "+-", "5", "2.5", "2.0e-08", "3.0e-07", "4.0e-06", "none", "5.0e-02",
                   "31", "50", "3.0"}));
}

/// Times and iterations are those of the breaks that were compared.
TEST(CompareTable, SkippedBreaksAreNotDividedBy) {
  ReferenceRun reference = reference_run();
  reference.skip = 40;
  const Words row = row_of(strategy_run(), reference);
  ASSERT_EQ(row.size(), 13u);
  EXPECT_EQ(row[1], "20.000");
  EXPECT_EQ(row[4], "12.5");
  EXPECT_NE(format_comparison(reference, {}, {}).find("first 40 breaks are those of tree"),
            std::string::npos);
}

TEST(CompareTable, WhatWasNotMeasuredIsNotMadeUp) {
  StrategyRun run = strategy_run();
  run.total = {kUnknown, kUnknown};
  run.force_error = {kUnknown};
  run.load_error = {};
  run.first_difference = 17;
  EXPECT_EQ(row_of(run, reference_run()),
            (Words{"some", "-", "2.5", "2.0e-08", "nan", "nan", "17", "5.0e-02", "31", "50", "3.0"}));
  run.total = {kUnknown, 0.05, kUnknown};
  EXPECT_EQ(row_of(run, reference_run())[1], "1.000") << "one repetition that came to its end is enough";
  run.n_f = 0;
  EXPECT_EQ(row_of(run, reference_run()).at(1), "50.000") << "no division by nothing";
}

TEST(CompareTable, EveryStrategyIsHeard) {
  StrategyRun quiet = strategy_run();
  StrategyRun loose = strategy_run();
  loose.choice.name = "loose 1e-2";
  loose.counts.doubtful = 9;
  loose.counts.first_doubtful = 4;
  loose.counts.loosest_residual = 0.02;
  StrategyRun ended = strategy_run();
  ended.choice.name = "ended";
  ended.counts.refactors = 3;
  ended.complaint = "after break 12: " + std::string(2000, 'x') + "!";
  const std::string text = format_comparison(reference_run(), std::vector{quiet, loose, ended}, {});
  for (const std::string part :
       {"loose 1e-2: residuals up to 0.02 leave open which bond breaks at 9 breaks, from break 4 on\n",
        "ended: a check asked for 3 new factors\n", "ended: ended after break 12: ", "x!\n"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(text.find("some: "), std::string::npos);
}

TEST(CompareTable, TheHeadSaysWhatTheReferenceDid) {
  ReferenceRun reference = reference_run();
  const std::string text = format_comparison(reference, {}, {.every = 7, .repetitions = 2});
  for (const std::string part :
       {"reference: by hand\n", "50 breaks (failure)", "peak load 4 at n_p 30", "3.0e-15",
        "along the reference's breaks", "7-th break", "median of 2 runs"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  }
  reference.failed = false;
  const std::string own = format_comparison(reference, {}, {.along = Along::own});
  EXPECT_NE(own.find("50 breaks (-stop)"), std::string::npos);
  EXPECT_NE(own.find("breaks its own bonds"), std::string::npos);
}

/// A file's name may have 255 bytes, a tolerance any number of digits.
TEST(CompareTable, LongNamesCutNoRow) {
  StrategyRun run = strategy_run();
  run.choice.name = std::string(250, 'n') + "_1e-" + std::string(400, '0') + "2";
  const Words row = row_of(run, reference_run());
  ASSERT_EQ(row.size(), 13u);
  EXPECT_EQ(row.back(), "3.0");
}

}  // namespace
}  // namespace crackle
