/// One file of the run file's schema, written and read whole.
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
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "crackle/network.hpp"
#include "crackle/record.hpp"

namespace crackle {

inline constexpr std::int32_t kSchemaVersion = 1;

/// What stands at the head of a run file.
struct RunHeader {
  std::string options;               ///< every option of the run, "-name value" a line, sorted by name
  std::string checksum;              ///< of a network from a file, which -resume compares; else empty
  const Network* network = nullptr;  ///< for -record network; else null
  std::vector<double> threshold{};   ///< written with it; may be empty
};

/// Writes header and records, in the order given, as a new file.
void write_run(const std::string& path, const RunHeader& header, const RecordOptions& record,
               std::span<const SampleRecord> records);

/// Every sample of a run file, in its order. Throws InputError, naming it, for one that is not a whole run
/// file.
[[nodiscard]] std::vector<SampleRecord> read_records(const std::string& path);

/// The text attribute `options` of a run file.
[[nodiscard]] std::string read_options_text(const std::string& path);

/// The text attribute `network_checksum`; empty: the run file has none.
[[nodiscard]] std::string read_checksum(const std::string& path);

}  // namespace crackle
