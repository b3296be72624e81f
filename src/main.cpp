/// Breaks disordered lattices bond by bond:
///
///   crackle -options_file options/paper_spring.opts -lattice_size 64 -samples 20
///   crackle -model fuse -lattice_size 32 -samples 100 -output fuse.h5
///   crackle -lattice file -lattice_file network.h5 -disorder file
///   crackle -options_file options/solver_mumps.opts -lattice_size 32 -log_view

#include <chrono>
#include <cstdio>
#include <exception>

#include "crackle/ensemble.hpp"
#include "crackle/equilibrium_tree.hpp"
#include "crackle/network_file.hpp"
#include "crackle/option_text.hpp"
#include "crackle/petsc_handle.hpp"
#include "crackle/preconditioner.hpp"
#include "crackle/report.hpp"
#include "crackle/scene.hpp"

namespace {

using Clock = std::chrono::steady_clock;

void break_lattices() {
  // 1. start
  const auto start = Clock::now();
  crackle::register_preconditioners();
  crackle::petsc::LogStage stage("Set-up");
  crackle::PhaseTimes times;

  // 2. options
  const crackle::Scene scene = crackle::read_scene();

  // 3. the intact network and the strategy that keeps it in equilibrium; the options used, echoed
  const crackle::IntactNetwork intact = crackle::load_network(scene.network);
  const auto equilibrium = crackle::make_equilibrium(intact.network, scene.equilibrium, times);
  if (scene.help) return;
  crackle::reject_unused_options();
  const crackle::RunHeader header = crackle::make_header(scene, intact);
  std::printf("%s", header.options.c_str());

  // 4. where results go
  const crackle::Run run = crackle::make_run(scene, intact);
  crackle::RunFile file(scene.output, header);

  // 5. break every sample
  stage.next("Breaks");
  crackle::run_ensemble(run, *equilibrium, file, times);

  // 6. what came out
  stage.next("Output");
  const auto samples = crackle::finish(file, times);
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  crackle::print_report(samples, equilibrium->counts(), times, seconds, scene.output.path);
  if (scene.tree_view) std::printf("%s", crackle::describe(crackle::tree_counts(*equilibrium)).c_str());
}

int complain(const std::exception& error) {
  std::fflush(stdout);
  std::fprintf(stderr, "crackle: %s\n", error.what());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const crackle::petsc::Session session(argc, argv, crackle::help_text().c_str());
    try {
      break_lattices();
      return 0;
    } catch (const std::exception& error) {
      return session.first() ? complain(error) : 1;
    }
  } catch (const std::exception& error) {
    return complain(error);
  }
}
