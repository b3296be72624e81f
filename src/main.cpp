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
#include "crackle/network_file.hpp"
#include "crackle/option_text.hpp"
#include "crackle/pc_updown.hpp"
#include "crackle/petsc_handle.hpp"
#include "crackle/report.hpp"
#include "crackle/scene.hpp"

namespace {

using Clock = std::chrono::steady_clock;

void break_lattices(int argc, char** argv) {
  // 1. start
  const crackle::petsc::Session session(argc, argv, crackle::help_text().c_str());
  crackle::petsc::check(crackle::register_pc_updown());
  const auto start = Clock::now();
  crackle::PhaseTimes times;

  // 2. options, echoed
  const crackle::Scene scene = crackle::read_scene();
  if (!scene.help) std::printf("%s", scene.options.c_str());

  // 3. the intact network and the strategy that keeps it in equilibrium
  const crackle::IntactNetwork intact = crackle::load_network(scene.network);
  const auto equilibrium = crackle::make_equilibrium(intact.network, scene.equilibrium, times);
  if (scene.help) return;
  crackle::reject_unused_options();

  // 4. where results go
  const crackle::Run run = crackle::make_run(scene, intact);
  crackle::RunFile file(scene.output, crackle::make_header(scene, intact));

  // 5. break every sample
  crackle::run_ensemble(run, *equilibrium, file, times);

  // 6. what came out
  const auto samples = file.finish();
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  crackle::print_report(samples, equilibrium->counts(), times, seconds, scene.output.path);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    break_lattices(argc, argv);
    return 0;
  } catch (const std::exception& error) {
    std::fflush(stdout);
    std::fprintf(stderr, "crackle: %s\n", error.what());
    return 1;
  }
}
