#include "crackle/scene/scene.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <limits>
#include <set>
#include <span>

#include "crackle/base/error.hpp"
#include "crackle/base/option_files.hpp"
#include "crackle/base/petsc_handle.hpp"
#include "crackle/base/solver_values.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "crackle/record/part.hpp"
#include "crackle/record/part_profile.hpp"
#include "crackle/scene/choices.hpp"
#include "crackle/scene/option_reader.hpp"
#include "crackle/scene/option_table.hpp"

namespace crackle {

namespace {

constexpr std::int64_t kMostSamples = 1'000'000'000;

StiffnessOptions read_stiffness(Reader& reader) {
  StiffnessOptions options;
  options.law = &reader.choice("-stiffness", stiffness_laws());
  if (options.law->contrasts) options.contrast = reader.number<double>("-stiffness_contrast");
  options.dilution = reader.number<double>("-lattice_dilution");
  options.seed = reader.listed_number<std::uint64_t>("-seed");
  return options;
}

NetworkOptions read_network(Reader& reader) {
  NetworkOptions options;
  const bool from_file = reader.text("-lattice") == "file";
  options.lattice = from_file ? nullptr : &reader.choice("-lattice", lattice_kinds());
  if (!from_file || reader.given("-model")) options.model = reader.choice("-model", kModels).value;
  options.grips = reader.choice("-grips", kGrips).value;
  if (from_file) {
    options.file = reader.text("-lattice_file");
    if (options.file.empty()) throw InputError("-lattice_file", "not given", allowed_of("-lattice_file"));
    return options;
  }
  options.size = reader.listed_number<int>("-lattice_size");
  options.row_spacing = reader.number<double>("-lattice_row_spacing");
  options.stiffness = read_stiffness(reader);
  return options;
}

DisorderOptions read_disorder(Reader& reader, bool network_from_file) {
  DisorderOptions options;
  options.from_file = reader.text("-disorder") == "file";
  if (options.from_file && !network_from_file) {
    throw InputError("-disorder", "file", any_of(names_of(threshold_laws())) + " without -lattice file");
  }
  if (options.from_file) return options;
  options.law = &reader.choice("-disorder", threshold_laws());
  if (options.law->exponent != nullptr) options.exponent = reader.number<double>("-disorder_exponent");
  options.zero_share = reader.number<double>("-disorder_zero_share");
  options.seed = reader.listed_number<std::uint64_t>("-seed");
  return options;
}

StopRule read_stop(Reader& reader) {
  const std::string value = reader.text("-stop");
  const std::size_t equals = value.find('=');
  const std::string kind = value.substr(0, equals);
  const std::string digits = equals == std::string::npos ? "" : value.substr(equals + 1);
  if (value == "failure") return {};
  if (kind == "breaks") {
    if (const auto limit = Reader::parse_within<int>(digits, allow::integer(0)))
      return {StopRule::Kind::breaks, static_cast<double>(*limit)};
  }
  const double most = kind == "stiffness" ? 1 : kNoBound;
  const auto limit = Reader::parse_within<double>(digits, allow::number(0, most));
  if (kind == "stiffness" && limit) return {StopRule::Kind::stiffness, *limit};
  if (kind == "displacement" && limit) return {StopRule::Kind::displacement, *limit};
  throw InputError("-stop", value, allowed_of("-stop"));
}

RecordOptions read_record(Reader& reader) {
  RecordOptions record;
  record.parts.clear();
  const std::string list = reader.text("-record");
  const std::vector<std::string> known = record_words();
  for (const std::string& word : list == "none" ? std::vector<std::string>{} : split(list)) {
    if (std::ranges::find(known, word) == known.end())
      throw InputError("-record", list, allowed_of("-record"));
    if (word == "network") {
      record.network = true;
    } else {
      record.parts.insert(word);
    }
  }
  if (record.has("profile") && reader.given("-record_profile_height"))
    record.profile_height = reader.number<double>("-record_profile_height");
  if (!record.has("snapshot")) return record;
  const std::string numbers = reader.text("-record_snapshot_at");
  for (const std::string& word : split(numbers)) {
    const auto at = Reader::parse_within<std::int32_t>(word, allow::integer(1));
    if (!at) throw InputError("-record_snapshot_at", numbers, allowed_of("-record_snapshot_at"));
    record.snapshot_at.push_back(*at);
  }
  if (record.snapshot_at.empty()) {
    throw InputError("-record_snapshot_at", "not given", allowed_of("-record_snapshot_at"));
  }
  std::ranges::sort(record.snapshot_at);
  return record;
}

/// paper.h5 of the sizes 8 and 16: paper_8.h5, paper_16.h5.
std::string output_of_size(const std::string& path, int size) {
  const std::filesystem::path whole(path);
  const std::string name = whole.stem().string() + "_" + std::to_string(size) + whole.extension().string();
  return (whole.parent_path() / name).string();
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

EnsembleOptions read_ensemble(Reader& reader) {
  EnsembleOptions options;
  options.samples = reader.listed_number<std::int64_t>("-samples");
  options.first_sample = reader.listed_number<std::int64_t>("-first_sample");
  options.ranks_per_sample = reader.number<int>("-ensemble_ranks_per_sample");
  options.checkpoint_every = reader.number<double>("-checkpoint_every");
  options.checkpoint_breaks = reader.number<std::int64_t>("-checkpoint_breaks");
  options.stop = read_stop(reader);
  options.monitor = reader.choice("-monitor", kMonitors).value;
  if (options.samples > kMostSamples ||
      options.first_sample > std::numeric_limits<std::int64_t>::max() - kMostSamples) {
    throw InputError("-first_sample " + std::to_string(options.first_sample) + " -samples",
                     std::to_string(options.samples), "at most 1e9 samples, each with a number of 64 bits");
  }
  return options;
}

/// Those that every processor of the run has: a sample's bits must not depend on who breaks it. Collective.
std::span<const TreeKernels* const> common_kernels() {
  const auto own = tree_kernels();  // the fastest first; who runs one runs those after it
  auto fewest = static_cast<int>(own.size());
  petsc::check(MPI_Allreduce(MPI_IN_PLACE, &fewest, 1, MPI_INT, MPI_MIN, PETSC_COMM_WORLD));
  return own.last(static_cast<std::size_t>(fewest));
}

/// What `auto` stands for is noted by its name: a run that goes on elsewhere must have the same last bits.
const TreeKernels* read_kernels(Reader& reader) {
  const char* const name = "-equilibrium_tree_kernels";
  const std::string value = reader.text(name);
  std::string allowed = "auto";
  for (const TreeKernels* kernels : common_kernels()) {
    if (value == "auto" || value == kernels->name) {
      (void)reader.note(name, kernels->name);
      return kernels;
    }
    allowed.append(", ").append(kernels->name);
  }
  throw InputError(name, value, allowed + " (what this processor has)");
}

/// Tells of a KSP that only a .petscrc or PETSC_OPTIONS wants, which one forgets.
std::string note_unasked_solver() {
  std::string note;
  for (const GivenOption& option : given_options()) {
    if (!reaches_solver(option.name)) continue;
    if (option.asked) return "";
    note = option.name + " in " + option.place + " asks for a KSP: -equilibrium is ksp, not tree";
  }
  return note;
}

void read_strategy(Reader& reader, Scene& scene) {
  // who names a KSP or a PC, if only to view it, wants it used; and no other strategy shares a sample
  const bool shared = scene.ensemble.ranks_per_sample > 1;
  const bool named = reader.given("-equilibrium") || (solver_options().empty() && !shared);
  if (!named && !shared) scene.note = note_unasked_solver();
  scene.equilibrium.strategy = named ? reader.text("-equilibrium") : reader.note("-equilibrium", "ksp");
  if (shared && scene.equilibrium.strategy != "ksp") {
    throw InputError("-ensemble_ranks_per_sample", std::to_string(scene.ensemble.ranks_per_sample),
                     "1 with -equilibrium " + scene.equilibrium.strategy + ", more with ksp");
  }
  // quad refines every answer until it is as good as can be, and knows its error
  if (scene.equilibrium.strategy != "quad") {
    scene.equilibrium.common.check_every = reader.number<std::int64_t>("-equilibrium_check");
  }
  if (scene.equilibrium.common.check_every > 0) {
    scene.equilibrium.common.check_bound = reader.number<double>("-equilibrium_check_bound");
  }
  if (scene.equilibrium.strategy == "ksp") {
    check_solver_values();
    scene.equilibrium.ksp.refactor_every = reader.number<int>("-equilibrium_refactor_every");
  }
  if (scene.equilibrium.strategy != "tree") return;
  scene.equilibrium.tree.kernels = read_kernels(reader);
  scene.equilibrium.tree.precision = reader.choice("-equilibrium_tree_precision", kPrecisions).value;
  scene.equilibrium.tree.threads = reader.number<int>("-equilibrium_tree_threads");
  scene.equilibrium.tree.verify = reader.flag("-equilibrium_tree_verify");
  scene.tree_view = reader.flag("-equilibrium_tree_view");
}

/// Whether every sample of the run has thresholds; of drawn ones, only the first is tried.
void check_thresholds(const Scene& scene, const IntactNetwork& intact) {
  if (!scene.disorder.from_file) return;
  if (intact.threshold.empty()) {
    throw InputError("-disorder", "file",
                     "uniform: " + scene.network.file + " has no /network/bonds/threshold");
  }
  const std::size_t rows = intact.threshold.size() / intact.network.lattice.bond.size();
  const std::int64_t samples = scene.ensemble.samples;
  if (rows == 1 && samples == 1) return;
  if (rows == 1) {
    throw InputError(
        "-samples", std::to_string(samples),
        "1 with -disorder file and a /network/bonds/threshold of one row: every sample is the same");
  }
  if (scene.ensemble.first_sample + samples > static_cast<std::int64_t>(rows)) {
    throw InputError("-first_sample " + std::to_string(scene.ensemble.first_sample) + " -samples",
                     std::to_string(samples),
                     "samples 0 to " + std::to_string(rows - 1) +
                         ", the rows of /network/bonds/threshold in " + scene.network.file);
  }
}

/// Height of a profile's sections.
double section_height(const Scene& scene, const IntactNetwork& intact) {
  if (!scene.output.record.has("profile")) return 1;
  double height = scene.output.record.profile_height;
  if (height == 0) {
    height = scene.network.lattice == nullptr ? usual_section_height(intact.network.lattice)
                                              : scene.network.row_spacing;
  }
  check_section_height(intact.network.lattice, height);
  return height;
}

/// As many digits as it takes to read the same number back.
std::string shortest(double value) {
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

Scene read_scene(Reader reader) {
  Scene scene;
  scene.help = reader.given("-help");
  scene.network = read_network(reader);
  scene.disorder = read_disorder(reader, scene.network.lattice == nullptr);
  scene.equilibrium.common.break_on = reader.choice("-break_on", kBreakOns).value;
  scene.ensemble = read_ensemble(reader);
  read_strategy(reader, scene);
  scene.equilibrium.common.many_samples = scene.ensemble.samples > 1;
  scene.output = read_output(reader);
  if (reader.parts() > 1) {
    scene.output.path = reader.note("-output", output_of_size(scene.output.path, scene.network.size));
  }
  scene.options = solver_options();
  for (const auto& [name, value] : reader.used()) scene.options[name] = value;
  return scene;
}

/// How many sizes the run has.
std::size_t count_sizes() {
  Reader reader;
  if (reader.text("-lattice") == "file") return 1;
  return std::max<std::size_t>(1, split(reader.text("-lattice_size")).size());
}

}  // namespace

std::vector<Scene> read_scenes() {
  reject_stray_words();
  std::vector<Scene> scenes;
  std::set<int> sizes;
  const std::size_t parts = count_sizes();
  for (std::size_t part = 0; part < parts; ++part) {
    scenes.push_back(read_scene(Reader(part, parts)));
    if (!sizes.insert(scenes.back().network.size).second) {
      throw InputError("-lattice_size", Reader().text("-lattice_size"), "every size once");
    }
  }
  return scenes;
}

ChosenStrategy read_strategy() {
  Reader reader;
  Scene scene;
  read_strategy(reader, scene);
  return scene.equilibrium;
}

std::string format_options(const std::map<std::string, std::string>& options) {
  std::string text;
  for (const auto& [name, value] : options) text.append(name).append(" ").append(value).append("\n");
  return text;
}

Run make_run(const Scene& scene, const IntactNetwork& intact, const RunHeader& header) {
  (void)make_thresholds(scene, intact);
  return {.network = intact.network,
          .equilibrium = scene.equilibrium,
          .ensemble = scene.ensemble,
          .disorder = scene.disorder,
          .output = scene.output,
          .header = header,
          .threshold = intact.threshold,
          .section_height = section_height(scene, intact)};
}

RunHeader make_header(const Scene& scene, const IntactNetwork& intact) {
  RunHeader header;
  auto options = scene.options;
  options["-model"] = intact.network.model == Model::fuse ? "fuse" : "spring";
  if (scene.network.lattice == nullptr && scene.output.record.has("profile"))
    options["-record_profile_height"] = shortest(section_height(scene, intact));
  header.options = format_options(options);
  for (const auto& [name, value] : options) {
    if (decides_results(name)) header.deciding.push_back(name);
  }
  header.nodes = intact.network.lattice.nodes();
  header.components = intact.network.components;
  header.bonds = intact.network.bonds();
  if (scene.network.lattice == nullptr) header.checksum = checksum(intact);
  if (!scene.output.record.network) return header;
  header.network = &intact.network;
  if (scene.disorder.from_file) header.threshold = intact.threshold;
  if (!scene.disorder.from_file && scene.ensemble.samples == 1)
    header.threshold = make_thresholds(scene, intact);
  return header;
}

std::vector<double> make_thresholds(const Scene& scene, const IntactNetwork& intact) {
  check_thresholds(scene, intact);
  const std::size_t bonds = intact.network.lattice.bond.size();
  std::vector<double> threshold(bonds);
  if (!scene.disorder.from_file) {
    draw_thresholds(scene.disorder, scene.ensemble.first_sample, threshold);
    return threshold;
  }
  const bool one_row = intact.threshold.size() == bonds;
  const auto row = intact.threshold.begin() +
                   (one_row ? 0 : scene.ensemble.first_sample * static_cast<std::ptrdiff_t>(bonds));
  std::copy_n(row, bonds, threshold.begin());
  return threshold;
}

}  // namespace crackle
