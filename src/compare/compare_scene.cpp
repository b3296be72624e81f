#include "crackle/compare/compare_scene.hpp"

#include "crackle/scene/option_reader.hpp"

namespace crackle {

Scene read_compared_scene() {
  std::vector<Scene> scenes = read_scenes();
  if (scenes.size() > 1)
    throw InputError("-lattice_size", Reader().text("-lattice_size"), "one size in a comparison");
  return std::move(scenes.front());
}

CompareOptions read_comparison(Scene& scene) {
  Reader reader;
  CompareOptions options;
  options.files = split(reader.text("-compare"));
  if (options.files.empty()) throw InputError("-compare", "not given", find_option("-compare").allowed);
  options.tolerances = split(reader.text("-compare_rtol"));
  for (const std::string& rtol : options.tolerances) {
    const double value = Reader::parse("-compare_rtol", rtol, rtol, 0.0);
    if (!(value > 0 && value < 1))
      throw InputError("-compare_rtol", rtol, find_option("-compare_rtol").allowed);
  }
  options.every = reader.number("-compare_every", std::int64_t{1});
  options.repetitions = reader.number("-compare_repetitions", 1);
  options.skip = reader.number("-compare_skip", std::int64_t{0});
  options.along =
      reader.choice("-compare_along", {std::pair{"reference", Along::reference}, {"own", Along::own}});
  options.reference = reader.choice("-compare_reference", {std::pair{"auto", ReferenceKind::automatic},
                                                           {"quad", ReferenceKind::quad},
                                                           {"refined", ReferenceKind::refined}});
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
