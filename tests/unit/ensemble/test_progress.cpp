#include <gtest/gtest.h>

#include <cmath>

#include "crackle/base/running_mean.hpp"
#include "crackle/ensemble/progress.hpp"

namespace crackle {
namespace {

RunningMean of(std::initializer_list<double> values) {
  RunningMean mean;
  for (const double value : values) mean.add(value);
  return mean;
}

TEST(RunningMean, PartsGiveWhatTheWholeGives) {
  const RunningMean whole = of({1e9 + 1, 1e9 + 2, 1e9 + 4, 1e9 + 9});
  EXPECT_EQ(whole.count(), 4);
  EXPECT_EQ(whole.mean(), 1e9 + 4);
  EXPECT_NEAR(whole.error(), std::sqrt(38.0 / 3 / 4), 1e-7);
  RunningMean joined = of({1e9 + 1});
  joined.add(RunningMean{});
  joined.add(of({1e9 + 2, 1e9 + 4, 1e9 + 9}));
  EXPECT_EQ(joined.count(), 4);
  EXPECT_NEAR(joined.mean(), whole.mean(), 1e-6);
  EXPECT_NEAR(joined.error(), whole.error(), 1e-6);
  EXPECT_EQ(RunningMean{}.error(), 0);
  EXPECT_EQ(of({3}).error(), 0);
}

TEST(Progress, TellsRateTimeLeftAndTheMeanWithItsError) {
  Progress progress({{.name = "", .total = 100}}, 2, true);
  EXPECT_EQ(progress.line(), "0 of 100 samples");
  progress.add(0, of({1, 2, 3}), 0.5);
  progress.add(0, of({2, 2}), 0.5);
  EXPECT_EQ(progress.line(), "5 of 100 samples, 4 a second, 24s left, mean peak load 2.0000 +- 0.3162");
}

/// A sample of the second part has a hundredth of the first one's work, until its own time is known.
TEST(Progress, OfSeveralSizesEstimatesThoseToCome) {
  Progress progress({{"L = 32", 10, 100.0}, {"L = 8", 1000, 1.0}}, 1, true);
  progress.add(0, of({4}), 10);
  EXPECT_EQ(progress.line(),
            "L = 32: 1 of 10 samples (1 of 1010 in all), 0.1 a second, 3m10s left, mean peak load 4.0000 +- "
            "0.0000");
  progress.add(1, of({1, 1}), 1);
  EXPECT_EQ(progress.line(),
            "L = 8: 2 of 1000 samples (3 of 1010 in all), 1 a second, 18m08s left, mean peak load 1.0000 +- "
            "0.0000");
}

}  // namespace
}  // namespace crackle
