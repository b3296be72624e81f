#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "crackle/hdf5_handle.hpp"
#include "support/expect_refused.hpp"
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
  const Handle file = hdf5::create_file(folder.path("a.h5"));
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
      Handle file = hdf5::create_file(folder.path("a.h5"));
      const Handle group = hdf5::create_group(file, "group");
      hdf5::write<double>(group, "x", std::vector{1.0});
      hdf5::write_attribute(group, "a", 1.0);
      (void)hdf5::read<double>(group, "x");
      (void)hdf5::read_number(group, "a");
      EXPECT_THROW((void)hdf5::read<double>(file, "group"), InputError);
      Handle moved = std::move(file);
      EXPECT_LT(file, 0);  // NOLINT(bugprone-use-after-move): what a move leaves is what is tested
      EXPECT_TRUE(hdf5::exists(moved, "group/x"));
      EXPECT_EQ(open_ids(), before + 2);
    }
    EXPECT_EQ(open_ids(), before);
  }
  {
    const test::TemporaryFolder folder;
    const Handle file = hdf5::create_file(folder.path("a.h5"));
    const Handle group = hdf5::create_group(file, "group");
    hdf5::write<double>(group, "x", std::vector{1.0});
    EXPECT_TRUE(hdf5::exists(file, "group"));
    EXPECT_TRUE(hdf5::exists(file, "group/x"));
    EXPECT_FALSE(hdf5::exists(file, "group/y"));
    EXPECT_FALSE(hdf5::exists(file, "other/x"));
  }
}

TEST(Hdf5Handle, RefusesFilesByTheirName) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("a.h5");
  test::expect_refused([&] { (void)hdf5::open_file(path); }, {path, "exists"});
  test::expect_refused([&] { (void)hdf5::create_file(folder.path("no/a.h5")); }, {folder.path("no/a.h5")});
  test::expect_refused([&] { (void)hdf5::open_file(folder.path()); }, {folder.path(), "HDF5"});
  std::ofstream(path) << "not HDF5";
  test::expect_refused([&] { (void)hdf5::open_file(path); }, {path, "whole, readable HDF5"});
  {
    const Handle file = hdf5::create_file(path);
    hdf5::write<double>(file, "x", std::vector<double>(1000, 1.0));
  }
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  test::expect_refused([&] { (void)hdf5::open_file(path); }, {path, "whole, readable HDF5"});
}

TEST(Hdf5Handle, RefusesDatasetsAndAttributesByTheirName) {
  {
    const test::TemporaryFolder folder;
    const Handle file = hdf5::create_file(folder.path("a.h5"));
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
    const Handle file = hdf5::create_file(folder.path("a.h5"));
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
  const Handle file = hdf5::create_file(folder.path("a.h5"));
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

}  // namespace
}  // namespace crackle
