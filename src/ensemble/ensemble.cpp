#include "crackle/ensemble/ensemble.hpp"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <type_traits>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/ensemble/workplace.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"

namespace crackle {

namespace {

using Clock = std::chrono::steady_clock;

void add(EquilibriumCounts& sum, const EquilibriumCounts& more) {
  sum.breaks += more.breaks;
  sum.factorizations += more.factorizations;
  sum.refactors += more.refactors;
  sum.confirmations += more.confirmations;
  sum.refereed += more.refereed;
  sum.held += more.held;
  sum.soft_contrast = std::max(sum.soft_contrast, more.soft_contrast);
  sum.largest_left = std::max(sum.largest_left, more.largest_left);
  if (more.soft_node >= 0 && (sum.soft_node < 0 || more.soft_pivot < sum.soft_pivot)) {
    sum.soft_node = more.soft_node;
    sum.soft_bonds = more.soft_bonds;
    sum.soft_pivot = more.soft_pivot;
  }
  sum.iterations += more.iterations;
  sum.checks += more.checks;
  if (sum.doubtful == 0 || (more.doubtful > 0 && more.first_doubtful < sum.first_doubtful)) {
    sum.first_doubtful = more.first_doubtful;
  }
  sum.doubtful += more.doubtful;
  sum.loosest_residual = std::max(sum.loosest_residual, more.loosest_residual);
  sum.null_pivots = std::max(sum.null_pivots, more.null_pivots);
  sum.unknowns = std::max(sum.unknowns, more.unknowns);
  sum.factor_entries = std::max(sum.factor_entries, more.factor_entries);
  sum.smallest_slack = std::min(sum.smallest_slack, more.smallest_slack);
  sum.largest_residual = std::max(sum.largest_residual, more.largest_residual);
}

/// Work of a sample relative to that of others: as many breaks as unknowns, each of which costs about as many
/// operations.
double work_of(const Run& run) {
  const double n = run.network.unknowns;
  return n * n;
}

/// The runs, those of the longest samples first.
std::vector<int> order_of(std::span<const Run> runs) {
  std::vector<int> order(runs.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::ranges::greater{}, [&](int i) { return work_of(runs[i]); });
  return order;
}

SampleQueue make_queue(std::span<const Run> runs, const Ranks& ranks,
                       std::span<const std::unique_ptr<RunFile>> files) {
  SampleQueue queue(ranks.groups());
  if (!ranks.first()) return queue;
  for (const int i : order_of(runs)) {
    const EnsembleOptions& options = runs[i].ensemble;
    queue.append(i, options.first_sample, options.first_sample + options.samples, files[i]->finished());
  }
  return queue;
}

std::vector<ProgressPart> make_parts(std::span<const Run> runs, const SampleQueue& queue) {
  std::vector<ProgressPart> parts;
  for (std::size_t i = 0; i < runs.size(); ++i)
    parts.push_back({runs[i].name, queue.left(static_cast<int>(i)), work_of(runs[i])});
  return parts;
}

/// From the first question of this process to its last report.
class Worker {
 public:
  Worker(std::span<const Run> runs, const Ranks& ranks, HandOut& hand_out, std::vector<RunTotals>& totals,
         std::unique_ptr<Equilibrium> ready)
      : runs_(runs), ranks_(ranks), hand_out_(hand_out), totals_(totals), ready_(std::move(ready)) {}

  RunEnd work() {
    Report report;
    while (true) {
      const Answer answer = hand_out_.next(report);
      report = {};
      if (place_ && answer.claimed) place_->allow_writing();
      const bool moves = place_ && (!answer.work || answer.chunk.run != place_->number());
      if (place_) place_->save(report, moves);
      if (moves) leave_place();
      if (!answer.work) break;
      if (!place_ && !take_place(answer.chunk.run)) continue;
      place_->break_chunk(answer.chunk, report);
      report.waiting = place_->waiting();
      count_seconds();
    }
    return hand_out_.leave(report);
  }

 private:
  /// False: the strategy can't be made.
  bool take_place(int run) {
    start_ = Clock::now();
    PhaseTimes& times = totals_[run].times;
    try {
      const bool is_ready = ready_ && run == static_cast<int>(largest_run(runs_));
      auto equilibrium =
          is_ready ? std::move(ready_) : make_equilibrium(runs_[run].network, runs_[run].equilibrium, times);
      ready_.reset();
      place_ = std::make_unique<Workplace>(runs_[run], run, std::move(equilibrium), ranks_, hand_out_, times);
    } catch (const std::exception& error) {
      hand_out_.fail(explain(error));
    }
    return place_ != nullptr;
  }

  void leave_place() {
    count_seconds();
    add(totals_[place_->number()].counts, place_->equilibrium().counts());
    const Run& run = runs_[place_->number()];
    if (ranks_.first() && run.inspect) run.inspect(place_->equilibrium());
    place_.reset();
  }

  void count_seconds() {
    const auto now = Clock::now();
    totals_[place_->number()].seconds += std::chrono::duration<double>(now - start_).count();
    start_ = now;
  }

  std::span<const Run> runs_;
  const Ranks& ranks_;
  HandOut& hand_out_;
  std::vector<RunTotals>& totals_;
  std::unique_ptr<Equilibrium> ready_;
  std::unique_ptr<Workplace> place_;
  Clock::time_point start_;
};

/// The sums over all groups, in the first process.
void gather(std::vector<RunTotals>& totals, const Ranks& ranks) {
  static_assert(std::is_trivially_copyable_v<RunTotals>);
  if (!ranks.leader() || ranks.groups() == 1) return;
  const int bytes = static_cast<int>(totals.size() * sizeof(RunTotals));
  std::vector<RunTotals> all(ranks.first() ? totals.size() * ranks.groups() : 0);
  MPI_Gather(totals.data(), bytes, MPI_BYTE, all.data(), bytes, MPI_BYTE, 0, ranks.leaders());
  for (std::size_t i = totals.size(); i < all.size(); ++i) {
    RunTotals& sum = totals[i % totals.size()];
    add(sum.counts, all[i].counts);
    sum.seconds += all[i].seconds;
    for (std::size_t phase = 0; phase < kPhases; ++phase)
      sum.times.seconds[phase] += all[i].times.seconds[phase];
  }
}

}  // namespace

void thresholds_of(const Run& run, std::int64_t index, std::span<double> threshold) {
  if (!run.disorder.from_file) return draw_thresholds(run.disorder, index, threshold);
  const bool one_row = run.threshold.size() == threshold.size();
  const std::size_t row = one_row ? 0 : static_cast<std::size_t>(index);
  std::ranges::copy(run.threshold.subspan(row * threshold.size(), threshold.size()), threshold.begin());
}

std::size_t largest_run(std::span<const Run> runs) {
  return static_cast<std::size_t>(order_of(runs).front());
}

EnsembleEnd run_ensemble(std::span<const Run> runs, const Ranks& ranks,
                         std::span<const std::unique_ptr<RunFile>> files, std::unique_ptr<Equilibrium> ready,
                         std::vector<RunTotals>& totals) {
  SampleQueue queue = make_queue(runs, ranks, files);
  const bool silent = !ranks.first() || runs.front().ensemble.monitor == Monitor::none;
  Progress progress(make_parts(runs, queue), ranks.groups(), silent);
  HandOut hand_out(ranks, queue, progress, [&](int run) { files[run]->claim(); });
  const RunEnd end = Worker(runs, ranks, hand_out, totals, std::move(ready)).work();
  gather(totals, ranks);
  return {end.signal, end.complaint.data()};
}

std::vector<SampleSummary> finish(RunFile& file, PhaseTimes& times) {
  const PhaseScope scope(times, Phase::output);
  return file.finish();
}

}  // namespace crackle
