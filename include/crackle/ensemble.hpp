/// Breaks the samples of a run, one after the other, and keeps what they leave behind.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/disorder.hpp"
#include "crackle/equilibrium.hpp"
#include "crackle/fracture.hpp"
#include "crackle/run_file.hpp"

namespace crackle {

enum class Monitor : std::uint8_t {
  automatic,  ///< a progress bar on a terminal, a line a minute elsewhere
  none,
};

struct EnsembleOptions {
  std::int64_t samples = 1;
  std::int64_t first_sample = 0;
  StopRule stop;
  Monitor monitor = Monitor::automatic;
};

/// What every sample of a run has in common.
struct Run {
  const EnsembleOptions& ensemble;
  const DisorderOptions& disorder;
  const RecordOptions& record;
  std::span<const double> threshold;  ///< with disorder.from_file; else empty
  double row_spacing = 1;             ///< height of a profile's section
};

/// Breaks the samples that `file` does not have yet. When one can't be broken (SolverError), those before it
/// are on disk.
void run_ensemble(const Run& run, Equilibrium& equilibrium, RunFile& file, PhaseTimes& times);

/// RunFile::finish, its time counted as output.
std::vector<SampleSummary> finish(RunFile& file, PhaseTimes& times);

}  // namespace crackle
