#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "crackle/base/hdf5_handle.hpp"
#include "crackle/compare/compare_file.hpp"
#include "support/expect_refused.hpp"
#include "support/temporary_folder.hpp"

namespace crackle {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Two breaks skipped, three compared, two of them measured.
ReferenceRun reference_run() {
  ReferenceRun run;
  run.name = "by hand";
  run.bond = {7, 3, 5, 1, 9};
  run.load = {0.5, 2, 1.5};
  run.stiffness = {3, 2, 1};
  run.number = {3, 5};
  run.error = {1e-15, 2e-15};
  run.skip = 2;
  run.failed = true;
  run.peak_load = 2;
  run.n_p = 4;
  run.n_f = 5;
  run.seconds = 0.25;
  return run;
}

/// Two repetitions; the second break measured was not reached.
StrategyRun strategy_run(const std::string& name) {
  StrategyRun run;
  run.choice = {name, "options/" + name + ".opts", "1e-3", {{"-ksp_type", "cg"}, {"-ksp_rtol", "1e-3"}}};
  run.time = {0.1, kUnknown, 0.2, kUnknown};
  run.total = {1, kUnknown};
  run.set_up = {0.01, 0.02};
  run.phase.assign(2 * kPhases, 0.5);
  run.iterations = {12, -1};
  run.residual = {1e-4, kUnknown};
  run.backward_error = {1e-5, kUnknown};
  run.force_error = {1e-3, kUnknown};
  run.load_error = {1e-6, kUnknown};
  run.first_difference = 4;
  run.differences = 2;
  run.peak_load = 2.5;
  run.n_p = 3;
  run.n_f = 4;
  run.memory = 5'000'000'000;
  run.counts.iterations = 40;
  run.counts.smallest_slack = 0.125;
  run.complaint = "after break 4: enough";
  return run;
}

std::vector<double> numbers(hid_t where, const std::string& name, const std::vector<hsize_t>& shape) {
  std::vector<hsize_t> found;
  std::vector<double> values = hdf5::read<double>(where, name, &found);
  EXPECT_EQ(found, shape) << name;
  return values;
}

TEST(CompareFile, HasWhatTheComparisonFound) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("compare.h5");
  {
    CompareFile file({.path = path});
    file.write("-seed 1\n", reference_run(), std::vector{strategy_run("a"), strategy_run("b")});
  }
  EXPECT_FALSE(std::filesystem::exists(shard_folder(path)));
  const hdf5::Handle file = hdf5::open_file(path);
  EXPECT_EQ(hdf5::read_text(file, "kind"), "comparison");
  EXPECT_EQ(hdf5::read_number(file, "schema_version"), kCompareSchemaVersion);
  EXPECT_EQ(hdf5::read_text(file, "options"), "-seed 1\n");
  const hdf5::Handle reference = hdf5::open_group(file, "reference");
  EXPECT_EQ(hdf5::read_text(reference, "name"), "by hand");
  EXPECT_EQ(hdf5::read_number(reference, "skip"), 2);
  EXPECT_EQ(hdf5::read_number(reference, "n_p"), 4);
  EXPECT_EQ(hdf5::read_number(reference, "failed"), 1);
  EXPECT_EQ(numbers(reference, "bond", {5}), (std::vector<double>{7, 3, 5, 1, 9}));
  EXPECT_EQ(numbers(reference, "load", {3}), (std::vector{0.5, 2.0, 1.5}));
  EXPECT_EQ(numbers(reference, "number", {2}), (std::vector{3.0, 5.0}));
}

TEST(CompareFile, HasAGroupForEachStrategy) {
  const test::TemporaryFolder folder;
  CompareFile({.path = folder.path("c.h5")})
      .write("", reference_run(), std::vector{strategy_run("a"), strategy_run("b")});
  const hdf5::Handle file = hdf5::open_file(folder.path("c.h5"));
  EXPECT_EQ(hdf5::read_text(hdf5::open_group(file, "strategies/000"), "name"), "a");
  const hdf5::Handle group = hdf5::open_group(file, "strategies/001");
  EXPECT_EQ(hdf5::read_text(group, "name"), "b");
  EXPECT_EQ(hdf5::read_text(group, "file"), "options/b.opts");
  EXPECT_EQ(hdf5::read_text(group, "options"), "-ksp_rtol 1e-3\n-ksp_type cg\n");
  EXPECT_EQ(hdf5::read_text(group, "rtol"), "1e-3");
  EXPECT_EQ(hdf5::read_text(group, "complaint"), "after break 4: enough");
  EXPECT_EQ(hdf5::read_number(group, "first_difference"), 4);
  EXPECT_EQ(hdf5::read_number(group, "differences"), 2);
  EXPECT_EQ(hdf5::read_number(group, "memory"), 5e9) << "more than 32 bits";
  EXPECT_EQ(hdf5::read_number(group, "iterations"), 40);
  EXPECT_EQ(hdf5::read_number(group, "smallest_slack"), 0.125);
  EXPECT_EQ(hdf5::read_number(group, "peak_error"), 0.25);
  const std::vector<double> time = numbers(group, "time", {2, 2});
  EXPECT_EQ(time[0], 0.1);
  EXPECT_EQ(time[2], 0.2);
  EXPECT_TRUE(std::isnan(time[1]) && std::isnan(time[3]));
  EXPECT_EQ(numbers(group, "iterations", {2}), (std::vector{12.0, -1.0}));
  EXPECT_EQ(numbers(group, "phase", {2, kPhases}), std::vector(2 * kPhases, 0.5));
  for (const char* series : {"residual", "backward_error", "force_error", "load_error"}) {
    EXPECT_TRUE(std::isnan(numbers(group, series, {2})[1])) << series;
  }
}

TEST(CompareFile, IsReplacedOnlyWhenAskedTo) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("compare.h5");
  std::ofstream(path) << "mine";
  test::expect_refused([&] { const CompareFile file({.path = path}); }, {"-output " + path, "-overwrite"});
  EXPECT_EQ(std::filesystem::file_size(path), 4u);
  CompareFile file({.path = path, .overwrite = true});
  EXPECT_EQ(std::filesystem::file_size(path), 4u) << "stays until another is whole";
  test::expect_refused([&] { const CompareFile other({.path = path, .overwrite = true}); }, {path});
  file.write("", reference_run(), {});
  EXPECT_EQ(hdf5::read_text(hdf5::open_file(path), "kind"), "comparison");
}

TEST(CompareFile, IsRefusedWhereItCanNotBe) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("no/where.h5");
  test::expect_refused([&] { const CompareFile file({.path = path}); }, {path});
  std::filesystem::create_directory(shard_folder(folder.path("run.h5")));
  test::expect_refused([&] { const CompareFile file({.path = folder.path("run.h5")}); },
                       {"run.h5", "-overwrite"});
}

/// In the order of -compare, whoever sorts their names.
TEST(CompareFile, HasRoomForAnyNumberOfStrategies) {
  const test::TemporaryFolder folder;
  std::vector<StrategyRun> runs;
  for (int i = 0; i < 1002; ++i) {
    runs.push_back(strategy_run(std::to_string(i)));
    runs.back().time.clear();
  }
  CompareFile({.path = folder.path("c.h5")}).write("", reference_run(), runs);
  const hdf5::Handle file = hdf5::open_file(folder.path("c.h5"));
  EXPECT_EQ(hdf5::read_text(hdf5::open_group(file, "strategies/0999"), "name"), "999");
  EXPECT_EQ(hdf5::read_text(hdf5::open_group(file, "strategies/1001"), "name"), "1001");
}

}  // namespace
}  // namespace crackle
