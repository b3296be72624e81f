/// The run file: what a run leaves behind, and keeps while it goes on.
///
/// Its schema: see run_records.hpp.
///
/// Samples are ordered by index. While a run goes on, finished samples stand in OUTPUT.shards/, in files of
/// this same schema, each written whole under another name, synced and renamed: a kill loses at most what was
/// not yet a shard (kFlushSeconds). At the end they are merged into OUTPUT, likewise, and the folder goes.
#pragma once

#include <chrono>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "crackle/run_records.hpp"

namespace crackle {

/// Samples wait at most this long for a shard.
inline constexpr double kFlushSeconds = 1.0;

struct OutputOptions {
  std::string path = "crackle.h5";
  bool resume = false;     ///< continue the run that `path` holds
  bool overwrite = false;  ///< replace it
  RecordOptions record;
};

class RunFile {
 public:
  /// Throws InputError when the output can't be written, exists and neither resume nor overwrite is set, or
  /// holds a run (-resume) of another network file or with other options that decide results: the message
  /// names them. What is there stays as it is until the first sample is done.
  RunFile(OutputOptions options, RunHeader header);

  /// Samples that the resumed run has.
  [[nodiscard]] const std::set<std::int64_t>& finished() const { return finished_; }

  /// Takes a finished sample; writes a shard when the last one is kFlushSeconds old.
  void add(SampleRecord record);

  /// Writes what waits. Called before anything that may end the run.
  void flush();

  /// Merges everything into the output and returns all of its samples, ordered by index; the last call.
  std::vector<SampleSummary> finish();

 private:
  void resume();
  void check_writable() const;
  void claim();
  [[nodiscard]] std::vector<SampleRecord> collect() const;
  void write_atomically(const std::string& path, std::span<const SampleRecord> records) const;

  OutputOptions options_;
  RunHeader header_;
  std::string shard_folder_;
  std::set<std::int64_t> finished_;
  std::vector<SampleRecord> waiting_;
  std::chrono::steady_clock::time_point last_flush_;
  int shards_ = 0;
  bool claimed_ = false;  ///< the output is ours
};

}  // namespace crackle
