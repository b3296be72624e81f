#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "crackle/base/error.hpp"
#include "crackle/record/run_merge.hpp"
#include "crackle/record/shards.hpp"
#include "support/expect_refused.hpp"
#include "support/sample_records.hpp"
#include "support/temporary_folder.hpp"

namespace crackle {
namespace {

namespace fs = std::filesystem;

const RecordOptions kAll{.parts = {"breaks", "profile", "snapshot"}};
const RunHeader kHeader{.options = "-seed 1\n"};

/// A folder for the shards of run.h5.
std::string begin(const test::TemporaryFolder& folder) {
  const std::string output = folder.path("run.h5");
  fs::create_directories(shard_folder(output));
  return output;
}

std::vector<std::string> names(const std::string& output) {
  std::vector<std::string> found;
  for (const std::string& path : shard_paths(output)) found.push_back(fs::path(path).filename().string());
  return found;
}

TEST(Shards, ProcessesTakeNumbersInTurnAndLeaveThoseThatAreThere) {
  const test::TemporaryFolder folder;
  const std::string output = begin(folder);
  std::ofstream(shard_folder(output) + "/3.h5") << "of an earlier run";
  ShardWriter first(output, kHeader, kAll, 0, 2);
  ShardWriter second(output, kHeader, kAll, 1, 2);
  for (std::int64_t index = 0; index < 4; ++index) {
    ShardWriter& writer = index % 2 == 0 ? first : second;
    writer.add(test::sample_record(index));
    EXPECT_TRUE(writer.waiting());
    writer.flush();
    EXPECT_FALSE(writer.waiting());
  }
  EXPECT_EQ(names(output), (std::vector<std::string>{"0.h5", "1.h5", "2.h5", "3.h5", "5.h5"}));
}

TEST(Shards, ManyBecomeOne) {
  const test::TemporaryFolder folder;
  const std::string output = begin(folder);
  ShardWriter writer(output, kHeader, kAll, 0, 1);
  std::vector<std::int64_t> indices;
  for (std::int64_t index = 0; index <= kShardsTogether; ++index) {
    writer.add(test::sample_record(index));
    writer.flush();
    indices.push_back(index);
  }
  EXPECT_EQ(names(output).size(), 2u);
  test::expect_samples(gather_samples(shard_paths(output), true), indices);
}

TEST(Shards, SamplesStayWaitingWhenTheyCanNotBeWritten) {
  const test::TemporaryFolder folder;
  const std::string output = begin(folder);
  fs::remove(shard_folder(output));
  ShardWriter writer(output, kHeader, kAll, 0, 1);
  writer.add(test::sample_record(7));
  EXPECT_THROW(writer.flush(), std::runtime_error);
  fs::create_directories(shard_folder(output));
  writer.flush();
  test::expect_samples(gather_samples(shard_paths(output), true), {7});
}

TEST(Shards, CheckpointsAreReadAndGoWithTheirSample) {
  const test::TemporaryFolder folder;
  const std::string output = begin(folder);
  ShardWriter writer(output, kHeader, kAll, 0, 1);
  constexpr BondId kBonds = 100;
  EXPECT_FALSE(writer.read_checkpoint(5, kBonds));
  writer.write_checkpoint(test::sample_record(5));
  const auto begun = writer.read_checkpoint(5, kBonds);
  ASSERT_TRUE(begun);
  test::expect_same(*begun, test::sample_record(5));
  test::expect_refused([&] { (void)writer.read_checkpoint(5, 4); }, {"5.checkpoint"});
  fs::copy(checkpoint_path(output, 5), checkpoint_path(output, 6));
  test::expect_refused([&] { (void)writer.read_checkpoint(6, kBonds); }, {"6.checkpoint", "sample 6"});
  EXPECT_TRUE(shard_paths(output).empty()) << "no finished sample";
  writer.add(test::sample_record(5));
  writer.flush();
  EXPECT_EQ(checkpoint_paths(output), std::vector{checkpoint_path(output, 6)});
}

/// Whatever is recorded, a checkpoint has the breaks.
TEST(Shards, CheckpointsHaveTheBreaksInAnyCase) {
  const test::TemporaryFolder folder;
  const std::string output = begin(folder);
  const RecordOptions none{.parts = {}};
  const ShardWriter writer(output, kHeader, none, 0, 1);
  writer.write_checkpoint(test::sample_record(2));
  EXPECT_EQ(writer.read_checkpoint(2, 100)->bond, test::sample_record(2).bond);
}

}  // namespace
}  // namespace crackle
