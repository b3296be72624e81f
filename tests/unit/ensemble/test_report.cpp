#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "crackle/ensemble/report.hpp"

namespace crackle {
namespace {

TEST(Report, EstimatesMeanAndStandardError) {
  const Estimate four = estimate(std::vector{1.0, 2.0, 3.0, 4.0});
  EXPECT_EQ(four.mean, 2.5);
  EXPECT_NEAR(four.error, std::sqrt(5.0 / 3 / 4), 1e-16);
  const Estimate equal = estimate(std::vector{0.25, 0.25, 0.25});
  EXPECT_EQ(equal.mean, 0.25);
  EXPECT_EQ(equal.error, 0);
  const Estimate large = estimate(std::vector{1e9 + 1, 1e9 + 3});
  EXPECT_EQ(large.mean, 1e9 + 2);
  EXPECT_NEAR(large.error, 1, 1e-12) << "no cancellation of squares";
  const Estimate one = estimate(std::vector{7.0});
  EXPECT_EQ(one.mean, 7);
  EXPECT_EQ(one.error, 0);
  const Estimate none = estimate({});
  EXPECT_EQ(none.mean, 0);
  EXPECT_EQ(none.error, 0);
}

std::string printed(const std::vector<SampleSummary>& samples, const EquilibriumCounts& counts) {
  testing::internal::CaptureStdout();
  print_report(samples, counts, {}, 2.0, "folder/run.h5");
  std::fflush(stdout);
  return testing::internal::GetCapturedStdout();
}

TEST(Report, PrintsMeansAndWhatOneBreakTook) {
  {
    const std::vector<SampleSummary> samples{{.index = 0, .peak_load = 1.5, .n_p = 2, .n_f = 4},
                                             {.index = 1, .peak_load = 2.5, .n_p = 4, .n_f = 6}};
    const std::string text = printed(samples, {.breaks = 10, .factorizations = 3});
    for (const char* part : {"2 samples", "2 +- 0.5", "3 +- 1", "5 +- 1", "10 breaks", "200 ms a break",
                             "3 factorizations", "folder/run.h5"}) {
      EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
    }
  }
  {
    const std::string text = printed({}, {});
    EXPECT_EQ(text.find("nan"), std::string::npos) << text;
    EXPECT_EQ(text.find("inf"), std::string::npos) << text;
    EXPECT_NE(text.find("0 samples"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace crackle
