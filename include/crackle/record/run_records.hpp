/// One file of the run file's schema, written and read whole.
///
///     /                      attributes: schema_version, code_version, options (one "-name value" a line), created;
///                            deciding_options: the names of those that decide results, one a line;
///                            nodes, components, bonds: N, c, M; network_checksum, of a network from a file
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

#include "crackle/base/durable_file.hpp"
#include "crackle/network/network.hpp"
#include "crackle/record/record.hpp"
#include "crackle/record/run_header.hpp"

namespace crackle {

/// 2: every dataset has a checksum.
inline constexpr std::int32_t kSchemaVersion = 2;

/// Header and records, in the order given, as the bytes of a file.
[[nodiscard]] Bytes format_run(const RunHeader& header, const RecordOptions& record,
                               std::span<const SampleRecord> records);

/// The same with the group /network of the file `network_from`, without thresholds of one sample when records are more.
[[nodiscard]] Bytes format_run(const RunHeader& header, const RecordOptions& record,
                               std::span<const SampleRecord> records, const std::string& network_from);

/// Every sample of a run file, in its order. Throws InputError, naming it, for one that is not a whole run
/// file of this schema, has a part that its options don't ask for missing, or is refused by check_records.
[[nodiscard]] std::vector<SampleRecord> read_records(const std::string& path);

/// What stands at the head of a run file, but for the network. Throws InputError as read_records does.
[[nodiscard]] RunHeader read_header(const std::string& path);

/// The parts that a run file has.
[[nodiscard]] RecordOptions read_parts(const std::string& path);

}  // namespace crackle
