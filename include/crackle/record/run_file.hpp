/// The run file: what a run leaves behind, and keeps while it goes on.
///
/// Its schema: see run_records.hpp; what stands beside it while the run goes on: see shards.hpp.
///
/// Samples are ordered by index. A kill loses at most what was not yet a shard (kFlushSeconds). At the end shards are
/// merged into OUTPUT, and their folder goes, unless somebody has put something else there.
#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "crackle/base/output_lock.hpp"
#include "crackle/record/run_records.hpp"
#include "crackle/record/shards.hpp"

namespace crackle {

struct OutputOptions {
  std::string path = "crackle.h5";
  bool resume = false;     ///< continue the run that `path` holds
  bool overwrite = false;  ///< replace it
  int writers = 1;         ///< processes that write shards; this one's numbers are 0, writers, ...
  RecordOptions record;
};

class RunFile {
 public:
  /// Throws InputError when the output can't be written, exists and neither resume nor overwrite is set, is
  /// written by another run, or holds a run (-resume) of another network file or with other options that decide
  /// results: the message names them. What is there stays as it is until the first sample is done. Symbolic links must
  /// have been followed (follow_links).
  RunFile(OutputOptions options, RunHeader header);
  ~RunFile() = default;
  RunFile(const RunFile&) = delete;
  RunFile& operator=(const RunFile&) = delete;

  /// Samples that the resumed run has.
  [[nodiscard]] const std::set<std::int64_t>& finished() const { return finished_; }

  /// From here on the output is this run's, and its folder of shards is there: an old run goes unless it is
  /// resumed. Once a sample is done; later calls do nothing. Throws InputError when another run was faster.
  void claim();

  /// Takes a finished sample; claims the output and writes a shard when the last one is kFlushSeconds old.
  void add(SampleRecord record);

  /// Writes what waits. Called before anything that may end the run.
  void flush();

  /// Merges everything into the output and returns all of its samples, ordered by index; the last call. Shards go only
  /// when the whole output is on disk.
  std::vector<SampleSummary> finish();

 private:
  void resume();
  void check_scene(const std::string& path) const;
  void write_output(std::span<const SampleRecord> records) const;
  void clear_folder(const std::set<std::int64_t>& merged) const;

  OutputOptions options_;
  RunHeader header_;
  std::set<std::int64_t> finished_;
  ShardWriter shards_;
  OutputLock lock_;
  bool claimed_ = false;  ///< the output is ours
};

}  // namespace crackle
