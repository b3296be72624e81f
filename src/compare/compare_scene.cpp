#include "crackle/compare/compare_scene.hpp"

#include <array>

#include "crackle/base/ranks.hpp"
#include "crackle/scene/choices.hpp"
#include "crackle/scene/option_reader.hpp"

namespace crackle {

namespace {

constexpr std::array kAlongs = {Choice{"reference", Along::reference}, Choice{"own", Along::own}};
constexpr std::array kReferences = {Choice{"auto", ReferenceKind::automatic},
                                    Choice{"quad", ReferenceKind::quad},
                                    Choice{"refined", ReferenceKind::refined}};

using allow::integer;
using allow::text;
using allow::words;

constexpr std::array kOptions = {
    Option{"-compare", "", text("files of solver options, with commas between"),
           "the strategies (options/solver/*.opts)", false},
    Option{"-compare_rtol", "", text("numbers between 0 and 1, with commas between"),
           "tolerances to run each iteration with", false},
    Option{"-compare_every", "10", integer(1), "measure at every so many breaks", false},
    Option{"-compare_repetitions", "3", integer(1), "how often each strategy runs", false},
    Option{"-compare_skip", "0", integer(0), "first breaks that are taken from tree, and not compared",
           false},
    Option{"-compare_along", "reference", words(allow::words_of<kAlongs>),
           "whose breaks damage the network that a strategy solves", false},
    Option{"-compare_reference", "auto", words(allow::words_of<kReferences>),
           "113-bit factors (auto: where small), or refinement in long double", false},
};

}  // namespace

std::span<const Option> compare_options() {
  return kOptions;
}

Scene read_compared_scene() {
  std::vector<Scene> scenes = read_scenes();
  if (scenes.size() > 1)
    throw InputError("-lattice_size", Reader().text("-lattice_size"), "one size in a comparison");
  const int processes = Ranks(MPI_COMM_WORLD, 1).processes();
  if (processes > 1 && !scenes.front().help)
    throw InputError("processes", std::to_string(processes), "1 in a comparison, which times one");
  return std::move(scenes.front());
}

CompareOptions read_comparison(Scene& scene) {
  Reader reader;
  CompareOptions options;
  options.files = split(reader.text("-compare"));
  if (options.files.empty()) throw InputError("-compare", "not given", allowed_of("-compare"));
  options.tolerances = split(reader.text("-compare_rtol"));
  for (const std::string& rtol : options.tolerances) {
    const auto value = Reader::parse_within<double>(
        rtol, {.kind = Allowed::Kind::number, .most = 1, .above = true, .below = true});
    if (!value) throw InputError("-compare_rtol", rtol, allowed_of("-compare_rtol"));
  }
  options.every = reader.number<std::int64_t>("-compare_every");
  options.repetitions = reader.number<int>("-compare_repetitions");
  options.skip = reader.number<std::int64_t>("-compare_skip");
  options.along = reader.choice("-compare_along", kAlongs).value;
  options.reference = reader.choice("-compare_reference", kReferences).value;
  if (reader.given("-output")) options.path = scene.output.path;
  options.overwrite = scene.output.overwrite;
  options.quiet = scene.ensemble.monitor == Monitor::none;
  const auto kind = scene.ensemble.stop.kind;
  if (kind != StopRule::Kind::failure && kind != StopRule::Kind::breaks) {
    throw InputError("-stop", scene.options["-stop"], "failure or breaks=n in a comparison");
  }
  if (scene.ensemble.samples > 1) {
    throw InputError("-samples", scene.options["-samples"], "1 in a comparison (-first_sample says which)");
  }
  if (scene.output.resume) throw InputError("-resume", "", "crackle's alone; a comparison starts anew");
  for (const auto& [name, value] : reader.used()) scene.options[name] = value;
  scene.options["-output"] = options.path;
  return options;
}

}  // namespace crackle
