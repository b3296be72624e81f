/// The run file: what a run leaves behind, and keeps while it goes on.
///
///     /                      attributes: schema_version, code_version, options (one "-name value" a line), created;
///                            network_checksum, of a network that came from a file
///     /samples/NAME          [S] index, peak_load, peak_displacement, n_p, n_f, initial_stiffness, wall_time
///     /samples/break_offset  int64[S+1] where each sample's breaks start (with -record breaks, as all of /breaks)
///     /breaks/bond, load, stiffness       [B] int32, float64, float64
///     /profile/peak, failure              int32[S][sections]  (-record profile)
///     /snapshots/sample, number           [K] int64, int32    (-record snapshot)
///     /snapshots/displacement, force      float64[K][N * components], float64[K][M]
///     /network                            see network_file    (-record network)
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

#include "crackle/network.hpp"
#include "crackle/record.hpp"

namespace crackle {

inline constexpr std::int32_t kSchemaVersion = 1;
/// Samples wait at most this long for a shard.
inline constexpr double kFlushSeconds = 1.0;

struct OutputOptions {
  std::string path = "crackle.h5";
  bool resume = false;     ///< continue the run that `path` holds
  bool overwrite = false;  ///< replace it
  RecordOptions record;
};

/// What stands at the head of a run file.
struct RunHeader {
  std::string options;               ///< every option of the run, "-name value" a line, sorted by name
  std::string checksum;              ///< of a network from a file, which -resume compares; else empty
  const Network* network = nullptr;  ///< for -record network; else null
  std::vector<double> threshold;     ///< written with it; may be empty
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

/// Every sample of a run file, in its order. Throws InputError, naming it, for one that is not a whole run
/// file.
[[nodiscard]] std::vector<SampleRecord> read_records(const std::string& path);

/// The text attribute `options` of a run file.
[[nodiscard]] std::string read_options_text(const std::string& path);

}  // namespace crackle
