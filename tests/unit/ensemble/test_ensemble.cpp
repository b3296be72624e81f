#include <gtest/gtest.h>

#include "crackle/ensemble/ensemble.hpp"
#include "support/break_record.hpp"
#include "support/sample_records.hpp"
#include "support/small_networks.hpp"
#include "support/temporary_folder.hpp"

namespace crackle {
namespace {

/// Breaks samples of the size 3 spring lattice into a file and returns all that it then holds; `breaks` gets
/// the bonds that had to be broken for it.
std::vector<SampleRecord> run(const std::string& path, std::int64_t first, std::int64_t samples,
                              const RecordOptions& record, std::int64_t* breaks = nullptr) {
  const Network network = test::triangular_networks(3)[1].network;
  PhaseTimes times;
  const ChosenStrategy equilibrium;
  const EnsembleOptions ensemble{.samples = samples, .first_sample = first, .monitor = Monitor::none};
  const DisorderOptions disorder{.from_file = false, .seed = 1};
  const OutputOptions output{.path = path, .resume = true, .overwrite = false, .record = record};
  const RunHeader header{.options = "-seed 1\n"};
  const std::vector<Run> runs{{network, equilibrium, ensemble, disorder, output, header}};
  std::vector<std::unique_ptr<RunFile>> files;
  files.push_back(std::make_unique<RunFile>(output, header));
  std::vector<RunTotals> totals(1);
  const Ranks ranks(MPI_COMM_SELF, 1);
  const EnsembleEnd end = run_ensemble(runs, ranks, files, nullptr, totals);
  EXPECT_EQ(end.complaint, "");
  EXPECT_EQ(end.signal, 0);
  (void)finish(*files.front(), times);
  if (breaks != nullptr) *breaks = totals.front().counts.breaks;
  return read_records(path);
}

void forget_times(std::vector<SampleRecord>& records) {
  for (SampleRecord& record : records) record.summary.wall_time = 0;
}

TEST(Ensemble, PiecesMakeTheWholeBitForBit) {
  const test::TemporaryFolder folder;
  const RecordOptions record{.parts = {"breaks", "profile", "snapshot"}, .snapshot_at = {2}};
  std::vector<SampleRecord> whole = run(folder.path("whole.h5"), 0, 6, record);
  (void)run(folder.path("pieces.h5"), 4, 2, record);
  (void)run(folder.path("pieces.h5"), 1, 1, record);
  std::int64_t breaks = 0;
  std::vector<SampleRecord> pieces = run(folder.path("pieces.h5"), 0, 6, record, &breaks);
  std::int64_t missing = 0;
  for (const int sample : {0, 2, 3}) missing += whole.at(sample).summary.n_f;
  EXPECT_EQ(breaks, missing) << "only what the file did not have";
  forget_times(whole);
  forget_times(pieces);
  ASSERT_EQ(whole.size(), 6u);
  ASSERT_EQ(pieces.size(), 6u);
  for (std::size_t s = 0; s < 6; ++s) {
    EXPECT_EQ(whole[s].summary.index, static_cast<std::int64_t>(s));
    EXPECT_EQ(whole[s].snapshots.size(), 1u);
    test::expect_same(pieces[s], whole[s]);
  }
}

TEST(Ensemble, DrawsFromSeedAndSampleAndRecordsOnlyWhatIsAskedFor) {
  {
    const test::TemporaryFolder folder;
    const std::vector<SampleRecord> records = run(folder.path("run.h5"), 7, 1, {});
    const Network network = test::triangular_networks(3)[1].network;
    const SampleRecord alone = test::break_record(network, {}, test::uniform_thresholds(network, 7));
    ASSERT_EQ(records.size(), 1u);
    EXPECT_EQ(records[0].summary.index, 7);
    EXPECT_EQ(records[0].bond, alone.bond);
    EXPECT_EQ(records[0].load, alone.load);
  }
  {
    const test::TemporaryFolder folder;
    const std::vector<SampleRecord> none = run(folder.path("none.h5"), 0, 2, {.parts = {}});
    ASSERT_EQ(none.size(), 2u);
    EXPECT_GT(none[0].summary.n_f, 0);
    EXPECT_TRUE(none[0].bond.empty() && none[0].profile_peak.empty() && none[0].snapshots.empty());
    const std::vector<SampleRecord> profile = run(folder.path("profile.h5"), 0, 2, {.parts = {"profile"}});
    EXPECT_TRUE(profile[0].bond.empty() && profile[0].snapshots.empty());
    EXPECT_EQ(profile[0].profile_failure.size(), 4u);
  }
}

}  // namespace
}  // namespace crackle
