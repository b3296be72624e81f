#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "crackle/base/hdf5_handle.hpp"
#include "support/expect_refused.hpp"
#include "support/hdf5_file.hpp"
#include "support/temporary_folder.hpp"

namespace crackle {
namespace {

using hdf5::Handle;

ssize_t open_ids() {
  return H5Fget_obj_count(H5F_OBJ_ALL, H5F_OBJ_ALL);
}

template <class T>
void expect_round_trip(hid_t file, const std::string& name, const std::vector<T>& values) {
  hdf5::write<T>(file, name, values);
  std::vector<hsize_t> shape;
  EXPECT_EQ(hdf5::read<T>(file, name, &shape), values);
  EXPECT_EQ(shape, std::vector<hsize_t>{values.size()});
}

TEST(Hdf5Handle, WhatIsWrittenIsRead) {
  const test::TemporaryFolder folder;
  const hdf5::NewFile file;
  expect_round_trip<std::int8_t>(file, "bytes", {-128, 0, 127});
  expect_round_trip<std::int32_t>(file, "ints", {std::numeric_limits<std::int32_t>::min(), 7});
  expect_round_trip<std::int64_t>(file, "longs", {std::numeric_limits<std::int64_t>::max()});
  expect_round_trip<double>(file, "doubles", {0.1, -1e300, std::numeric_limits<double>::infinity()});
  expect_round_trip<double>(file, "none", {});
  hdf5::write<std::int32_t>(file, "pairs", std::vector<std::int32_t>{1, 2, 3, 4, 5, 6}, 2);
  std::vector<hsize_t> shape;
  EXPECT_EQ(hdf5::read<double>(file, "pairs", &shape), (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(shape, (std::vector<hsize_t>{3, 2}));
  const std::string text = "-seed 1\n-samples 2\n" + std::string(5000, 'x');
  hdf5::write_attribute(file, "text", text);
  hdf5::write_attribute(file, "empty", std::string());
  hdf5::write_attribute(file, "number", 0.1);
  hdf5::write_attribute(file, "count", std::int32_t{-3});
  EXPECT_EQ(hdf5::read_text(file, "text"), text);
  EXPECT_EQ(hdf5::read_text(file, "empty"), "");
  EXPECT_EQ(hdf5::read_number(file, "number"), 0.1);
  EXPECT_EQ(hdf5::read_number(file, "count"), -3);
}

TEST(Hdf5Handle, KnowsWhatIsThereAndLeavesNothingOpen) {
  {
    const test::TemporaryFolder folder;
    const ssize_t before = open_ids();
    {
      const hdf5::NewFile file;
      const Handle group = hdf5::create_group(file, "group");
      hdf5::write<double>(group, "x", std::vector{1.0});
      hdf5::write_attribute(group, "a", 1.0);
      (void)hdf5::read<double>(group, "x");
      (void)hdf5::read_number(group, "a");
      EXPECT_THROW((void)hdf5::read<double>(file, "group"), InputError);
      Handle opened = hdf5::open_group(file, "group");
      Handle moved = std::move(opened);
      EXPECT_LT(opened, 0);  // NOLINT(bugprone-use-after-move): what a move leaves is what is tested
      EXPECT_TRUE(hdf5::exists(moved, "x"));
      EXPECT_EQ(open_ids(), before + 3);
    }
    EXPECT_EQ(open_ids(), before);
  }
  {
    const test::TemporaryFolder folder;
    const hdf5::NewFile file;
    const Handle group = hdf5::create_group(file, "group");
    hdf5::write<double>(group, "x", std::vector{1.0});
    EXPECT_TRUE(hdf5::exists(file, "group"));
    EXPECT_TRUE(hdf5::exists(file, "group/x"));
    EXPECT_FALSE(hdf5::exists(file, "group/y"));
    EXPECT_FALSE(hdf5::exists(file, "other/x"));
  }
}

void write_thousand(const std::string& path) {
  test::write_hdf5(path, [](hid_t file) { hdf5::write<double>(file, "x", std::vector<double>(1000, 1.0)); });
}

TEST(Hdf5Handle, RefusesFilesByTheirNameAndForTheirReason) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("a.h5");
  test::expect_refused([&] { (void)hdf5::open_file(path); }, {path, "exists"});
  test::expect_refused([&] { (void)hdf5::open_file(folder.path()); }, {folder.path(), "a folder", "HDF5"});
  ASSERT_EQ(mkfifo(folder.path("pipe").c_str(), 0600), 0);
  test::expect_refused([&] { (void)hdf5::open_file(folder.path("pipe")); }, {"pipe", "no plain file"});
  std::ofstream(path) << "not HDF5";
  test::expect_refused([&] { (void)hdf5::open_file(path); },
                       {path, "file signature not found", "whole, readable HDF5"});
  write_thousand(path);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  test::expect_refused([&] { (void)hdf5::open_file(path); }, {path, "truncated", "whole, readable HDF5"});
}

TEST(Hdf5Handle, RefusesDatasetsAndAttributesByTheirName) {
  {
    const test::TemporaryFolder folder;
    const hdf5::NewFile file;
    const Handle group = hdf5::create_group(file, "group");
    const Handle text(H5Tcopy(H5T_C_S1));
    const Handle space(H5Screate(H5S_SCALAR));
    {
      const Handle words(H5Dcreate2(group, "words", text, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
      ASSERT_GE(words, 0);
    }
    test::expect_refused([&] { (void)hdf5::read<double>(group, "x"); }, {"dataset /group/x", "present"});
    test::expect_refused([&] { (void)hdf5::read<double>(file, "group/x"); }, {"dataset /group/x", "present"});
    test::expect_refused([&] { (void)hdf5::read<double>(file, "group"); }, {"dataset /group", "numbers"});
    test::expect_refused([&] { (void)hdf5::read<double>(group, "words"); },
                         {"dataset /group/words", "numbers"});
  }
  {
    const test::TemporaryFolder folder;
    const hdf5::NewFile file;
    hdf5::write_attribute(file, "text", std::string("2"));
    hdf5::write_attribute(file, "number", 2.0);
    test::expect_refused([&] { (void)hdf5::read_number(file, "x"); }, {"attribute x", "present"});
    test::expect_refused([&] { (void)hdf5::read_text(file, "x"); }, {"attribute x", "present"});
    test::expect_refused([&] { (void)hdf5::read_number(file, "text"); }, {"attribute text", "a number"});
    test::expect_refused([&] { (void)hdf5::read_text(file, "number"); }, {"attribute number", "a text"});
  }
}

/// A file from elsewhere may hold an array where one number is due.
TEST(Hdf5Handle, RefusesAnAttributeOfManyNumbers) {
  const test::TemporaryFolder folder;
  const hdf5::NewFile file;
  const hsize_t size = 64;
  const Handle space(H5Screate_simple(1, &size, nullptr));
  const std::vector<double> values(size, 1.0);
  {
    const Handle numbers(H5Acreate2(file, "numbers", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT));
    ASSERT_GE(H5Awrite(numbers, H5T_NATIVE_DOUBLE, values.data()), 0);
    const Handle words(H5Acreate2(file, "words", H5T_C_S1, space, H5P_DEFAULT, H5P_DEFAULT));
    ASSERT_GE(H5Awrite(words, H5T_C_S1, values.data()), 0);
  }
  test::expect_refused([&] { (void)hdf5::read_number(file, "numbers"); }, {"attribute numbers", "a number"});
  test::expect_refused([&] { (void)hdf5::read_text(file, "words"); }, {"attribute words", "a text"});
}

/// Whichever byte is another: told, or it had no meaning.
TEST(Hdf5Handle, TellsOfEveryDamagedByte) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("a.h5");
  std::vector<double> values(40);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = 1.0 / static_cast<double>(i + 1);
  test::write_hdf5(path, [&](hid_t file) {
    hdf5::write_attribute(file, "text", std::string("-seed 1"));
    const Handle group = hdf5::create_group(file, "group");
    hdf5::write<double>(group, "x", values);
    hdf5::write<std::int32_t>(group, "pairs", std::vector<std::int32_t>{1, 2, 3, 4, 5, 6}, 2);
  });
  std::ifstream whole(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(whole), {}};
  std::size_t told = 0;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x41);
    std::ofstream(path, std::ios::binary) << damaged;
    try {
      const Handle file = hdf5::open_file(path);
      EXPECT_EQ(hdf5::read_text(file, "text"), "-seed 1") << at;
      EXPECT_EQ(hdf5::read<double>(file, "group/x"), values) << at;
      EXPECT_EQ(hdf5::read<std::int32_t>(file, "group/pairs"), (std::vector<std::int32_t>{1, 2, 3, 4, 5, 6}))
          << at;
    } catch (const InputError&) {
      ++told;
    }
  }
  EXPECT_GT(told, values.size() * sizeof(double)) << "every byte of the values, at least";
}

/// A dataset of ten numbers, made and written to as `make` does.
template <class Make>
void expect_missing(Make make, const std::vector<std::string>& words) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("a.h5");
  const Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE));
  const hsize_t size = 10;
  const Handle space(H5Screate_simple(1, &size, nullptr));
  make(folder, static_cast<hid_t>(properties), static_cast<hid_t>(space));
  {
    const Handle data(H5Dcreate2(file, "x", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, properties, H5P_DEFAULT));
    ASSERT_GE(data, 0);
  }
  test::expect_refused([&] { (void)hdf5::read<double>(file, "x"); }, words);
}

TEST(Hdf5Handle, RefusesValuesThatAreNotThere) {
  expect_missing([](const auto&, hid_t, hid_t) {}, {"dataset /x", "ever written"});
  expect_missing(
      [](const auto&, hid_t properties, hid_t) {
        const hsize_t chunk = 4;
        H5Pset_chunk(properties, 1, &chunk);
      },
      {"dataset /x", "ever written"});
  expect_missing(
      [](const auto& folder, hid_t properties, hid_t space) {
        H5Pset_virtual(properties, space, folder.path("gone.h5").c_str(), "x", space);
      },
      {"dataset /x", "gone.h5 is not there"});
  expect_missing(
      [](const auto& folder, hid_t properties, hid_t space) {
        test::write_hdf5(folder.path("short.h5"),
                         [](hid_t file) { hdf5::write<double>(file, "x", std::vector<double>(9, 1.0)); });
        H5Pset_virtual(properties, space, folder.path("short.h5").c_str(), "x", space);
      },
      {"dataset /x", "smaller than what is taken"});
  expect_missing([](const auto& folder, hid_t properties,
                    hid_t) { H5Pset_external(properties, folder.path("gone.bin").c_str(), 0, 80); },
                 {"dataset /x", "gone.bin is no file"});
  expect_missing(
      [](const auto& folder, hid_t properties, hid_t) {
        std::ofstream(folder.path("short.bin")) << std::string(79, 'x');
        H5Pset_external(properties, folder.path("short.bin").c_str(), 0, 80);
      },
      {"dataset /x", "short.bin is too short"});
}

/// What a dataset says itself about values that nobody wrote is data.
TEST(Hdf5Handle, ReadsAFillValueThatWasGiven) {
  const hdf5::NewFile file;
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE));
  const double fill = 2.5;
  const hsize_t size = 3;
  const Handle space(H5Screate_simple(1, &size, nullptr));
  H5Pset_fill_value(properties, H5T_NATIVE_DOUBLE, &fill);
  (void)Handle(H5Dcreate2(file, "x", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, properties, H5P_DEFAULT));
  EXPECT_EQ(hdf5::read<double>(file, "x"), (std::vector<double>{fill, fill, fill}));
}

/// Opening a pipe would wait for its other end for ever.
TEST(Hdf5Handle, FollowsLinksToPlainFilesOnly) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(mkfifo(folder.path("pipe").c_str(), 0600), 0);
  write_thousand(folder.path("there.h5"));
  const Handle file(H5Fcreate(folder.path("a.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  H5Lcreate_external("pipe", "x", file, "piped", H5P_DEFAULT, H5P_DEFAULT);
  H5Lcreate_external("gone.h5", "x", file, "gone", H5P_DEFAULT, H5P_DEFAULT);
  H5Lcreate_external("there.h5", "x", file, "linked", H5P_DEFAULT, H5P_DEFAULT);
  EXPECT_EQ(hdf5::read<double>(file, "linked").size(), 1000u);
  EXPECT_TRUE(hdf5::exists(file, "gone")) << "a link that leads nowhere is not the same as none";
  test::expect_refused([&] { (void)hdf5::read<double>(file, "gone"); }, {"dataset /gone"});
  test::expect_refused([&] { (void)hdf5::read<double>(file, "piped"); }, {"dataset /piped", "no plain file"});
}

}  // namespace
}  // namespace crackle
