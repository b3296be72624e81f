/// What a run has of its samples while it goes on: OUTPUT.shards/, with
///
///     N.h5            finished samples, a run file (see run_records)
///     N.checkpoint    sample N as it was when it settled last, likewise, with its breaks
///     lock            held by the program that writes here (see output_lock)
///
/// Every file is written as durable_file does. Each process writes shards of its own.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "crackle/base/output_lock.hpp"
#include "crackle/record/run_records.hpp"

namespace crackle {

/// Finished samples wait at most this long for a shard.
inline constexpr double kFlushSeconds = 2.0;  // syncing takes about 10 ms
/// So many shards of a process become one.
inline constexpr int kShardsTogether = 64;

/// How the name of a checkpoint ends.
inline constexpr const char* kCheckpoint = ".checkpoint";

/// The shards of a run, by name; empty when there is no folder.
[[nodiscard]] std::vector<std::string> shard_paths(const std::string& output);
[[nodiscard]] std::vector<std::string> checkpoint_paths(const std::string& output);
[[nodiscard]] std::string checkpoint_path(const std::string& output, std::int64_t sample);

/// write_durably; a WriteError says what a run can do then.
void write_for_run(const std::string& path, const std::string& temporary, std::span<const std::byte> content);

class ShardWriter {
 public:
  /// header and record outlive this. Shards get the numbers first, first + step, ...
  ShardWriter(std::string output, const RunHeader& header, const RecordOptions& record, int first, int step);

  /// Takes a finished sample. It is on disk after the next flush.
  void add(SampleRecord record);

  /// Samples wait, and the last flush was kFlushSeconds ago.
  [[nodiscard]] bool due() const;

  /// Writes what waits; the folder must be there. Samples stay waiting when that throws.
  void flush();
  [[nodiscard]] bool waiting() const { return !waiting_.empty(); }

  /// Keeps a sample that has settled, to be resumed.
  void write_checkpoint(const SampleRecord& begun) const;
  /// What was kept of a sample of a network of so many bonds. Throws InputError, naming the file, for one that
  /// can't be read or isn't that.
  [[nodiscard]] std::optional<SampleRecord> read_checkpoint(std::int64_t sample, BondId bonds) const;

 private:
  [[nodiscard]] std::string next_path();
  void gather();

  std::string output_;
  const RunHeader& header_;
  const RecordOptions& record_;
  int number_;
  int step_;
  std::vector<SampleRecord> waiting_;
  std::vector<std::string> own_;  ///< shards of this process that have not been put together
  std::chrono::steady_clock::time_point last_flush_;
};

}  // namespace crackle
