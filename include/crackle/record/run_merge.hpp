/// Runs with other samples of one scene, from the jobs of an array, say, into one run file.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "crackle/record/record.hpp"

namespace crackle {

/// Every sample of these run files, ordered by number, each once. Of a sample that several have, the first file's
/// counts. `check`: throws InputError, naming both files, when it isn't the same in all, bit for bit, wall_time aside.
[[nodiscard]] std::vector<SampleRecord> gather_samples(std::span<const std::string> paths, bool check);

/// Writes the samples of all runs (of one that was cut short, what its shards hold) into a run file, whole or not at
/// all, and returns their numbers: as many, and as the first run's options would have made them. Symbolic links are
/// followed. overwrite: a run file that is there goes, and what an unfinished run has left beside it.
///
/// Throws InputError, naming the file, for one that is no whole run file, has other options that decide results
/// than the first or another network, or another result for a sample; for an output that exists, or that another program
/// is writing; WriteError when it can't write. The output is then as it was.
std::size_t merge_runs(std::span<const std::string> runs, const std::string& output, bool overwrite);

}  // namespace crackle
