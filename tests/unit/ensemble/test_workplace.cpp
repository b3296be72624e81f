#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "crackle/ensemble/workplace.hpp"
#include "support/break_record.hpp"
#include "support/sample_records.hpp"
#include "support/small_networks.hpp"
#include "support/temporary_folder.hpp"

namespace crackle {
namespace {

/// A workplace that has everything it needs, alone, for samples of a network.
class Site {
 public:
  Site(Network network, const std::string& path, const EnsembleOptions& ensemble = {}, bool resume = false)
      : network_(std::move(network)),
        ensemble_(ensemble),
        output_{.path = path, .resume = resume, .record = {.parts = {"breaks", "profile"}}},
        place_(run_, kNumber, make_equilibrium(network_, equilibrium_, times_), ranks_, hand_out_, times_) {}

  Workplace& place() { return place_; }
  HandOut& hand_out() { return hand_out_; }
  [[nodiscard]] int claims() const { return claims_; }
  std::string complaint() { return hand_out_.leave({}).complaint.data(); }

  static constexpr int kNumber = 3;  ///< of the size, among those of the run

 private:
  /// Makes the folder, as RunFile::claim does.
  void claim() {
    ++claims_;
    std::filesystem::create_directory(shard_folder(output_.path));
  }

  Network network_;
  ChosenStrategy equilibrium_;
  EnsembleOptions ensemble_;
  DisorderOptions disorder_;
  OutputOptions output_;
  RunHeader header_{.options = "-seed 1\n"};
  Run run_{network_, equilibrium_, ensemble_, disorder_, output_, header_, {}};
  PhaseTimes times_;
  int claims_ = 0;
  Ranks ranks_{MPI_COMM_SELF, 1};
  SampleQueue queue_{1};
  Progress progress_{{{}, {}, {}, {}}, 1, true};
  HandOut hand_out_{ranks_, queue_, progress_, [this](int) { claim(); }};
  Workplace place_;
};

Network springs() {
  return test::triangular_networks(4)[1].network;
}

/// Every sample in the shards of an output, in the order of the shards' names.
std::vector<SampleRecord> written(const std::string& output) {
  std::vector<SampleRecord> all;
  for (const std::string& path : shard_paths(output)) {
    for (SampleRecord& record : read_records(path)) all.push_back(std::move(record));
  }
  return all;
}

void expect_breaks(const SampleRecord& record, std::int64_t index) {
  const Network network = springs();
  const SampleRecord alone = test::break_record(network, {}, test::uniform_thresholds(network, index));
  EXPECT_EQ(record.summary.index, index);
  EXPECT_EQ(record.summary.n_p, alone.summary.n_p);
  EXPECT_EQ(record.summary.peak_load, alone.summary.peak_load);
  EXPECT_EQ(record.bond, alone.bond);
  EXPECT_EQ(record.load, alone.load);
}

TEST(Workplace, WritesWhatItHasBrokenOnceItMay) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  Site site(springs(), path);
  Report report;
  EXPECT_FALSE(site.place().waiting());
  site.place().break_chunk({.run = Site::kNumber, .first = 5, .count = 3}, report);
  EXPECT_EQ(report.run, Site::kNumber);
  EXPECT_EQ(report.finished, 3);
  EXPECT_GT(report.seconds, 0);
  EXPECT_TRUE(site.place().waiting());
  site.place().save(report, true);
  EXPECT_EQ(report.saved.count(), 0);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "the output may be another's";

  ASSERT_TRUE(site.hand_out().claim(Site::kNumber));
  site.place().allow_writing();
  site.place().save(report, true);
  EXPECT_FALSE(site.place().waiting());
  const std::vector<SampleRecord> records = written(path);
  ASSERT_EQ(records.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) expect_breaks(records[i], 5 + static_cast<std::int64_t>(i));
  EXPECT_EQ(records[0].profile_failure.size(), 5u);
  EXPECT_EQ(report.saved_run, Site::kNumber);
  EXPECT_EQ(report.saved.count(), 3);
  double mean = 0;
  for (const SampleRecord& record : records) mean += record.summary.peak_load / 3;
  EXPECT_NEAR(report.saved.mean(), mean, 1e-14);

  Report next;
  site.place().save(next, true);
  EXPECT_EQ(next.saved.count(), 0) << "nothing is told twice";
  EXPECT_EQ(site.complaint(), "");
}

/// Reports add up: a chunk of a report that has one already.
TEST(Workplace, AddsToTheReport) {
  const test::TemporaryFolder folder;
  Site site(springs(), folder.path("run.h5"));
  Report report;
  site.place().break_chunk({Site::kNumber, 0, 1}, report);
  const double seconds = report.seconds;
  site.place().break_chunk({Site::kNumber, 4, 2}, report);
  EXPECT_EQ(report.finished, 3);
  EXPECT_GT(report.seconds, seconds);
}

TEST(Workplace, ASampleThatCanNotBeEndsTheRun) {
  const test::TemporaryFolder folder;
  Site site(test::inclined_chain(Grips::sliding), folder.path("run.h5"));
  Report report;
  site.place().break_chunk({Site::kNumber, 7, 3}, report);
  EXPECT_EQ(report.finished, 0);
  EXPECT_FALSE(site.place().waiting());
  EXPECT_TRUE(site.hand_out().stopping());
  const std::string complaint = site.complaint();
  EXPECT_NE(complaint.find("sample 7"), std::string::npos) << complaint;
}

TEST(Workplace, KeepsWhatWasFinishedBeforeAnError) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  Site site(springs(), path);
  Report report;
  ASSERT_TRUE(site.hand_out().claim(Site::kNumber));
  site.place().allow_writing();
  site.place().break_chunk({Site::kNumber, 0, 2}, report);
  site.hand_out().fail("a disk is full, say");
  site.place().break_chunk({Site::kNumber, 2, 2}, report);
  EXPECT_EQ(report.finished, 2) << "a sample is left where the run ends";
  site.place().save(report, true);
  EXPECT_EQ(written(path).size(), 2u);
  EXPECT_EQ(site.complaint(), "a disk is full, say");
}

/// It is left after every break, and taken up by a workplace that has never seen it. Bits are those of a sample that
/// was never left.
TEST(Workplace, ASampleGoesOnFromItsCheckpoint) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  const EnsembleOptions ensemble{.checkpoint_every = 3600, .checkpoint_breaks = 1};
  const std::string kept = checkpoint_path(path, 2);
  const Chunk chunk{Site::kNumber, 2, 1};
  for (std::int32_t turn = 1; turn <= 4; ++turn) {
    Site site(springs(), path, ensemble, true);
    Report report;
    site.hand_out().fail("enough");
    site.place().break_chunk(chunk, report);
    EXPECT_EQ(report.finished, 0);
    EXPECT_EQ(site.claims(), 1);
    ASSERT_TRUE(std::filesystem::exists(kept));
    EXPECT_EQ(read_records(kept).front().summary.n_f, turn);
  }
  Site site(springs(), path, ensemble, true);
  Report report;
  site.place().break_chunk(chunk, report);
  EXPECT_EQ(report.finished, 1);
  site.place().allow_writing();
  site.place().save(report, true);
  EXPECT_FALSE(std::filesystem::exists(kept)) << "the whole sample takes its place";

  const std::string other = folder.path("whole.h5");
  Site never_left(springs(), other, ensemble);
  never_left.place().break_chunk(chunk, report);
  ASSERT_TRUE(never_left.hand_out().claim(Site::kNumber));
  never_left.place().allow_writing();
  never_left.place().save(report, true);

  std::vector<SampleRecord> found = written(path);
  std::vector<SampleRecord> expected = written(other);
  ASSERT_EQ(found.size(), 1u);
  ASSERT_EQ(expected.size(), 1u);
  found.front().summary.wall_time = expected.front().summary.wall_time = 0;
  test::expect_same(found.front(), expected.front());
  EXPECT_EQ(never_left.place().equilibrium().counts().breaks, expected.front().summary.n_f);
  EXPECT_EQ(site.place().equilibrium().counts().breaks, expected.front().summary.n_f - 4);
}

}  // namespace
}  // namespace crackle
