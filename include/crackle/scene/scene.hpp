/// A scene: what the command line asks for at one size, one plain struct for each layer. Our options are read here
/// and in compare_scene only; the solver's own are read by PETSc.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "crackle/ensemble/ensemble.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/network/disorder.hpp"
#include "crackle/network/network_file.hpp"
#include "crackle/record/run_file.hpp"

namespace crackle {

struct Scene {
  NetworkOptions network;
  DisorderOptions disorder;
  ChosenStrategy equilibrium;
  EnsembleOptions ensemble;
  OutputOptions output;
  bool help = false;
  std::string note;                            ///< of a default that isn't as usual, and why; may be empty
  bool tree_view = false;                      ///< print what the tree strategy did
  std::map<std::string, std::string> options;  ///< every option with the value used; -model only if known
};

/// Reads PETSc's options database: a scene for each value of -lattice_size, as a run of that size alone would
/// have it, but for the name of its output. Throws InputError for a value that isn't allowed, or a word on the
/// command line that is no option.
[[nodiscard]] std::vector<Scene> read_scenes();

/// The part of it that a solver file may set, from the database as it is now.
[[nodiscard]] ChosenStrategy read_strategy();

/// What every sample has in common. Throws InputError when -disorder file finds no thresholds or not
/// enough, when the first sample's can't be drawn, and as check_section_height does.
/// The views that it holds are of the arguments.
[[nodiscard]] Run make_run(const Scene& scene, const IntactNetwork& intact, const RunHeader& header);

/// "-name value" a line, by name.
[[nodiscard]] std::string format_options(const std::map<std::string, std::string>& options);

/// [M] of the first sample. Throws as make_run does.
[[nodiscard]] std::vector<double> make_thresholds(const Scene& scene, const IntactNetwork& intact);

/// The head of the run file; with -record network the network and, for a run of one sample, its thresholds.
[[nodiscard]] RunHeader make_header(const Scene& scene, const IntactNetwork& intact);

}  // namespace crackle
