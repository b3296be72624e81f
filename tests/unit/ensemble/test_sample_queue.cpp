#include <gtest/gtest.h>

#include "crackle/ensemble/sample_queue.hpp"

namespace crackle {
namespace {

/// Every sample of the chunks that are left, run by run in the order of hand-out.
std::vector<std::pair<int, std::int64_t>> drain(SampleQueue& queue) {
  std::vector<std::pair<int, std::int64_t>> samples;
  while (const auto chunk = queue.take()) {
    EXPECT_GT(chunk->count, 0);
    for (std::int64_t i = 0; i < chunk->count; ++i) samples.emplace_back(chunk->run, chunk->first + i);
  }
  return samples;
}

TEST(SampleQueue, HandsOutEverySampleOnceButThoseFinished) {
  SampleQueue queue(3);
  queue.append(1, 10, 15, {9, 11, 12, 15});
  queue.append(0, 0, 3, {0, 2});
  queue.append(2, 5, 7, {5, 6});
  EXPECT_EQ(queue.left(1), 3);
  EXPECT_EQ(queue.left(2), 0);
  EXPECT_EQ(drain(queue), (std::vector<std::pair<int, std::int64_t>>{{1, 10}, {1, 13}, {1, 14}, {0, 1}}));
  EXPECT_EQ(queue.left(1), 0);
  EXPECT_FALSE(queue.take());
}

TEST(SampleQueue, ChunksTakeATenthOfASecondAndShrinkAtTheEnd) {
  SampleQueue queue(4);
  queue.append(0, 0, 100'000, {});
  EXPECT_EQ(queue.take()->count, 1) << "nothing is known yet";
  queue.note(0, 10, 0.01);
  EXPECT_NEAR(queue.seconds_per_sample(0), 1e-3, 1e-18);
  EXPECT_EQ(queue.take()->count, 100);
  std::int64_t last = 100;
  std::int64_t ones = 0;
  while (const auto chunk = queue.take()) {
    EXPECT_LE(chunk->count, last);
    EXPECT_LE(chunk->count, std::max<std::int64_t>(1, (queue.left(0) + chunk->count) / 8)) << "a fair share";
    last = chunk->count;
    if (last == 1) ++ones;
  }
  EXPECT_GE(ones, 8);
  EXPECT_LE(ones, 16);
}

TEST(SampleQueue, LongSamplesComeOneByOne) {
  SampleQueue queue(2);
  queue.append(0, 0, 50, {});
  queue.note(0, 1, 60);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(queue.take()->count, 1);
  EXPECT_FALSE(queue.take());
}

}  // namespace
}  // namespace crackle
