#include "crackle/scene.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>

#include "crackle/error.hpp"
#include "crackle/option_text.hpp"
#include "crackle/petsc_handle.hpp"

namespace crackle {

namespace {

using petsc::check;

constexpr std::int64_t kMostSamples = 1'000'000'000;

/// Reads one option after the other and notes the value used.
class Reader {
 public:
  [[nodiscard]] const std::map<std::string, std::string>& used() const { return used_; }

  [[nodiscard]] bool given(const char* name) const {
    PetscBool set = PETSC_FALSE;
    check(PetscOptionsHasName(nullptr, nullptr, name, &set));
    return set == PETSC_TRUE;
  }

  std::string text(const char* name) {
    std::array<char, PETSC_MAX_PATH_LEN> value{};
    PetscBool set = PETSC_FALSE;
    check(PetscOptionsGetString(nullptr, nullptr, name, value.data(), value.size(), &set));
    const OptionText& option = find_option(name);
    if (set == PETSC_TRUE && value[0] == '\0') throw InputError(name, "without a value", option.allowed);
    return used_[name] = set == PETSC_TRUE ? value.data() : option.standard;
  }

  /// Notes a value that follows from other options.
  std::string note(const char* name, const char* value) { return used_[name] = value; }

  /// The place of the value among the words allowed.
  template <class Choice>
  Choice choice(const char* name, std::initializer_list<std::pair<const char*, Choice>> choices) {
    const std::string value = text(name);
    for (const auto& [word, meaning] : choices) {
      if (value == word) return meaning;
    }
    throw InputError(name, value, find_option(name).allowed);
  }

  template <class Number>
  Number number(const char* name, Number least) {
    const std::string value = text(name);
    return parse(name, value, value, least);
  }

  /// A positive, finite number.
  double positive(const char* name) {
    const double value = number(name, 0.0);
    if (value > 0) return value;
    throw InputError(name, text(name), find_option(name).allowed);
  }

  bool flag(const char* name) {
    PetscBool value = PETSC_FALSE;
    if (PetscOptionsGetBool(nullptr, nullptr, name, &value, nullptr) != 0) {
      throw InputError(name, text(name), "nothing, true or false");
    }
    return value == PETSC_TRUE;
  }

  /// `digits` as a number from `least` on; `value` is what a message shows.
  template <class Number>
  static Number parse(const char* name, const std::string& value, const std::string& digits, Number least) {
    Number result{};
    const char* const end = digits.data() + digits.size();
    const auto [stop, error] = std::from_chars(digits.data(), end, result);
    if (error != std::errc{} || stop != end || !(result >= least) ||
        !std::isfinite(static_cast<double>(result))) {
      throw InputError(name, value, find_option(name).allowed);
    }
    return result;
  }

 private:
  std::map<std::string, std::string> used_;
};

StiffnessOptions read_stiffness(Reader& reader) {
  StiffnessOptions options;
  options.kind = reader.choice("-stiffness", {std::pair{"uniform", StiffnessKind::uniform},
                                              {"random", StiffnessKind::random},
                                              {"inclusion", StiffnessKind::inclusion},
                                              {"band", StiffnessKind::band}});
  if (options.kind != StiffnessKind::uniform) {
    options.contrast = reader.number("-stiffness_contrast", 1.0);
  }
  options.dilution = reader.number("-lattice_dilution", 0.0);
  if (options.dilution >= 1) {
    throw InputError("-lattice_dilution", reader.text("-lattice_dilution"),
                     find_option("-lattice_dilution").allowed);
  }
  options.seed = reader.number("-seed", std::uint64_t{0});
  return options;
}

NetworkOptions read_network(Reader& reader) {
  NetworkOptions options;
  options.from_file = reader.choice("-lattice", {std::pair{"triangular", false}, {"file", true}});
  if (!options.from_file || reader.given("-model")) {
    options.model = reader.choice("-model", {std::pair{"spring", Model::spring}, {"fuse", Model::fuse}});
  }
  options.grips =
      reader.choice("-grips", {std::pair{"sliding", Grips::sliding}, {"clamped", Grips::clamped}});
  if (options.from_file) {
    options.file = reader.text("-lattice_file");
    if (options.file.empty())
      throw InputError("-lattice_file", "not given", find_option("-lattice_file").allowed);
    return options;
  }
  options.size = reader.number("-lattice_size", 1);
  if (options.size > kLargestSize) {
    throw InputError("-lattice_size", std::to_string(options.size), find_option("-lattice_size").allowed);
  }
  options.row_spacing = reader.positive("-lattice_row_spacing");
  options.stiffness = read_stiffness(reader);
  return options;
}

DisorderOptions read_disorder(Reader& reader, bool network_from_file) {
  DisorderOptions options;
  options.from_file = reader.text("-disorder") == "file";
  if (options.from_file && !network_from_file)
    throw InputError("-disorder", "file", "uniform, power or constant without -lattice file");
  if (options.from_file) return options;
  options.thresholds = reader.choice("-disorder", {std::pair{"uniform", Thresholds::uniform},
                                                   {"power", Thresholds::power},
                                                   {"constant", Thresholds::constant}});
  if (options.thresholds == Thresholds::power) options.exponent = reader.positive("-disorder_exponent");
  options.zero_share = reader.number("-disorder_zero_share", 0.0);
  if (options.zero_share > 1) {
    throw InputError("-disorder_zero_share", reader.text("-disorder_zero_share"),
                     find_option("-disorder_zero_share").allowed);
  }
  options.seed = reader.number("-seed", std::uint64_t{0});
  return options;
}

StopRule read_stop(Reader& reader) {
  const std::string value = reader.text("-stop");
  const std::size_t equals = value.find('=');
  const std::string kind = value.substr(0, equals);
  const std::string digits = equals == std::string::npos ? "" : value.substr(equals + 1);
  if (value == "failure") return {};
  if (kind == "breaks") {
    return {StopRule::Kind::breaks, static_cast<double>(Reader::parse("-stop", value, digits, 0))};
  }
  const double limit = Reader::parse("-stop", value, digits, 0.0);
  if (kind == "stiffness" && limit <= 1) return {StopRule::Kind::stiffness, limit};
  if (kind == "displacement") return {StopRule::Kind::displacement, limit};
  throw InputError("-stop", value, find_option("-stop").allowed);
}

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> words;
  std::istringstream stream(list);
  for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
  return words;
}

RecordOptions read_record(Reader& reader) {
  RecordOptions record;
  record.breaks = false;
  const std::string list = reader.text("-record");
  const std::initializer_list<std::pair<const char*, bool*>> parts = {{"breaks", &record.breaks},
                                                                      {"profile", &record.profile},
                                                                      {"snapshot", &record.snapshot},
                                                                      {"network", &record.network}};
  for (const std::string& word : list == "none" ? std::vector<std::string>{} : split(list)) {
    const auto part = std::ranges::find(parts, word, [](const auto& p) { return std::string(p.first); });
    if (part == parts.end()) throw InputError("-record", list, find_option("-record").allowed);
    *part->second = true;
  }
  if (!record.snapshot) return record;
  const std::string numbers = reader.text("-record_snapshot_at");
  for (const std::string& word : split(numbers)) {
    record.snapshot_at.push_back(Reader::parse("-record_snapshot_at", numbers, word, 1));
  }
  if (record.snapshot_at.empty()) {
    throw InputError("-record_snapshot_at", "not given", find_option("-record_snapshot_at").allowed);
  }
  std::ranges::sort(record.snapshot_at);
  return record;
}

OutputOptions read_output(Reader& reader) {
  OutputOptions options;
  options.path = reader.text("-output");
  options.resume = reader.flag("-resume");
  options.overwrite = reader.flag("-overwrite");
  if (options.resume && options.overwrite) throw InputError("-overwrite", "with -resume", "one of the two");
  options.record = read_record(reader);
  return options;
}

EnsembleOptions read_ensemble(Reader& reader, bool one_sample) {
  EnsembleOptions options;
  options.samples = reader.number("-samples", std::int64_t{1});
  options.first_sample = reader.number("-first_sample", std::int64_t{0});
  options.stop = read_stop(reader);
  options.monitor =
      reader.choice("-monitor", {std::pair{"auto", Monitor::automatic}, {"none", Monitor::none}});
  if (options.samples > kMostSamples ||
      options.first_sample > std::numeric_limits<std::int64_t>::max() - kMostSamples) {
    throw InputError("-first_sample " + std::to_string(options.first_sample) + " -samples",
                     std::to_string(options.samples), "at most 1e9 samples, each with a number of 64 bits");
  }
  if (one_sample && options.samples > 1) {
    throw InputError("-samples", std::to_string(options.samples),
                     "1 with -disorder file: every sample is the same");
  }
  return options;
}

void read_equilibrium(Reader& reader, Scene& scene) {
  // who names a KSP or a PC, if only to view it, wants it used
  const bool named = reader.given("-equilibrium") || solver_options().empty();
  scene.equilibrium.strategy = named ? reader.text("-equilibrium") : reader.note("-equilibrium", "ksp");
  scene.equilibrium.check_every = reader.number("-equilibrium_check", std::int64_t{0});
  if (scene.equilibrium.check_every > 0) {
    scene.equilibrium.check_bound = reader.positive("-equilibrium_check_bound");
  }
  if (scene.equilibrium.strategy == "ksp") {
    scene.equilibrium.refactor_every = reader.number("-equilibrium_refactor_every", 1);
  }
  if (scene.equilibrium.strategy != "tree") return;
  scene.equilibrium.verify = reader.flag("-equilibrium_tree_verify");
  scene.tree_view = reader.flag("-equilibrium_tree_view");
}

}  // namespace

const std::string& help_text() {
  static const std::string text = format_help();
  return text;
}

Scene read_scene() {
  PetscMPIInt processes = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &processes);
  if (processes > 1) throw InputError("mpirun with processes:", std::to_string(processes), "1");
  reject_stray_words();
  Reader reader;
  Scene scene;
  scene.help = reader.given("-help");
  scene.network = read_network(reader);
  scene.disorder = read_disorder(reader, scene.network.from_file);
  scene.equilibrium.break_on =
      reader.choice("-break_on", {std::pair{"magnitude", BreakOn::magnitude}, {"tension", BreakOn::tension}});
  read_equilibrium(reader, scene);
  scene.ensemble = read_ensemble(reader, scene.disorder.from_file);
  scene.equilibrium.many_samples = scene.ensemble.samples > 1;
  scene.output = read_output(reader);
  scene.options = solver_options();
  for (const auto& [name, value] : reader.used()) scene.options[name] = value;
  return scene;
}

EquilibriumOptions read_strategy() {
  Reader reader;
  Scene scene;
  read_equilibrium(reader, scene);
  return scene.equilibrium;
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

std::string format_options(const std::map<std::string, std::string>& options) {
  std::string text;
  for (const auto& [name, value] : options) text.append(name).append(" ").append(value).append("\n");
  return text;
}

Run make_run(const Scene& scene, const IntactNetwork& intact) {
  if (scene.disorder.from_file && intact.threshold.empty()) {
    throw InputError("-disorder", "file",
                     "uniform: " + scene.network.file + " has no /network/bonds/threshold");
  }
  return {scene.ensemble, scene.disorder, scene.output.record, intact.threshold,
          scene.network.from_file ? 1 : scene.network.row_spacing};
}

RunHeader make_header(const Scene& scene, const IntactNetwork& intact) {
  RunHeader header;
  auto options = scene.options;
  options["-model"] = intact.network.model == Model::fuse ? "fuse" : "spring";
  header.options = format_options(options);
  if (scene.network.from_file) header.checksum = checksum(intact);
  if (!scene.output.record.network) return header;
  header.network = &intact.network;
  if (scene.disorder.from_file) header.threshold = intact.threshold;
  if (!scene.disorder.from_file && scene.ensemble.samples == 1)
    header.threshold = make_thresholds(scene, intact);
  return header;
}

std::vector<double> make_thresholds(const Scene& scene, const IntactNetwork& intact) {
  if (scene.disorder.from_file) {
    const auto given = make_run(scene, intact).threshold;
    return {given.begin(), given.end()};
  }
  std::vector<double> threshold(intact.network.lattice.bond.size());
  draw_thresholds(scene.disorder, scene.ensemble.first_sample, threshold);
  return threshold;
}

}  // namespace crackle
