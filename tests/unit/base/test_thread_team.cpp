#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <stdexcept>

#include "crackle/base/thread_team.hpp"

namespace crackle {
namespace {

TEST(ThreadTeam, TakesEveryTurnOnce) {
  for (const int threads : {1, 2, 3, 4, 7}) {
    ThreadTeam team(threads);
    EXPECT_EQ(team.threads(), threads);
    for (const int count : {0, 1, 2, 5, 100, 3000}) {
      std::vector<int> taken(count, 0);  // no two turns share an entry
      team.for_each(count, [&](int turn, int member) {
        ASSERT_TRUE(member >= 0 && member < threads);
        ++taken[turn];
      });
      EXPECT_EQ(taken, std::vector<int>(count, 1)) << threads << " threads";
    }
  }
}

/// Loop after loop, with and without sleep between: what one wrote the next one reads.
TEST(ThreadTeam, EndsALoopBeforeItReturns) {
  ThreadTeam team(4);
  std::vector<std::int64_t> sum(50, 0);
  constexpr int kLoops = 2000;
  for (int loop = 0; loop < kLoops; ++loop) {
    if (loop % 500 == 499) std::this_thread::sleep_for(4 * ThreadTeam::kPatience);
    const int count = 2 + loop % 49;
    team.for_each(count, [&](int turn, int) { sum[turn] += loop; });
    if (loop > 0) sum[49] += sum[0];
  }
  std::int64_t total = 0;
  std::int64_t expected = 0;
  for (int loop = 1; loop < kLoops; ++loop) expected += total += loop;
  EXPECT_EQ(sum[0], total);
  EXPECT_GE(sum[49], expected);
}

/// Members meet: with one of them the loop would never end.
TEST(ThreadTeam, WorksAtTheSameTime) {
  constexpr int kThreads = 3;
  ThreadTeam team(kThreads);
  std::atomic<int> here = 0;
  std::vector<int> member(kThreads, -1);
  team.for_each(kThreads, [&](int turn, int who) {
    member[turn] = who;
    ++here;
    while (here < kThreads) std::this_thread::yield();
  });
  std::ranges::sort(member);
  EXPECT_EQ(member, (std::vector{0, 1, 2}));
}

TEST(ThreadTeam, HandsOnTheExceptionOfTheLowestTurn) {
  for (const int threads : {1, 2, 5}) {
    ThreadTeam team(threads);
    for (int time = 0; time < 20; ++time) {
      try {
        team.for_each(40, [](int turn, int) {
          if (turn % 10 == 7) throw std::runtime_error("turn " + std::to_string(turn));
        });
        FAIL() << "nothing was thrown";
      } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "turn 7");
      }
      int turns = 0;
      team.for_each(1, [&](int, int) { ++turns; });
      std::atomic<int> more = 0;
      team.for_each(9, [&](int, int) { ++more; });
      EXPECT_EQ(turns + more, 10) << "the team goes on";
    }
  }
}

/// A team that waits uses no processor: helpers sleep.
TEST(ThreadTeam, SleepsWhenThereIsNothingToDo) {
  ThreadTeam team(8);
  std::atomic<int> turns = 0;
  team.for_each(8, [&](int, int) { ++turns; });
  double used = 1;
  // on a busy machine it takes a while until all of them have had the time to fall asleep
  for (int time = 0; time < 20 && used > 0.02; ++time) {
    const std::clock_t before = std::clock();  // of all threads
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    used = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  }
  EXPECT_LT(used, 0.02) << "seconds of 8 threads in 0.2 s";
  team.for_each(8, [&](int, int) { ++turns; });
  EXPECT_EQ(turns, 16);
}

}  // namespace
}  // namespace crackle
