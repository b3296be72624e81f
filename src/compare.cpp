/// Compares solvers on one and the same breaking network: error against run time.
///
///   crackle_compare -lattice_size 32 -compare options/solver/tree.opts,options/solver/mumps.opts
///   crackle_compare -options_file options/paper/fuse.opts -lattice_size 64 -compare_every 50
///       -compare options/solver/jacobi.opts,options/solver/circulant.opts -compare_rtol 1e-2,1e-6,1e-12

#include <cstdio>

#include "crackle/base/interrupt.hpp"
#include "crackle/base/program.hpp"
#include "crackle/compare/compare_file.hpp"
#include "crackle/compare/compare_run.hpp"
#include "crackle/compare/compare_scene.hpp"
#include "crackle/compare/compare_strategy.hpp"
#include "crackle/compare/compare_table.hpp"
#include "crackle/equilibrium/ksp/preconditioner_kind.hpp"
#include "crackle/scene/option_table.hpp"

namespace {

void compare_strategies() {
  // 1. the scene, and what to compare in it
  crackle::register_preconditioners();
  crackle::ignore_file_size_limit();
  crackle::Scene scene = crackle::read_compared_scene();
  if (scene.help) return;
  const crackle::CompareOptions options = crackle::read_comparison(scene);
  const auto choices = crackle::choose_strategies(options.files, options.tolerances);

  // 2. the intact network and the sample's thresholds
  const crackle::IntactNetwork intact = crackle::load_network(scene.network);
  const crackle::CompareScene sample{intact.network, scene.equilibrium, scene.ensemble.stop,
                                     crackle::make_thresholds(scene, intact)};

  // 3. whether all of it can be, before time is spent; the options used, echoed
  crackle::CompareFile file(options);
  crackle::try_strategies(sample, choices);
  const std::string header = crackle::format_options(scene.options);
  std::printf("%s", header.c_str());

  // 4. the reference breaks the sample
  const crackle::ReferenceRun reference = crackle::run_reference(sample, options);

  // 5. so does every strategy, in turn
  const auto runs = crackle::run_strategies(sample, options, reference, choices);

  // 6. what came out
  file.write(header, reference, runs);
  crackle::tell_what_stays("crackle_compare", options.path);
  std::printf("%swritten: %s\n", crackle::format_comparison(reference, runs, options).c_str(),
              options.path.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  crackle::use_options(crackle::compare_options());
  return crackle::run_solver_program("crackle_compare", argc, argv, crackle::format_help, [] {
    compare_strategies();
    return 0;
  });
}
