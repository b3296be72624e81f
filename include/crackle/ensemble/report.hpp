/// The summary of a run: what came out, and where the time went.
#pragma once

#include <span>
#include <string>

#include "crackle/equilibrium/equilibrium.hpp"
#include "crackle/fracture/observer.hpp"

namespace crackle {

/// Mean and its standard error (0 for fewer than two values).
struct Estimate {
  double mean = 0;
  double error = 0;
};

[[nodiscard]] Estimate estimate(std::span<const double> values);

/// Prints means with standard errors over all samples of the file, then run time, time per break by phase and
/// what the strategy did for the breaks of this run. `seconds`: run time of all of it; of several processes, the sum.
void print_report(std::span<const SampleSummary> samples, const EquilibriumCounts& counts,
                  const PhaseTimes& times, double seconds, const std::string& path);

/// The whole run's, where it had several sizes or processes.
void print_run_time(double seconds, int processes);

/// That a signal ended the run, and how to go on.
void print_early_end(int signal);

}  // namespace crackle
