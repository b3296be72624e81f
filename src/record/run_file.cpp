#include "crackle/record/run_file.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/record/run_merge.hpp"

namespace crackle {

namespace fs = std::filesystem;

RunFile::RunFile(OutputOptions options, RunHeader header)
    : options_(std::move(options)),
      header_(std::move(header)),
      shards_(options_.path, header_, options_.record, 0, options_.writers) {
  const bool there = fs::exists(options_.path) || fs::exists(shard_folder(options_.path));
  if (there && !options_.resume && !options_.overwrite) {
    throw InputError(
        "-output", options_.path,
        "a file that doesn't exist yet; -resume continues the run it holds, -overwrite replaces it");
  }
  check_writable(options_.path);
  if (!there || !options_.resume) return;
  if (fs::exists(shard_folder(options_.path))) lock_.take(options_.path);
  resume();
}

void RunFile::claim() {
  if (claimed_) return;
  const auto refuse_theirs = [this] {
    if (options_.resume || options_.overwrite || !fs::exists(options_.path)) return;
    throw InputError("-output", options_.path, "a file that no other run has begun meanwhile");
  };
  refuse_theirs();
  lock_.take(options_.path);
  refuse_theirs();
  if (!options_.resume || !fs::exists(options_.path)) write_output({});
  if (!options_.resume) lock_.clear();  // after the new output is there: a full disk takes nothing away
  claimed_ = true;
}

void RunFile::resume() {
  std::vector<std::string> paths = shard_paths(options_.path);
  for (const std::string& path : checkpoint_paths(options_.path)) paths.push_back(path);
  if (fs::exists(options_.path)) paths.push_back(options_.path);
  for (const std::string& path : paths) {
    check_scene(path);
    if (path.ends_with(kCheckpoint)) continue;
    for (const SampleRecord& record : read_records(path)) finished_.insert(record.summary.index);
  }
}

void RunFile::check_scene(const std::string& path) const {
  const RunHeader theirs = read_header(path);
  const std::string differing = differing_options(header_, theirs);
  if (!differing.empty()) {
    throw InputError("-resume of " + options_.path + " with " + differing, "",
                     "the options it was begun with");
  }
  if (theirs.checksum != header_.checksum) {
    throw InputError("-resume of " + options_.path,
                     "with another network than before in " + option_value(header_.options, "-lattice_file"),
                     "the network it was begun with");
  }
}

void RunFile::write_output(std::span<const SampleRecord> records) const {
  write_for_run(options_.path, temporary_of(options_.path), format_run(header_, options_.record, records));
}

void RunFile::add(SampleRecord record) {
  shards_.add(std::move(record));
  if (shards_.due()) flush();
}

void RunFile::flush() {
  if (!shards_.waiting()) return;
  claim();
  shards_.flush();
}

/// Checkpoints of samples that are still to be finished stay.
void RunFile::clear_folder(const std::set<std::int64_t>& merged) const {
  std::set<std::string> kept;
  for (const std::string& path : checkpoint_paths(options_.path)) kept.insert(path);
  for (const std::int64_t index : merged) kept.erase(checkpoint_path(options_.path, index));
  std::error_code ignored;  // what stays is the same as what the output has
  for (const auto& entry : fs::directory_iterator(shard_folder(options_.path), ignored)) {
    const std::string path = entry.path().string();
    if (!kept.contains(path) && is_removable(path)) fs::remove(path, ignored);
  }
}

std::vector<SampleSummary> RunFile::finish() {
  flush();
  if (!fs::exists(options_.path)) claim();  // a run killed before its first merge has shards only
  std::vector<std::string> files = shard_paths(options_.path);
  files.insert(files.begin(), options_.path);
  for (const std::string& file : files) check_scene(file);  // nobody else has written there meanwhile
  const std::vector<SampleRecord> all = gather_samples(files, false);
  std::vector<SampleSummary> summaries;
  std::set<std::int64_t> merged;
  summaries.reserve(all.size());
  for (const SampleRecord& record : all) {
    summaries.push_back(record.summary);
    merged.insert(record.summary.index);
  }
  if (fs::exists(shard_folder(options_.path))) {
    lock_.take(options_.path);
    write_output(all);
    clear_folder(merged);
    lock_.release();
  }
  return summaries;
}

}  // namespace crackle
