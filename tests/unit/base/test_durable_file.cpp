#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "crackle/base/durable_file.hpp"
#include "crackle/base/output_lock.hpp"
#include "support/expect_refused.hpp"
#include "support/temporary_folder.hpp"

namespace crackle {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

std::string text_of(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(DurableFile, ReplacesAFileWholeAndKeepsItsPermissions) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("a");
  for (const std::string& text : {std::string("one"), std::string(), std::string(3'000'000, 'x')}) {
    write_durably(path, folder.path("a.part"), bytes_of(text));
    EXPECT_EQ(text_of(path), text);
    EXPECT_FALSE(fs::exists(folder.path("a.part")));
  }
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  write_durably(path, folder.path("a.part"), bytes_of("two"));
  EXPECT_EQ(fs::status(path).permissions(),
            fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
}

/// A link that stands where the new file is written first must not lead to another's file.
TEST(DurableFile, WritesToNoFileButItsOwn) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path("thesis")) << "a thesis";
  fs::create_symlink(folder.path("thesis"), folder.path("a.part"));
  write_durably(folder.path("a"), folder.path("a.part"), bytes_of("one"));
  EXPECT_EQ(text_of(folder.path("a")), "one");
  EXPECT_EQ(text_of(folder.path("thesis")), "a thesis");
}

TEST(DurableFile, LeavesWhatIsThereWhenItCanNotWrite) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path("a")) << "one";
  test::expect_refused<WriteError>(
      [&] { write_durably(folder.path("a"), folder.path("no/a.part"), bytes_of("two")); },
      {folder.path("a"), "No such file"});
  EXPECT_EQ(text_of(folder.path("a")), "one");
  fs::create_directory(folder.path("b"));
  std::ofstream(folder.path("b/c")) << "one";
  test::expect_refused<WriteError>(
      [&] { write_durably(folder.path("b"), folder.path("a.part"), bytes_of("two")); }, {folder.path("b")});
  EXPECT_FALSE(fs::exists(folder.path("a.part")));
}

TEST(DurableFile, FollowsLinksToTheirEnd) {
  const test::TemporaryFolder folder;
  fs::create_directory(folder.path("scratch"));
  fs::create_symlink("scratch/run.h5", folder.path("near"));
  fs::create_symlink(folder.path("near"), folder.path("far"));
  fs::create_symlink("loop", folder.path("loop"));
  EXPECT_EQ(follow_links(folder.path("a")), folder.path("a"));
  EXPECT_EQ(follow_links(folder.path("far")), folder.path("scratch/run.h5"));
  test::expect_refused([&] { (void)follow_links(folder.path("loop")); }, {folder.path("loop"), "links"});
}

TEST(OutputLock, IsOneProgramsAndLeavesNothing) {
  const test::TemporaryFolder folder;
  const std::string output = folder.path("run.h5");
  {
    OutputLock first;
    first.take(output);
    first.take(output);
    OutputLock second;
    test::expect_refused([&] { second.take(output); }, {"-output", output, "no other run"});
    std::ofstream(shard_folder(output) + "/0.h5") << "a shard";
    first.clear();
    EXPECT_FALSE(fs::exists(shard_folder(output) + "/0.h5"));
    test::expect_refused([&] { second.take(output); }, {"-output", output});
    first.release();
    second.take(output);
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(OutputLock, LeavesShardsAndTheLockOfAKilledRun) {
  const test::TemporaryFolder folder;
  const std::string output = folder.path("run.h5");
  fs::create_directory(shard_folder(output));
  std::ofstream(shard_folder(output) + "/lock") << "";
  std::ofstream(shard_folder(output) + "/0.h5") << "a shard";
  {
    OutputLock lock;
    lock.take(output);
  }
  EXPECT_TRUE(fs::exists(shard_folder(output) + "/lock"));
  EXPECT_TRUE(fs::exists(shard_folder(output) + "/0.h5"));
}

TEST(OutputLock, SaysWhyAnOutputCanNotBeWritten) {
  const test::TemporaryFolder folder;
  EXPECT_NO_THROW(check_writable(folder.path("a")));
  test::expect_refused([&] { check_writable(folder.path()); }, {"-output", "a folder"});
  test::expect_refused([&] { check_writable(folder.path("no/a")); }, {"-output", "No such file", "folder"});
  ASSERT_EQ(mkfifo(folder.path("pipe").c_str(), 0600), 0);
  test::expect_refused([&] { check_writable(folder.path("pipe")); }, {"-output", "no plain file"});
}

}  // namespace
}  // namespace crackle
