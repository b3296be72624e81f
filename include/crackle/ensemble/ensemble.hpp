/// Breaks the samples of a run, shared out among its processes, and keeps what they leave behind.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "crackle/base/ranks.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/fracture/fracture.hpp"
#include "crackle/network/disorder.hpp"
#include "crackle/record/run_file.hpp"

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
  int ranks_per_sample = 1;      ///< processes that break a sample together
  double checkpoint_every = 60;  ///< seconds after which an unfinished sample is kept, at the next chance
  std::int64_t checkpoint_breaks = 0;  ///< breaks from chance to chance; 0: what the strategy takes for cheap
};

/// What every sample of one size of a run has in common.
struct Run {
  const Network& network;
  const ChosenStrategy& equilibrium;
  const EnsembleOptions& ensemble;
  const DisorderOptions& disorder;
  const OutputOptions& output;
  const RunHeader& header;
  std::span<const double> threshold;  ///< [M] or [S * M], with disorder.from_file; else empty
  double section_height = 1;          ///< of a profile
  std::string name{};                 ///< of this size, where there are several
  /// Called in the first process when it is done with this size; may be empty.
  std::function<void(const Equilibrium&)> inspect{};
};

/// Those of sample `index`: drawn, or the row of the network file, whose only one serves any. Size of `threshold`: bonds.
/// Throws InputError as draw_thresholds does.
void thresholds_of(const Run& run, std::int64_t index, std::span<double> threshold);

/// What became of one size of a run, summed over all processes in the first one.
struct RunTotals {
  EquilibriumCounts counts;
  PhaseTimes times;
  double seconds = 0;  ///< of all groups, together, from the strategy's making on
};

/// Whose samples take longest and are handed out first.
[[nodiscard]] std::size_t largest_run(std::span<const Run> runs);

/// Breaks the samples that the files do not have yet: files of the runs in the first process, none elsewhere.
///
/// `ready`: the strategy of largest_run, made with the times of its totals. Collective over all processes. When
/// a signal or an error ends the run early, the result says so, and finished samples are on disk but for those
/// of an output that can't be written.
struct EnsembleEnd {
  int signal = 0;         ///< 0: none
  std::string complaint;  ///< what was wrong, of the first process that met something; empty: nothing
};
[[nodiscard]] EnsembleEnd run_ensemble(std::span<const Run> runs, const Ranks& ranks,
                                       std::span<const std::unique_ptr<RunFile>> files,
                                       std::unique_ptr<Equilibrium> ready, std::vector<RunTotals>& totals);

/// RunFile::finish, its time counted as output.
std::vector<SampleSummary> finish(RunFile& file, PhaseTimes& times);

}  // namespace crackle
