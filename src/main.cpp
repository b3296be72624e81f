/// Breaks disordered lattices bond by bond:
///
///   crackle -options_file options/paper/spring.opts -lattice_size 64 -samples 20
///   mpirun -n 16 crackle -lattice_size 8,16,32 -samples 4000,2000,500 -output paper.h5
///   crackle -lattice file -lattice_file network.h5 -disorder file
///   crackle -options_file options/solver/mumps.opts -lattice_size 32 -log_view

#include <chrono>
#include <deque>

#include "crackle/base/error.hpp"
#include "crackle/base/interrupt.hpp"
#include "crackle/base/output_lock.hpp"
#include "crackle/base/petsc_handle.hpp"
#include "crackle/base/program.hpp"
#include "crackle/ensemble/report.hpp"
#include "crackle/equilibrium/ksp/preconditioner.hpp"
#include "crackle/scene/option_table.hpp"
#include "crackle/scene/study.hpp"

namespace {

using Clock = std::chrono::steady_clock;
using Files = std::vector<std::unique_ptr<crackle::RunFile>>;

/// Puts the run files together and prints what is in them.
void report(const std::vector<crackle::Run>& runs, const Files& files,
            std::vector<crackle::RunTotals>& totals, Clock::time_point start, const crackle::Ranks& ranks) {
  const auto seconds_since = [](Clock::time_point then) {
    return std::chrono::duration<double>(Clock::now() - then).count();
  };
  const bool alone = runs.size() == 1 && ranks.groups() == 1;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const auto begun = Clock::now();
    const auto samples = crackle::finish(*files[i], totals[i].times);
    const double seconds = alone ? seconds_since(start) : totals[i].seconds + seconds_since(begun);
    crackle::print_report(samples, totals[i].counts, totals[i].times, seconds, runs[i].output.path);
    crackle::tell_what_stays("crackle", runs[i].output.path);
  }
  if (!alone) crackle::print_run_time(seconds_since(start), ranks.processes());
}

constexpr int kSignalled = 128;  // and the signal's number: the exit status by which a shell tells of one

/// Returns the exit status.
int break_lattices() {
  // 1. start
  const auto start = Clock::now();
  crackle::catch_interrupts();
  crackle::ignore_file_size_limit();
  crackle::register_preconditioners();
  crackle::petsc::LogStage stage("Set-up");

  // 2. options, and the processes that share the work
  std::vector<crackle::Scene> scenes = crackle::read_scenes();
  const crackle::Ranks ranks(PETSC_COMM_WORLD, scenes.front().ensemble.ranks_per_sample);
  const bool help = scenes.front().help;

  // 3. the intact networks, and a run of each
  std::deque<crackle::Study> studies;
  std::vector<crackle::Run> runs;
  ranks.together([&] {
    studies = crackle::make_studies(std::move(scenes), ranks);
    runs = crackle::make_runs(studies);
  });

  // 4. the first strategy to keep one in equilibrium: now every option has been read
  std::vector<crackle::RunTotals> totals(runs.size());
  std::unique_ptr<crackle::Equilibrium> first;
  ranks.together([&] {
    first = crackle::make_first(runs, totals);
    if (!help) crackle::reject_unused_options();
  });
  if (help) return 0;

  // 5. where results go; the options used, echoed
  Files files;
  ranks.together([&] {
    if (ranks.first()) files = crackle::open_files(studies);
  });
  if (ranks.first()) crackle::echo(studies);

  // 6. break every sample
  stage.next("Breaks");
  const crackle::EnsembleEnd end = crackle::run_ensemble(runs, ranks, files, std::move(first), totals);
  if (!end.complaint.empty()) throw crackle::SolverError(end.complaint);

  // 7. what came out
  stage.next("Output");
  ranks.together([&] {
    if (ranks.first()) report(runs, files, totals, start, ranks);
    if (ranks.first() && end.signal != 0) crackle::print_early_end(end.signal);
  });
  return end.signal == 0 ? 0 : kSignalled + end.signal;
}

}  // namespace

int main(int argc, char** argv) {
  return crackle::run_solver_program("crackle", argc, argv, crackle::format_help, break_lattices);
}
