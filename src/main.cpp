/// Breaks disordered lattices bond by bond:
///
///   crackle -options_file options/paper_spring.opts -lattice_size 64 -samples 20
///   mpirun -n 16 crackle -lattice_size 8,16,32 -samples 4000,2000,500 -output paper.h5
///   crackle -lattice file -lattice_file network.h5 -disorder file
///   crackle -options_file options/solver_mumps.opts -lattice_size 32 -log_view

#include <chrono>
#include <cstdio>
#include <deque>
#include <exception>

#include "crackle/base/durable_file.hpp"
#include "crackle/base/error.hpp"
#include "crackle/base/interrupt.hpp"
#include "crackle/base/option_files.hpp"
#include "crackle/base/petsc_handle.hpp"
#include "crackle/base/program.hpp"
#include "crackle/ensemble/ensemble.hpp"
#include "crackle/ensemble/report.hpp"
#include "crackle/equilibrium/ksp/preconditioner_kind.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/network/network_file.hpp"
#include "crackle/scene/option_table.hpp"
#include "crackle/scene/scene.hpp"

namespace {

using Clock = std::chrono::steady_clock;
using Files = std::vector<std::unique_ptr<crackle::RunFile>>;

/// One size of the run.
struct Study {
  crackle::Scene scene;
  crackle::IntactNetwork intact;
  crackle::RunHeader header;
};

std::deque<Study> make_studies(std::vector<crackle::Scene> scenes, const crackle::Ranks& ranks) {
  std::deque<Study> studies;  // what is in it has a lasting place
  for (crackle::Scene& scene : scenes) {
    Study& study = studies.emplace_back(std::move(scene));
    study.scene.equilibrium.common.ranks = &ranks;
    study.scene.output.writers = ranks.groups();
    study.scene.output.path = crackle::follow_links(study.scene.output.path);
    study.intact =
        crackle::with_memory_for("the network", [&] { return crackle::load_network(study.scene.network); });
    study.header = crackle::make_header(study.scene, study.intact);
  }
  return studies;
}

std::vector<crackle::Run> make_runs(const std::deque<Study>& studies) {
  std::vector<crackle::Run> runs;
  for (const Study& study : studies) {
    runs.push_back(crackle::make_run(study.scene, study.intact, study.header));
    if (studies.size() > 1) runs.back().name = "L = " + std::to_string(study.scene.network.size);
    if (!study.scene.tree_view) continue;
    const auto describe = crackle::find_strategy(study.scene.equilibrium.strategy).describe;
    runs.back().inspect = [describe](const crackle::Equilibrium& equilibrium) {
      std::printf("\n%s", describe(equilibrium).c_str());
    };
  }
  return runs;
}

void echo(const std::deque<Study>& studies) {
  const std::string& note = studies.front().scene.note;
  if (!note.empty()) std::fprintf(stderr, "crackle: %s\n", crackle::one_line(note).c_str());
  for (const Study& study : studies) std::printf("%s", study.header.options.c_str());
  std::fflush(stdout);
}

Files open_files(const std::deque<Study>& studies) {
  Files files;
  for (const Study& study : studies)
    files.push_back(std::make_unique<crackle::RunFile>(study.scene.output, study.header));
  return files;
}

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

/// Everything but where the results go.
struct Work {
  std::deque<Study> studies;
  std::vector<crackle::Run> runs;  ///< views of the studies
  std::vector<crackle::RunTotals> totals;
  std::unique_ptr<crackle::Equilibrium> first;  ///< of the largest size
};

void prepare(std::vector<crackle::Scene> scenes, const crackle::Ranks& ranks, Work& work) {
  const bool help = scenes.front().help;
  work.studies = make_studies(std::move(scenes), ranks);
  work.runs = make_runs(work.studies);
  work.totals.resize(work.runs.size());
  const std::size_t largest = crackle::largest_run(work.runs);
  const crackle::Run& run = work.runs[largest];
  work.first = crackle::with_memory_for(
      "-equilibrium " + run.equilibrium.strategy + " of " + std::to_string(run.network.unknowns) +
          " unknowns",
      [&] { return crackle::make_equilibrium(run.network, run.equilibrium, work.totals[largest].times); });
  if (help) return;
  crackle::reject_unused_options();
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

  // 3. the intact networks and the first strategy to keep one in equilibrium
  Work work;
  ranks.together([&] { prepare(std::move(scenes), ranks, work); });
  if (help) return 0;

  // 4. where results go; the options used, echoed
  Files files;
  ranks.together([&] {
    if (ranks.first()) files = open_files(work.studies);
  });
  if (ranks.first()) echo(work.studies);

  // 5. break every sample
  stage.next("Breaks");
  const crackle::EnsembleEnd end =
      crackle::run_ensemble(work.runs, ranks, files, std::move(work.first), work.totals);
  if (!end.complaint.empty()) throw crackle::SolverError(end.complaint);

  // 6. what came out
  stage.next("Output");
  ranks.together([&] {
    if (ranks.first()) report(work.runs, files, work.totals, start, ranks);
    if (ranks.first() && end.signal != 0) crackle::print_early_end(end.signal);
  });
  return end.signal == 0 ? 0 : kSignalled + end.signal;
}

}  // namespace

int main(int argc, char** argv) {
  return crackle::run_program("crackle", [&] {
    if (crackle::wants_version(argc, argv)) {
      std::printf("%s", crackle::version_text("crackle").c_str());
      return 0;
    }
    crackle::unify_help(argc, argv);
    crackle::check_options(argc, argv);
    const std::string help = crackle::format_help();
    const crackle::petsc::Session session(argc, argv, help.c_str());
    try {
      return break_lattices();
    } catch (const std::exception& error) {
      return session.first() ? crackle::complain("crackle", crackle::with_place(error)) : 1;
    }
  });
}
