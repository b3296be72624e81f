#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "crackle/base/hdf5_handle.hpp"
#include "crackle/base/version.hpp"
#include "crackle/record/run_records.hpp"
#include "support/expect_refused.hpp"
#include "support/hdf5_file.hpp"
#include "support/sample_records.hpp"
#include "support/small_networks.hpp"
#include "support/temporary_folder.hpp"

namespace crackle {
namespace {

const RecordOptions kAll{.parts = {"breaks", "profile", "snapshot"}};
const RecordOptions kNone{.parts = {}};

/// The paths of all datasets and groups of a file.
std::set<std::string> contents(const std::string& path) {
  std::set<std::string> names;
  const auto note = [](hid_t, const char* name, const H5O_info_t*, void* out) {
    static_cast<std::set<std::string>*>(out)->insert(name);
    return herr_t{0};
  };
  H5Ovisit(hdf5::open_file(path), H5_INDEX_NAME, H5_ITER_INC, note, &names);
  names.erase(".");
  return names;
}

const std::set<std::string> kAlways{"samples",           "samples/index",
                                    "samples/peak_load", "samples/n_p",
                                    "samples/n_f",       "samples/peak_displacement",
                                    "samples/wall_time", "samples/initial_stiffness"};

std::set<std::string> with(std::set<std::string> names, const std::set<std::string>& more) {
  names.insert(more.begin(), more.end());
  return names;
}

TEST(RunRecords, WhatIsWrittenIsRead) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  for (const std::vector<std::int64_t>& indices : {std::vector<std::int64_t>{}, {4}, {0, 1, 7, 1LL << 40}}) {
    std::vector<SampleRecord> records;
    for (const std::int64_t index : indices) records.push_back(test::sample_record(index));
    test::write_run(path, {.options = "-seed 1\n"}, kAll, records);
    test::expect_samples(read_records(path), indices);
  }
  EXPECT_EQ(read_header(path).options, "-seed 1\n");
  const hdf5::Handle file = hdf5::open_file(path);
  EXPECT_EQ(hdf5::read_number(file, "schema_version"), kSchemaVersion);
  EXPECT_EQ(hdf5::read_text(file, "code_version"), kVersion);
  EXPECT_EQ(hdf5::read_text(file, "created").size(), std::string("2000-01-01T00:00:00Z").size());
  EXPECT_EQ(hdf5::read<std::int64_t>(file, "samples/break_offset"),
            (std::vector<std::int64_t>{0, 3, 6, 9, 12}));
  std::vector<hsize_t> shape;
  (void)hdf5::read<double>(file, "snapshots/force", &shape);
  EXPECT_EQ(shape, (std::vector<hsize_t>{6, test::kRecordBonds}));
  (void)hdf5::read<std::int32_t>(file, "profile/peak", &shape);
  EXPECT_EQ(shape, (std::vector<hsize_t>{4, 2}));
}

TEST(RunRecords, HoldNothingThatNobodyAskedFor) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  const std::vector<SampleRecord> records{test::sample_record(0)};
  const auto written = [&](const RecordOptions& options, const RunHeader& header) {
    test::write_run(path, header, options, records);
    return contents(path);
  };
  EXPECT_EQ(written(kNone, {}), kAlways);
  EXPECT_EQ(written(RecordOptions{}, {}), with(kAlways, {"samples/break_offset", "breaks", "breaks/bond",
                                                         "breaks/load", "breaks/stiffness"}));
  EXPECT_EQ(written({.parts = {"profile"}}, {}),
            with(kAlways, {"profile", "profile/peak", "profile/failure"}));
  EXPECT_EQ(written({.parts = {"snapshot"}}, {}),
            with(kAlways, {"snapshots", "snapshots/sample", "snapshots/number", "snapshots/displacement",
                           "snapshots/force"}));
  const Network network = test::bundle(3);
  const std::set<std::string> network_parts{"network",
                                            "network/nodes",
                                            "network/nodes/position",
                                            "network/bonds",
                                            "network/bonds/nodes",
                                            "network/nodes/grip",
                                            "network/bonds/stiffness"};
  const RecordOptions with_network{.parts = {}, .network = true};
  EXPECT_EQ(written(with_network, {.network = &network}), with(kAlways, network_parts));
  EXPECT_EQ(written(with_network, {.network = &network, .threshold = {0.1, 0.2, 0.3}}),
            with(with(kAlways, network_parts), {"network/bonds/threshold"}));
}

/// A file of two samples and six breaks, in which one dataset is another.
template <class T>
void expect_refused_with(const std::string& name, const std::vector<T>& values) {
  SCOPED_TRACE(name);
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  test::write_run(path, {}, kAll, std::vector{test::sample_record(1), test::sample_record(3)});
  {
    const hdf5::Handle file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT));
    ASSERT_GE(H5Ldelete(file, name.c_str(), H5P_DEFAULT), 0);
    hdf5::write<T>(file, name, values);
  }
  test::expect_refused([&] { (void)read_records(path); }, {path});
}

TEST(RunRecords, RefuseWhatIsNotAWholeRun) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("run.h5");
  const auto read = [&] { (void)read_records(path); };
  test::expect_refused(read, {path, "exists"});
  std::ofstream(path) << "nothing";
  test::expect_refused(read, {path, "HDF5"});
  test::write_hdf5(path, [](hid_t) {});
  test::expect_refused(read, {path, "attribute schema_version"});
  test::write_run(path, {}, kAll, std::vector{test::sample_record(0)});
  EXPECT_NO_THROW(read());
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 1);
  test::expect_refused(read, {path, "whole"});
  expect_refused_with<double>("samples/peak_load", {1});
  expect_refused_with<double>("breaks/load", {1, 2, 3, 4, 5});
  expect_refused_with<std::int64_t>("samples/break_offset", {0, 6});
  expect_refused_with<std::int64_t>("samples/break_offset", {0, 3, 7});
  expect_refused_with<std::int64_t>("snapshots/sample", {1, 2});
}

TEST(RunRecords, RefusePartsThatDoNotFit) {
  expect_refused_with<std::int64_t>("samples/break_offset", {0, 7, 6});
  expect_refused_with<std::int64_t>("samples/break_offset", {-1, 3, 6});
  expect_refused_with<std::int64_t>("samples/break_offset", {1, 3, 6});
  expect_refused_with<std::int32_t>("profile/failure", {1, 2});
  expect_refused_with<std::int32_t>("profile/peak", {1, 2, 3});
  expect_refused_with<std::int32_t>("snapshots/number", {1});
  expect_refused_with<double>("snapshots/force", {1, 2, 3});
}

}  // namespace
}  // namespace crackle
