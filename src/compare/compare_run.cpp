#include "crackle/compare/compare_run.hpp"

#include <malloc.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <numeric>

#include "crackle/base/error.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/fracture/peak.hpp"
#include "crackle/scene/option_table.hpp"
#include "crackle/scene/scene.hpp"

namespace crackle {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
/// A strategy that does not see the end may go on by itself for so many breaks.
constexpr std::int64_t kMostBeyond = 1000;

/// Processor time of this process: what others do on the machine doesn't count.
double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double seconds_since(double start) {
  return processor_seconds() - start;
}

/// Bytes in use, of the heap and of what was mapped for large blocks.
std::int64_t bytes_in_use() {
  const auto info = mallinfo2();
  return static_cast<std::int64_t>(info.uordblks + info.hblkhd);
}

/// PETSc's options of the moment decide the strategy, and the scene's.
std::unique_ptr<Equilibrium> make_strategy(const CompareScene& scene, PhaseTimes& times) {
  ChosenStrategy options = read_strategy();
  options.common.break_on = scene.equilibrium.common.break_on;
  options.common.many_samples = false;
  return make_equilibrium(scene.network, options, times);
}

/// The first breaks, by `tree`.
std::vector<BondId> find_skipped(const CompareScene& scene, std::int64_t count) {
  std::vector<BondId> bonds;
  if (count == 0) return bonds;
  PhaseTimes times;
  ChosenStrategy options = scene.equilibrium;
  options.strategy = "tree";
  const auto tree = make_equilibrium(scene.network, options, times);
  tree->reset(scene.threshold);
  for (Critical next; std::ssize(bonds) < count; tree->remove(next.bond)) {
    if (tree->find_critical(next) != State::carrying) {
      throw InputError("-compare_skip", std::to_string(count),
                       "below the number of breaks, " + std::to_string(bonds.size()));
    }
    bonds.push_back(next.bond);
  }
  return bonds;
}

void note_peak(double load, std::int64_t number, double& peak, std::int64_t& n_p) {
  if (!is_new_peak(load, peak, n_p)) return;
  peak = load;
  n_p = number;
}

/// One strategy, once through the sample.
class Drive {
 public:
  Drive(const CompareScene& scene, const CompareOptions& options, const ReferenceRun& reference,
        StrategyRun& run, bool measures)
      : scene_(scene),
        own_(options.along == Along::own),
        reference_(reference),
        run_(run),
        measures_(measures),
        residual_(static_cast<std::size_t>(scene.network.unknowns)) {}

  /// Seconds of all its breaks.
  double run(Equilibrium& equilibrium) {
    skip(equilibrium);
    const std::int64_t end = reference_.n_f;
    std::int64_t k = reference_.skip;
    for (State state = State::carrying;; ++k) {
      if (is_reached(scene_.stop, k) || k >= end + kMostBeyond) break;
      Critical next;
      const EquilibriumCounts before = equilibrium.counts();
      const double start = processor_seconds();
      state = equilibrium.find_critical(next);
      seconds_ += seconds_since(start);
      const std::int64_t iterations = note(before, equilibrium.counts(), k);
      if (state == State::unsolved) complain(k, equilibrium.complaint());
      if ((state == State::failed || state == State::held) && k == 0)
        complain(k, "nothing of the intact network carries load");
      if (state != State::carrying) break;
      look(equilibrium, next, k, iterations);
      const bool follows = !own_ && k < end;
      const double again = processor_seconds();
      equilibrium.remove(follows ? reference_.bond[k] : next.bond);
      seconds_ += seconds_since(again);
    }
    run_.n_f = k;
    if (k != end && run_.complaint.empty()) differ(std::min(k, end) + 1);
    return seconds_;
  }

  /// Of all that it counted, what belongs to the breaks compared.
  void correct(EquilibriumCounts& counts) const {
    counts.iterations = iterations_;
    counts.doubtful = doubtful_;
    counts.first_doubtful = first_doubtful_;
  }

  void complain(std::int64_t breaks, const std::string& why) {
    run_.complaint = "after break " + std::to_string(breaks) + ": " + why;
  }

 private:
  std::int64_t note(const EquilibriumCounts& before, const EquilibriumCounts& after, std::int64_t k) {
    const std::int64_t iterations = after.iterations - before.iterations;
    iterations_ += iterations;
    doubtful_ += after.doubtful - before.doubtful;
    if (doubtful_ > 0 && first_doubtful_ == 0) first_doubtful_ = k + 1;
    return iterations;
  }

  /// Not on the clock. Strategies may count on being asked before the first break, some before every one.
  void skip(Equilibrium& equilibrium) {
    const double start = processor_seconds();
    equilibrium.reset(scene_.threshold);
    seconds_ = seconds_since(start);
    const bool asks = find_strategy(read_strategy().strategy).looks_ahead;
    for (std::int64_t k = 0; k < reference_.skip; ++k) {
      Critical next;
      if (k == 0 || asks) (void)equilibrium.find_critical(next);
      equilibrium.remove(reference_.bond[k]);
    }
  }

  void look(Equilibrium& equilibrium, const Critical& next, std::int64_t k, std::int64_t iterations) {
    note_peak(next.load, k + 1, run_.peak_load, run_.n_p);
    const bool known = k < reference_.n_f && (!own_ || run_.first_difference == 0);
    if (k >= reference_.n_f) differ(k + 1);
    if (known && next.bond != reference_.bond[k]) differ(k + 1);
    const auto& number = reference_.number;
    if (at_ == number.size() || number[at_] != k + 1) return;
    run_.time.push_back(seconds_);
    if (measures_) measure(equilibrium, next, k, iterations, known);
    ++at_;
  }

  void differ(std::int64_t number) {
    if (run_.first_difference == 0) run_.first_difference = number;
    if (measures_) ++run_.differences;
  }

  void measure(Equilibrium& equilibrium, const Critical& next, std::int64_t k, std::int64_t iterations,
               bool known) {
    const Network& network = scene_.network;
    const auto u = equilibrium.displacements();
    run_.iterations.push_back(iterations);
    run_.backward_error.push_back(backward_error(network, equilibrium.broken(), u, residual_));
    run_.residual.push_back(
        std::sqrt(std::inner_product(residual_.begin(), residual_.end(), residual_.begin(), 0.0)));
    double worst = 0;
    const std::vector<double> found = equilibrium.forces();
    const std::vector<double>& force = reference_.force[at_];
    for (std::size_t e = 0; known && e < found.size(); ++e) {
      const double difference = equilibrium.broken()[e] != 0 ? 0 : std::abs(found[e] - force[e]);
      if (!(difference <= worst)) worst = difference;
    }
    const double load = reference_.load[k - reference_.skip];
    run_.force_error.push_back(known ? worst / reference_.largest_force[at_] : kUnknown);
    run_.load_error.push_back(!known ? kUnknown : next.load == load ? 0 : std::abs(next.load / load - 1));
  }

  const CompareScene& scene_;
  bool own_;
  const ReferenceRun& reference_;
  StrategyRun& run_;
  bool measures_;
  std::vector<double> residual_;
  double seconds_ = 0;
  std::int64_t iterations_ = 0, doubtful_ = 0, first_doubtful_ = 0;
  std::size_t at_ = 0;  ///< the next of reference_.number
};

/// Fills up what a strategy that ended early did not reach.
void pad(StrategyRun& run, std::size_t repetitions, std::size_t measured) {
  run.time.resize(repetitions * measured, kUnknown);
  if (repetitions > 1) return;
  for (auto* series : {&run.residual, &run.backward_error, &run.force_error, &run.load_error}) {
    series->resize(measured, kUnknown);
  }
  run.iterations.resize(measured, -1);
}

void repeat(const CompareScene& scene, const CompareOptions& options, const ReferenceRun& reference, int turn,
            StrategyRun& run) {
  const StrategyOptions petsc_options(run.choice);
  StrategyRun later;  // repetitions after the first add times only
  StrategyRun& target = turn == 0 ? run : later;
  PhaseTimes times;
  Drive drive(scene, options, reference, target, turn == 0);
  double total = kUnknown;
  const std::int64_t before = bytes_in_use();
  const double start = processor_seconds();
  run.set_up.push_back(kUnknown);
  try {
    const auto equilibrium = make_strategy(scene, times);
    run.set_up.back() = seconds_since(start);
    total = drive.run(*equilibrium);
    target.memory = bytes_in_use() - before;
    target.counts = equilibrium->counts();
    drive.correct(target.counts);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    target.complaint = error.what();
  }
  if (turn > 0) run.time.insert(run.time.end(), later.time.begin(), later.time.end());
  pad(run, static_cast<std::size_t>(turn) + 1, reference.number.size());
  run.total.push_back(target.complaint.empty() ? total : kUnknown);
  run.phase.insert(run.phase.end(), times.seconds.begin(), times.seconds.end());
}

}  // namespace

ReferenceRun run_reference(const CompareScene& scene, const CompareOptions& options) {
  const double start = processor_seconds();
  ReferenceRun run;
  run.skip = options.skip;
  run.bond = find_skipped(scene, options.skip);
  Reference reference(scene.network, scene.equilibrium.common.break_on, options.reference);
  run.name = reference.name();
  reference.reset(scene.threshold);
  if (run.skip > 0) (void)reference.solve();  // the intact stiffness
  for (const BondId bond : run.bond) reference.remove(bond);
  for (std::int64_t k = run.skip; !is_reached(scene.stop, k); ++k) {
    const ReferenceState& state = reference.solve();
    run.failed = state.state != State::carrying;
    if (run.failed) break;
    run.bond.push_back(state.critical.bond);
    run.load.push_back(state.critical.load);
    run.stiffness.push_back(state.critical.stiffness);
    note_peak(state.critical.load, k + 1, run.peak_load, run.n_p);
    if ((k - run.skip) % options.every == 0) {
      run.number.push_back(k + 1);
      run.error.push_back(state.error);
      run.largest_force.push_back(state.largest_force);
      run.force.push_back(state.force);
    }
    reference.remove(state.critical.bond);
  }
  if (run.load.empty() && run.failed) {
    throw SolverError(
        "no bond of the intact network carries load and can break; are its grips rigidly joined, or is it a "
        "mechanism?");
  }
  run.n_f = std::ssize(run.bond);
  run.seconds = seconds_since(start);
  return run;
}

void try_strategies(const CompareScene& scene, std::span<const StrategyChoice> choices) {
  for (const StrategyChoice& choice : choices) {
    const StrategyOptions petsc_options(choice);
    PhaseTimes times;
    try {
      (void)make_strategy(scene, times);
      reject_unused_options();
    } catch (const InputError& error) {
      throw InputError("strategy " + choice.name + ": " + error.what());
    }
  }
}

std::vector<StrategyRun> run_strategies(const CompareScene& scene, const CompareOptions& options,
                                        const ReferenceRun& reference,
                                        std::span<const StrategyChoice> choices) {
  std::vector<StrategyRun> runs;
  for (const StrategyChoice& choice : choices) runs.emplace_back().choice = choice;
  for (int turn = 0; turn < options.repetitions; ++turn) {
    for (StrategyRun& run : runs) {
      if (!options.quiet) {
        std::fprintf(stderr, "run %d of %d: %s\n", turn + 1, options.repetitions, run.choice.name.c_str());
      }
      repeat(scene, options, reference, turn, run);
    }
  }
  return runs;
}

}  // namespace crackle
