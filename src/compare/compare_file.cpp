#include "crackle/compare/compare_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>

#include "crackle/base/durable_file.hpp"
#include "crackle/base/error.hpp"
#include "crackle/base/hdf5_handle.hpp"
#include "crackle/base/version.hpp"
#include "crackle/scene/scene.hpp"

namespace crackle {

namespace {

void write_head(hid_t file, const std::string& options_text) {
  hdf5::write_attribute(file, "kind", std::string("comparison"));
  hdf5::write_attribute(file, "schema_version", kCompareSchemaVersion);
  hdf5::write_attribute(file, "code_version", std::string(kVersion));
  hdf5::write_attribute(file, "options", options_text);
  const std::time_t now = std::time(nullptr);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&now));
  hdf5::write_attribute(file, "created", std::string(text.data()));
}

void write_reference(hid_t file, const ReferenceRun& run) {
  const hdf5::Handle group = hdf5::create_group(file, "reference");
  hdf5::write_attribute(group, "name", run.name);
  hdf5::write_attribute(group, "failed", static_cast<std::int32_t>(run.failed));
  hdf5::write_attribute(group, "peak_load", run.peak_load);
  hdf5::write_attribute(group, "n_p", static_cast<std::int32_t>(run.n_p));
  hdf5::write_attribute(group, "n_f", static_cast<std::int32_t>(run.n_f));
  hdf5::write_attribute(group, "skip", static_cast<std::int32_t>(run.skip));
  hdf5::write_attribute(group, "seconds", run.seconds);
  hdf5::write<BondId>(group, "bond", run.bond);
  hdf5::write<double>(group, "load", run.load);
  hdf5::write<double>(group, "stiffness", run.stiffness);
  hdf5::write<std::int64_t>(group, "number", run.number);
  hdf5::write<double>(group, "error", run.error);
}

void write_strategy(hid_t where, const std::string& name, const StrategyRun& run,
                    const ReferenceRun& reference) {
  const hdf5::Handle group = hdf5::create_group(where, name);
  const std::string options = format_options(run.choice.options);
  for (const auto& [attribute, text] :
       {std::pair{"name", run.choice.name}, std::pair{"file", run.choice.file}, std::pair{"options", options},
        std::pair{"rtol", run.choice.rtol}, std::pair{"complaint", run.complaint}}) {
    hdf5::write_attribute(group, attribute, text);
  }
  for (const auto& [attribute, number] :
       {std::pair{"first_difference", run.first_difference}, std::pair{"differences", run.differences},
        std::pair{"n_p", run.n_p}, std::pair{"n_f", run.n_f}, std::pair{"memory", run.memory},
        std::pair{"factorizations", run.counts.factorizations}, std::pair{"refactors", run.counts.refactors},
        std::pair{"confirmations", run.counts.confirmations}, std::pair{"iterations", run.counts.iterations},
        std::pair{"doubtful", run.counts.doubtful}, std::pair{"first_doubtful", run.counts.first_doubtful}}) {
    hdf5::write_attribute(group, attribute, static_cast<double>(number));
  }
  hdf5::write_attribute(group, "peak_load", run.peak_load);
  hdf5::write_attribute(group, "peak_error", std::abs(run.peak_load / reference.peak_load - 1));
  hdf5::write_attribute(group, "largest_residual", run.counts.largest_residual);
  hdf5::write_attribute(group, "smallest_slack", run.counts.smallest_slack);
  hdf5::write<double>(group, "time", run.time, reference.number.size());
  hdf5::write<double>(group, "total", run.total);
  hdf5::write<double>(group, "set_up", run.set_up);
  hdf5::write<double>(group, "phase", run.phase, kPhases);
  hdf5::write<std::int64_t>(group, "iterations", run.iterations);
  hdf5::write<double>(group, "residual", run.residual);
  hdf5::write<double>(group, "backward_error", run.backward_error);
  hdf5::write<double>(group, "force_error", run.force_error);
  hdf5::write<double>(group, "load_error", run.load_error);
}

}  // namespace

CompareFile::CompareFile(const CompareOptions& options) : path_(follow_links(options.path)) {
  check_writable(path_);
  const bool there = std::filesystem::exists(path_) || std::filesystem::exists(shard_folder(path_));
  if (there && !options.overwrite) {
    throw InputError("-output", options.path + " (which exists)", "another path, or -overwrite");
  }
  lock_.take(path_);
}

void CompareFile::write(const std::string& options_text, const ReferenceRun& reference,
                        std::span<const StrategyRun> runs) {
  hdf5::NewFile file;
  write_head(file, options_text);
  write_reference(file, reference);
  {
    const hdf5::Handle group = hdf5::create_group(file, "strategies");
    const std::size_t digits = std::max<std::size_t>(3, std::to_string(runs.size()).size());
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const std::string number = std::to_string(i);
      write_strategy(group, std::string(digits - number.size(), '0') + number, runs[i], reference);
    }
  }
  write_durably(path_, temporary_of(path_), file.finish());
  lock_.clear();
}

}  // namespace crackle
