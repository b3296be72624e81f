/// One file of the run file's schema (see run_file.hpp), written and read whole.
#pragma once

#include <span>
#include <string>

#include "crackle/hdf5_handle.hpp"
#include "crackle/run_file.hpp"

namespace crackle {

/// Writes header and records, in the order given, as a new file.
void write_run(const std::string& path, const RunHeader& header, const RecordOptions& record,
               std::span<const SampleRecord> records);

}  // namespace crackle
