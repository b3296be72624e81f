#include "crackle/record/run_merge.hpp"

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <utility>

#include "crackle/base/durable_file.hpp"
#include "crackle/base/error.hpp"
#include "crackle/base/output_lock.hpp"
#include "crackle/record/part.hpp"
#include "crackle/record/run_records.hpp"
#include "crackle/record/shards.hpp"

namespace crackle {

namespace fs = std::filesystem;

namespace {

/// A sample and the file that it is from.
struct Found {
  SampleRecord record;
  std::size_t file = 0;
};

/// The time that they took aside.
bool same(const SampleRecord& a, const SampleRecord& b) {
  const auto numbers = [](const SampleSummary& s) {
    return std::vector{s.peak_load, s.peak_displacement, s.initial_stiffness, static_cast<double>(s.n_p),
                       static_cast<double>(s.n_f)};
  };
  return same_bits(numbers(a.summary), numbers(b.summary)) &&
         std::ranges::all_of(record_parts(), [&](const RecordPart* part) { return part->same(a, b); });
}

/// The output of a run, and its shards.
std::vector<std::string> files_of(const std::string& run) {
  const std::string place = follow_links(run);
  std::vector<std::string> files = shard_paths(place);
  if (files.empty() || fs::exists(place)) files.insert(files.begin(), place);
  return files;
}

void check_one_scene(const std::string& first, const std::string& other) {
  const RunHeader ours = read_header(first);
  const RunHeader theirs = read_header(other);
  const std::string differing = differing_options(theirs, ours);
  if (!differing.empty()) {
    throw InputError(other + " has " + differing, "",
                     "runs that differ in their samples alone (" + first + ")");
  }
  if (ours.checksum != theirs.checksum) throw InputError("the network of " + other, "", "that of " + first);
}

/// The options of a run that has these samples.
std::string options_for(const std::string& text, std::int64_t first, std::int64_t end,
                        const std::string& output) {
  std::string result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::string name = line.substr(0, line.find(' '));
    if (name == "-samples") line = "-samples " + std::to_string(end - first);
    if (name == "-first_sample") line = "-first_sample " + std::to_string(first);
    if (name == "-output") line = "-output " + output;
    result += line + "\n";
  }
  return result;
}

void check_output(const std::string& output, bool overwrite) {
  check_writable(output);
  if (overwrite || !(fs::exists(output) || fs::exists(shard_folder(output)))) return;
  throw InputError("-output", output, "a file that doesn't exist yet; -overwrite replaces it");
}

std::vector<std::string> list_files(std::span<const std::string> runs) {
  std::vector<std::string> files;
  for (const std::string& run : runs) {
    for (std::string& file : files_of(run)) files.push_back(std::move(file));
  }
  return files;
}

Bytes merge_files(std::span<const std::string> files, const std::string& output, std::size_t& samples) {
  for (const std::string& file : files) check_one_scene(files.front(), file);
  const std::vector<SampleRecord> records = gather_samples(files, true);
  samples = records.size();
  const std::int64_t first = records.empty() ? 0 : records.front().summary.index;
  const std::int64_t end = records.empty() ? 0 : records.back().summary.index + 1;
  RunHeader header = read_header(files.front());
  header.options = options_for(header.options, first, end, output);
  const RecordOptions parts = read_parts(files.front());
  return parts.network ? format_run(header, parts, records, files.front())
                       : format_run(header, parts, records);
}

/// A run that goes on may put its shards together while they are read: what is there then is read anew.
Bytes merge(std::vector<std::string> files, std::span<const std::string> runs, const std::string& output,
            std::size_t& samples) {
  while (true) {
    try {
      return merge_files(files, output, samples);
    } catch (const InputError&) {
      std::vector<std::string> now = list_files(runs);
      if (now == files) throw;
      files = std::move(now);
    }
  }
}

}  // namespace

std::vector<SampleRecord> gather_samples(std::span<const std::string> paths, bool check) {
  std::vector<Found> all;
  for (std::size_t file = 0; file < paths.size(); ++file) {
    for (SampleRecord& record : read_records(paths[file])) all.push_back({std::move(record), file});
  }
  const auto index = [](const Found& found) { return found.record.summary.index; };
  std::ranges::stable_sort(all, {}, index);
  std::vector<SampleRecord> records;
  std::size_t file = 0;
  for (Found& found : all) {
    if (records.empty() || records.back().summary.index != index(found)) {
      records.push_back(std::move(found.record));
      file = found.file;
    } else if (check && !same(records.back(), found.record)) {
      throw InputError("sample " + std::to_string(index(found)) + " of " + paths[found.file], "",
                       "the same as in " + paths[file]);
    }
  }
  return records;
}

std::size_t merge_runs(std::span<const std::string> runs, const std::string& output, bool overwrite) {
  const std::string place = follow_links(output);
  check_output(place, overwrite);
  OutputLock lock;
  lock.take(place);
  std::size_t samples = 0;
  write_durably(place, temporary_of(place), merge(list_files(runs), runs, output, samples));
  lock.clear();
  return samples;
}

}  // namespace crackle
