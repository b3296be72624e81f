#include "crackle/run_merge.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <utility>

#include "crackle/error.hpp"
#include "crackle/hdf5_handle.hpp"
#include "crackle/option_text.hpp"
#include "crackle/run_records.hpp"
#include "crackle/shards.hpp"

namespace crackle {

namespace {

/// A sample and the file that it is from.
struct Found {
  SampleRecord record;
  std::size_t file = 0;
};

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

bool same(const Snapshot& a, const Snapshot& b) {
  return a.number == b.number && same_bits(a.displacement, b.displacement) && same_bits(a.force, b.force);
}

/// The time that they took aside.
bool same(const SampleRecord& a, const SampleRecord& b) {
  const auto numbers = [](const SampleSummary& s) {
    return std::vector{s.peak_load, s.peak_displacement, s.initial_stiffness, static_cast<double>(s.n_p),
                       static_cast<double>(s.n_f)};
  };
  return same_bits(numbers(a.summary), numbers(b.summary)) && a.bond == b.bond && same_bits(a.load, b.load) &&
         same_bits(a.stiffness, b.stiffness) && a.profile_peak == b.profile_peak &&
         a.profile_failure == b.profile_failure &&
         std::ranges::equal(a.snapshots, b.snapshots,
                            [](const auto& x, const auto& y) { return same(x, y); });
}

/// The output of a run, and its shards.
std::vector<std::string> files_of(const std::string& run) {
  std::vector<std::string> files = shard_paths(run);
  if (files.empty() || std::filesystem::exists(run)) files.insert(files.begin(), run);
  return files;
}

void check_one_scene(const std::string& first, const std::string& other) {
  const std::string differing = differing_options(read_options_text(other), read_options_text(first));
  if (!differing.empty()) {
    throw InputError(other + " has " + differing, "",
                     "runs that differ in their samples alone (" + first + ")");
  }
  if (read_checksum(first) != read_checksum(other))
    throw InputError("the network of " + other, "", "that of " + first);
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

/// The group /network, without thresholds when they would be those of one sample among many.
void copy_network(const std::string& from, const std::string& to, bool with_thresholds) {
  const hdf5::Handle source = hdf5::open_file(from);
  hdf5::Handle target(H5Fopen(to.c_str(), H5F_ACC_RDWR, H5P_DEFAULT));
  if (target < 0 || H5Ocopy(source, "network", target, "network", H5P_DEFAULT, H5P_DEFAULT) < 0)
    throw std::runtime_error("HDF5 could not copy /network");
  const char* const threshold = "network/bonds/threshold";
  if (!with_thresholds && hdf5::exists(target, threshold)) H5Ldelete(target, threshold, H5P_DEFAULT);
  hdf5::close_written(std::move(target), to);
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

std::size_t merge_runs(std::span<const std::string> runs, const std::string& output) {
  std::vector<std::string> files;
  for (const std::string& run : runs) {
    for (std::string& file : files_of(run)) files.push_back(std::move(file));
  }
  for (const std::string& file : files) check_one_scene(files.front(), file);
  const std::vector<SampleRecord> records = gather_samples(files, true);
  const std::int64_t first = records.empty() ? 0 : records.front().summary.index;
  const std::int64_t end = records.empty() ? 0 : records.back().summary.index + 1;
  RunHeader header{.options = options_for(read_options_text(files.front()), first, end, output),
                   .checksum = read_checksum(files.front())};
  RecordOptions record;
  bool network = false;
  {
    const hdf5::Handle file = hdf5::open_file(files.front());
    record = {.breaks = hdf5::exists(file, "breaks"),
              .profile = hdf5::exists(file, "profile"),
              .snapshot = hdf5::exists(file, "snapshots")};
    network = hdf5::exists(file, "network");
  }
  write_atomically(output, [&](const std::string& name) {
    write_run(name, header, record, records);
    if (network) copy_network(files.front(), name, records.size() <= 1);
  });
  return records.size();
}

}  // namespace crackle
