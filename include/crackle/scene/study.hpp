/// A run of one size, or of several side by side: from its scenes to what the ensemble breaks.
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "crackle/base/ranks.hpp"
#include "crackle/ensemble/ensemble.hpp"
#include "crackle/scene/scene.hpp"

namespace crackle {

/// One size of the run.
struct Study {
  Scene scene;
  IntactNetwork intact;
  RunHeader header;
};

/// Makes the networks. ranks must outlive them. Throws InputError as load_network does.
[[nodiscard]] std::deque<Study> make_studies(std::vector<Scene> scenes, const Ranks& ranks);

/// Views of the studies. Throws InputError as make_run does.
[[nodiscard]] std::vector<Run> make_runs(const std::deque<Study>& studies);

/// The strategy of the largest size. Throws as make_equilibrium does.
[[nodiscard]] std::unique_ptr<Equilibrium> make_first(const std::vector<Run>& runs,
                                                      std::vector<RunTotals>& totals);

/// Throws InputError as RunFile does.
[[nodiscard]] std::vector<std::unique_ptr<RunFile>> open_files(const std::deque<Study>& studies);

/// A note of a scene that isn't as usual goes to stderr, every option with the value used to stdout.
void echo(const std::deque<Study>& studies);

}  // namespace crackle
