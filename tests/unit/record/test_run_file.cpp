#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "crackle/base/hdf5_handle.hpp"
#include "crackle/record/run_file.hpp"
#include "support/expect_refused.hpp"
#include "support/sample_records.hpp"
#include "support/temporary_folder.hpp"

namespace crackle {
namespace {

namespace fs = std::filesystem;

using Indices = std::vector<std::int64_t>;

const RecordOptions kAll{.parts = {"breaks", "profile", "snapshot"}};

enum class Start : std::uint8_t { fresh, resume, overwrite };

/// A run into run.h5 of a folder.
RunFile begin(const std::string& path, Start start = Start::fresh,
              const std::string& options = "-samples 4\n-seed 1\n") {
  return RunFile(
      {.path = path,
       .resume = start == Start::resume,
       .overwrite = start == Start::overwrite,
       .record = kAll},
      {.options = options, .deciding = {"-ksp_rtol", "-ksp_type", "-lattice", "-lattice_size", "-seed"}});
}

/// Adds samples, each in a shard of its own.
void add(RunFile& file, const Indices& indices) {
  for (const std::int64_t index : indices) {
    file.add(test::sample_record(index));
    file.flush();
  }
}

/// A fresh run that is killed after these samples.
void leave_run(const std::string& path, const Indices& indices,
               const std::string& options = "-samples 4\n-seed 1\n") {
  RunFile killed = begin(path, Start::fresh, options);
  add(killed, indices);
}

std::string bytes(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Every entry of a folder and below, with its bytes.
std::map<std::string, std::string> everything(const std::string& folder) {
  std::map<std::string, std::string> entries;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    entries[entry.path().string()] = entry.is_regular_file() ? bytes(entry.path().string()) : "";
  }
  return entries;
}

TEST(RunFile, MergesShardsInTheOrderOfTheirSamples) {
  {
    const test::TemporaryFolder folder;
    const std::string path = folder.path("run.h5");
    RunFile file = begin(path);
    EXPECT_TRUE(file.finished().empty());
    EXPECT_TRUE(everything(folder.path()).empty()) << "nothing is written before a sample is done";
    add(file, {11, 2, 7});
    file.add(test::sample_record(0));
    const std::vector<SampleSummary> summaries = file.finish();
    test::expect_samples(read_records(path), {0, 2, 7, 11});
    ASSERT_EQ(summaries.size(), 4u);
    EXPECT_EQ(summaries[3].index, 11);
    EXPECT_EQ(summaries[3].peak_load, test::sample_record(11).summary.peak_load);
    EXPECT_EQ(read_header(path).options, "-samples 4\n-seed 1\n");
    EXPECT_EQ(everything(folder.path()).size(), 1u) << "no shard and no temporary file is left";
  }
  {
    const test::TemporaryFolder folder;
    RunFile file = begin(folder.path("run.h5"));
    Indices indices;
    for (std::int64_t index = 0; index < 12; ++index) indices.push_back(index);
    add(file, indices);
    (void)file.finish();
    test::expect_samples(read_records(folder.path("run.h5")), indices);
  }
}

/// A kill: the run is gone without `finish`. What was flushed is there, what waited is lost.
TEST(RunFile, ResumeFindsWhatAKilledRunLeft) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  {
    RunFile killed = begin(path);
    add(killed, {0, 3});
    killed.add(test::sample_record(1));
  }
  {
    RunFile killed_again = begin(path, Start::resume);
    EXPECT_EQ(killed_again.finished(), (std::set<std::int64_t>{0, 3}));
    add(killed_again, {1});
  }
  RunFile file = begin(path, Start::resume);
  EXPECT_EQ(file.finished(), (std::set<std::int64_t>{0, 1, 3}));
  add(file, {2});
  (void)file.finish();
  test::expect_samples(read_records(path), {0, 1, 2, 3});
  RunFile longer = begin(path, Start::resume, "-samples 5\n-seed 1\n");
  EXPECT_EQ(longer.finished(), (std::set<std::int64_t>{0, 1, 2, 3})) << "a whole run can go on, too";
  add(longer, {4});
  EXPECT_EQ(longer.finish().size(), 5u);
  EXPECT_EQ(read_header(path).options, "-samples 5\n-seed 1\n");
}

/// Killed while a file was written (torn, under another name) or after the merge before the shards went.
TEST(RunFile, ResumeSurvivesAKillAtAnyTime) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  const std::string shards = path + ".shards";
  leave_run(path, {0, 1});
  std::ofstream(shards + "/2.h5.part") << "torn";
  std::ofstream(path + ".part") << "torn";
  fs::copy(shards, folder.path("copy"), fs::copy_options::recursive);
  RunFile file = begin(path, Start::resume);
  EXPECT_EQ(file.finished(), (std::set<std::int64_t>{0, 1}));
  (void)file.finish();
  test::expect_samples(read_records(path), {0, 1});
  fs::copy(folder.path("copy"), shards, fs::copy_options::recursive);
  EXPECT_EQ(begin(path, Start::resume).finish().size(), 2u) << "once each, though twice on disk";
  fs::copy(folder.path("copy"), shards, fs::copy_options::recursive);
  fs::remove(path);
  EXPECT_EQ(begin(path, Start::resume).finish().size(), 2u) << "from the shards alone";
  test::expect_samples(read_records(path), {0, 1});
}

TEST(RunFile, TheSameSamplesMakeTheSameDatasets) {
  const test::TemporaryFolder folder;
  RunFile once = begin(folder.path("once.h5"));
  for (const std::int64_t index : {0, 1, 2, 3}) once.add(test::sample_record(index));
  (void)once.finish();
  leave_run(folder.path("parts.h5"), {3, 1});
  RunFile resumed = begin(folder.path("parts.h5"), Start::resume);
  add(resumed, {2, 0});
  (void)resumed.finish();
  const hdf5::Handle a = hdf5::open_file(folder.path("once.h5"));
  const hdf5::Handle b = hdf5::open_file(folder.path("parts.h5"));
  for (const char* name :
       {"samples/index", "samples/peak_load", "samples/n_f", "samples/break_offset", "breaks/bond",
        "breaks/load", "profile/peak", "snapshots/sample", "snapshots/force"}) {
    std::vector<hsize_t> shape_a;
    std::vector<hsize_t> shape_b;
    EXPECT_EQ(hdf5::read<double>(a, name, &shape_a), hdf5::read<double>(b, name, &shape_b)) << name;
    EXPECT_EQ(shape_a, shape_b) << name;
  }
}

/// Refused, and not a byte of what is there has changed.
void expect_untouched(const test::TemporaryFolder& folder, Start start, const std::string& options,
                      const std::vector<std::string>& message) {
  const auto before = everything(folder.path());
  test::expect_refused([&] { (void)begin(folder.path("run.h5"), start, options); }, message);
  EXPECT_EQ(everything(folder.path()), before);
}

TEST(RunFile, RefusesToReplaceWhatIsThere) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  leave_run(path, {0});
  expect_untouched(folder, Start::fresh, "-seed 1\n", {"-output", path, "-resume", "-overwrite"});
  fs::remove(path);
  expect_untouched(folder, Start::fresh, "-seed 1\n", {"-output", path, "-resume", "-overwrite"});
  fs::remove_all(path + ".shards");
  std::ofstream(path) << "a thesis";
  expect_untouched(folder, Start::fresh, "-seed 1\n", {"-output", path});
}

TEST(RunFile, RefusesToResumeWithOtherOptions) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  const std::string begun = "-ksp_rtol 1e-3\n-ksp_view \n-lattice triangular\n-lattice_size 8\n-seed 1\n";
  leave_run(path, {0}, begun);
  EXPECT_NO_THROW((void)begin(path, Start::resume, begun + "-samples 77\n"));
  const std::string lattice = "-lattice triangular\n-lattice_size 8\n";
  EXPECT_NO_THROW((void)begin(path, Start::resume, "-ksp_rtol 1e-3\n" + lattice + "-seed 1\n"))
      << "-ksp_view only looks";
  expect_untouched(folder, Start::resume, "-ksp_rtol 1e-3\n" + lattice + "-seed 2\n",
                   {"-seed 2 (the file has 1)", path});
  expect_untouched(folder, Start::resume, "-ksp_rtol 1e-3\n-lattice triangular\n-lattice_size 80\n-seed 11\n",
                   {"-lattice_size 80 (the file has 8)", "-seed 11 (the file has 1)"});
  expect_untouched(folder, Start::resume, begun + "-ksp_type cg\n", {"-ksp_type cg (the file has none)"});
  expect_untouched(folder, Start::resume, lattice + "-seed 1\n", {"-ksp_rtol", "(the file has 1e-3)"});
}

TEST(RunFile, RefusesToResumeWithAnotherNetworkFile) {
  const test::TemporaryFolder folder;
  const OutputOptions output{
      .path = folder.path("run.h5"), .resume = true, .overwrite = false, .record = kAll};
  const auto begin_with = [&](const std::string& checksum) {
    return RunFile(output, {.options = "-lattice_file network.h5\n", .checksum = checksum});
  };
  {
    RunFile file = begin_with("0123456789abcdef");
    add(file, {0});
  }
  for (const char* checksum : {"0123456789abcdee", ""}) {
    test::expect_refused([&] { (void)begin_with(checksum); },
                         {"-resume of " + output.path, "network", "network.h5"});
  }
  EXPECT_EQ(begin_with("0123456789abcdef").finished().size(), 1u);
}

/// Two runs into one file, begun at the same time: the second to finish a sample must not take the first
/// one's away.
TEST(RunFile, TheSecondToClaimAnOutputIsRefused) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  RunFile first = begin(path);
  RunFile second = begin(path);
  add(first, {0});
  test::expect_refused([&] { add(second, {1}); }, {"-output", path});
  (void)first.finish();
  test::expect_samples(read_records(path), {0});
}

TEST(RunFile, RefusesToResumeWhatIsNoRun) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  std::ofstream(path) << "a thesis";
  expect_untouched(folder, Start::resume, "-seed 1\n", {path, "HDF5"});
  fs::remove(path);
  leave_run(path, {0});
  fs::resize_file(path + ".shards/0.h5", 1000);
  expect_untouched(folder, Start::resume, "-seed 1\n", {path + ".shards/0.h5", "whole"});
}

TEST(RunFile, RefusesWhatCannotBeWritten) {
  const test::TemporaryFolder folder;
  for (const std::string& path : {folder.path("no/run.h5"), folder.path()}) {
    for (const Start start : {Start::fresh, Start::resume, Start::overwrite}) {
      if (path == folder.path() && start == Start::fresh) continue;  // refused since it exists
      SCOPED_TRACE(path);
      test::expect_refused([&] { (void)begin(path, start); }, {"-output", path, "can be written"});
    }
  }
  EXPECT_TRUE(everything(folder.path()).empty());
  std::ofstream(folder.path("file")) << "a thesis";
  test::expect_refused([&] { (void)begin(folder.path("file/run.h5")); },
                       {"-output", folder.path("file/run.h5")});
}

TEST(RunFile, ResumeWithNothingBeginsAndOverwriteForgets) {
  {
    const test::TemporaryFolder folder;
    RunFile file = begin(folder.path("run.h5"), Start::resume);
    EXPECT_TRUE(file.finished().empty());
    add(file, {5});
    EXPECT_EQ(file.finish().size(), 1u);
  }
  {
    const test::TemporaryFolder folder;
    const std::string path = folder.path("run.h5");
    leave_run(path, {0, 1, 2});
    RunFile file = begin(path, Start::overwrite, "-seed 2\n");
    EXPECT_TRUE(file.finished().empty());
    add(file, {9});
    (void)file.finish();
    test::expect_samples(read_records(path), {9});
    EXPECT_EQ(everything(folder.path()).size(), 1u);
  }
}

}  // namespace
}  // namespace crackle
