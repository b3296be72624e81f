#include "crackle/ensemble.hpp"

#include <memory>
#include <vector>

#include "crackle/observe_breaks.hpp"
#include "crackle/observe_profile.hpp"
#include "crackle/observe_snapshot.hpp"
#include "crackle/progress.hpp"

namespace crackle {

namespace {

/// Only the observers that the scene asks for.
std::vector<std::unique_ptr<Observer>> make_observers(const Run& run, const Network& network,
                                                      SampleRecord& record) {
  std::vector<std::unique_ptr<Observer>> observers;
  if (run.record.breaks) observers.push_back(std::make_unique<ObserveBreaks>(record));
  if (run.record.profile)
    observers.push_back(std::make_unique<ObserveProfile>(network, run.row_spacing, record));
  if (run.record.snapshot)
    observers.push_back(std::make_unique<ObserveSnapshot>(run.record.snapshot_at, record));
  return observers;
}

void break_samples(const Run& run, Equilibrium& equilibrium, RunFile& file, PhaseTimes& times) {
  SampleRecord record;
  const auto owned = make_observers(run, equilibrium.network(), record);
  std::vector<Observer*> observers;
  observers.reserve(owned.size());
  for (const auto& observer : owned) observers.push_back(observer.get());
  std::vector<double> threshold(run.threshold.begin(), run.threshold.end());
  threshold.resize(equilibrium.network().lattice.bond.size());
  const std::int64_t first = run.ensemble.first_sample;
  const std::int64_t end = first + run.ensemble.samples;
  const auto& finished = file.finished();
  const auto had = std::distance(finished.lower_bound(first), finished.lower_bound(end));
  Progress progress(run.ensemble.samples - had, run.ensemble.monitor == Monitor::none);
  for (std::int64_t index = first; index < end; ++index) {
    if (finished.contains(index)) continue;
    if (!run.disorder.from_file) draw_thresholds(run.disorder, index, threshold);
    record.summary = break_sample(equilibrium, index, threshold, run.ensemble.stop, observers);
    {
      const PhaseScope scope(times, Phase::output);
      file.add(record);
    }
    progress.sample_done(record.summary);
  }
}

}  // namespace

void run_ensemble(const Run& run, Equilibrium& equilibrium, RunFile& file, PhaseTimes& times) {
  try {
    break_samples(run, equilibrium, file, times);
  } catch (...) {
    file.flush();
    throw;
  }
}

std::vector<SampleSummary> finish(RunFile& file, PhaseTimes& times) {
  const PhaseScope scope(times, Phase::output);
  return file.finish();
}

}  // namespace crackle
