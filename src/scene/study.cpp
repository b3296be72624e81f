#include "crackle/scene/study.hpp"

#include <cstdio>
#include <string>
#include <utility>

#include "crackle/base/durable_file.hpp"
#include "crackle/base/error.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/network/network_file.hpp"

namespace crackle {

std::deque<Study> make_studies(std::vector<Scene> scenes, const Ranks& ranks) {
  std::deque<Study> studies;  // what is in it has a lasting place
  for (Scene& scene : scenes) {
    Study& study = studies.emplace_back(std::move(scene));
    study.scene.equilibrium.common.ranks = &ranks;
    study.scene.output.writers = ranks.groups();
    study.scene.output.path = follow_links(study.scene.output.path);
    study.intact = with_memory_for("the network", [&] { return load_network(study.scene.network); });
    study.header = make_header(study.scene, study.intact);
  }
  return studies;
}

std::vector<Run> make_runs(const std::deque<Study>& studies) {
  std::vector<Run> runs;
  for (const Study& study : studies) {
    runs.push_back(make_run(study.scene, study.intact, study.header));
    if (studies.size() > 1) runs.back().name = "L = " + std::to_string(study.scene.network.size);
    if (!study.scene.tree_view) continue;
    const auto describe = find_strategy(study.scene.equilibrium.strategy).describe;
    runs.back().inspect = [describe](const Equilibrium& equilibrium) {
      std::printf("\n%s", describe(equilibrium).c_str());
    };
  }
  return runs;
}

std::unique_ptr<Equilibrium> make_first(const std::vector<Run>& runs, std::vector<RunTotals>& totals) {
  const std::size_t largest = largest_run(runs);
  const Run& run = runs[largest];
  return with_memory_for(
      "-equilibrium " + run.equilibrium.strategy + " of " + std::to_string(run.network.unknowns) +
          " unknowns",
      [&] { return make_equilibrium(run.network, run.equilibrium, totals[largest].times); });
}

std::vector<std::unique_ptr<RunFile>> open_files(const std::deque<Study>& studies) {
  std::vector<std::unique_ptr<RunFile>> files;
  files.reserve(studies.size());
  for (const Study& study : studies)
    files.push_back(std::make_unique<RunFile>(study.scene.output, study.header));
  return files;
}

void echo(const std::deque<Study>& studies) {
  const std::string& note = studies.front().scene.note;
  if (!note.empty()) std::fprintf(stderr, "crackle: %s\n", one_line(note).c_str());
  for (const Study& study : studies) std::printf("%s", study.header.options.c_str());
  std::fflush(stdout);
}

}  // namespace crackle
