/// Written for any number of processes: tests/processes runs them in several.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "crackle/base/error.hpp"
#include "crackle/ensemble/hand_out.hpp"
#include "support/processes.hpp"

namespace crackle {
namespace {

constexpr std::int64_t kSamples = 60;

/// A run of kSamples samples that is handed out to all processes.
struct Desk {
  explicit Desk(int group_size = 1)
      : ranks(MPI_COMM_WORLD, group_size),
        queue(ranks.groups()),
        progress({{.name = "", .total = kSamples}}, ranks.groups(), true),
        hand_out(ranks, queue, progress, [this](int run) {
          if (!refusal.empty()) throw InputError(refusal);
          claimed.push_back(run);
        }) {
    if (ranks.first()) queue.append(0, 0, kSamples, {});
  }

  /// Asks until there is no more; how often each sample was given to this group.
  std::vector<int> work() {
    std::vector<int> given(kSamples, 0);
    Report report;
    for (Answer answer = hand_out.next(report); answer.work; answer = hand_out.next(report)) {
      for (std::int64_t i = 0; i < answer.chunk.count; ++i) ++given.at(answer.chunk.first + i);
      report = {.finished = answer.chunk.count, .seconds = 1e-4 * static_cast<double>(answer.chunk.count)};
    }
    return given;
  }

  /// Breaks on and on, until it is told to stop; false: nobody told.
  bool told_to_stop() {
    const auto start = std::chrono::steady_clock::now();
    while (!hand_out.stopping()) {
      if (std::chrono::steady_clock::now() - start > std::chrono::seconds(60)) return false;
    }
    return true;
  }

  [[nodiscard]] bool last_leader() const {
    return ranks.leader() && ranks.group_number() == ranks.groups() - 1;
  }

  std::vector<int> claimed;  ///< in the first process
  std::string refusal;       ///< what the owner of the output says to a claim; empty: it is granted
  Ranks ranks;
  SampleQueue queue;
  Progress progress;
  HandOut hand_out;
};

std::string complaint_of(const RunEnd& end) {
  return end.complaint.data();
}

TEST(HandOut, GivesEverySampleToOneGroupAndToAllOfIt) {
  for (const int each : test::group_sizes()) {
    SCOPED_TRACE(each);
    Desk desk(each);
    const std::vector<int> given = desk.work();
    const RunEnd end = desk.hand_out.leave({});  // until then the first process answers
    std::vector<int> all(given.size());
    MPI_Allreduce(given.data(), all.data(), kSamples, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
    EXPECT_EQ(all, std::vector<int>(kSamples, each));
    std::vector<int> of_leader = given;
    desk.ranks.share(of_leader);
    EXPECT_EQ(given, of_leader);
    EXPECT_EQ(complaint_of(end), "");
    EXPECT_EQ(end.signal, 0);
    EXPECT_FALSE(desk.hand_out.stopping());
    EXPECT_EQ(desk.queue.left(0), 0);
  }
}

/// Reports reach the queue, whose chunks grow by them, and the progress.
TEST(HandOut, LearnsFromReports) {
  Desk desk;
  const Answer one = desk.hand_out.next({});
  EXPECT_EQ(one.chunk.count, one.work ? 1 : 0) << "nothing is known yet";
  RunningMean load;
  load.add(2.5);
  (void)desk.hand_out.leave({.finished = 1, .seconds = 0.25, .saved_run = 0, .saved = load});
  if (!desk.ranks.first()) return;
  EXPECT_EQ(desk.queue.seconds_per_sample(0), 0.25);
  const std::string line = desk.progress.line();
  EXPECT_TRUE(line.starts_with(std::to_string(desk.ranks.groups()) + " of 60 samples")) << line;
  EXPECT_NE(line.find("mean peak load 2.5000"), std::string::npos) << line;
}

TEST(HandOut, LetsNobodyWriteBeforeTheOutputIsClaimed) {
  Desk desk;
  EXPECT_FALSE(desk.hand_out.next({.run = 0}).claimed);
  EXPECT_TRUE(desk.hand_out.next({.run = 0, .waiting = true}).claimed);
  EXPECT_TRUE(desk.hand_out.claim(0));
  EXPECT_EQ(complaint_of(desk.hand_out.leave({})), "");
  const std::size_t claims = desk.ranks.first() ? 2 * static_cast<std::size_t>(desk.ranks.groups()) : 0;
  EXPECT_EQ(desk.claimed, std::vector<int>(claims, 0));
}

TEST(HandOut, ARefusedClaimEndsTheRunEverywhere) {
  for (const int each : test::group_sizes()) {
    SCOPED_TRACE(each);
    Desk desk(each);
    desk.refusal = "run.h5 is another's";
    if (desk.last_leader()) {
      EXPECT_FALSE(desk.hand_out.claim(0));
    }
    EXPECT_TRUE(desk.told_to_stop());
    EXPECT_FALSE(desk.hand_out.next({}).work);
    EXPECT_EQ(complaint_of(desk.hand_out.leave({})), "run.h5 is another's");
    EXPECT_TRUE(desk.claimed.empty());
  }
}

TEST(HandOut, AnErrorAnywhereEndsTheRunEverywhere) {
  for (const int each : test::group_sizes()) {
    SCOPED_TRACE(each);
    Desk desk(each);
    if (desk.last_leader()) {
      desk.hand_out.fail("the last group's");
      desk.hand_out.fail("what followed from it");
    }
    const bool in_last = desk.ranks.group_number() == desk.ranks.groups() - 1;
    if (in_last) {
      EXPECT_FALSE(desk.hand_out.next({}).work);
    }
    EXPECT_TRUE(desk.told_to_stop());
    EXPECT_EQ(complaint_of(desk.hand_out.leave({})), "the last group's");
  }
}

/// Farewells and the first process's word to stop cross each other.
TEST(HandOut, MayBeLeftInAnyOrder) {
  for (int turn = 0; turn < 20; ++turn) {
    Desk desk;
    if (desk.ranks.first()) desk.hand_out.fail("the first's");
    EXPECT_EQ(complaint_of(desk.hand_out.leave({})), "the first's");
  }
}

TEST(HandOut, TellsOfALongErrorWhatFits) {
  Desk desk;
  if (desk.last_leader()) desk.hand_out.fail(std::string(5000, 'x'));
  EXPECT_EQ(complaint_of(desk.hand_out.leave({})), std::string(999, 'x'));
}

}  // namespace
}  // namespace crackle
