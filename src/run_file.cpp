#include "crackle/run_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "crackle/error.hpp"
#include "crackle/hdf5_handle.hpp"
#include "crackle/option_text.hpp"

namespace crackle {

namespace fs = std::filesystem;

namespace {

void sync_to_disk(const std::string& path, int flags) {
  const int descriptor = open(path.c_str(), flags);  // NOLINT(*-vararg): POSIX
  if (descriptor < 0) return;
  const bool synced = fsync(descriptor) == 0;
  close(descriptor);
  if (!synced) throw std::runtime_error("could not sync " + path + " to disk");
}

std::string folder_of(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

std::vector<std::string> shard_paths(const std::string& folder) {
  std::vector<std::string> paths;
  if (!fs::is_directory(folder)) return paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".h5") paths.push_back(entry.path().string());
  }
  std::ranges::sort(paths);
  return paths;
}

std::string value_of(const std::string& options, const std::string& name) {
  const std::size_t at = ("\n" + options).find("\n" + name + " ");
  if (at == std::string::npos) return "";
  const std::size_t start = at + name.size() + 1;
  return options.substr(start, options.find('\n', start) - start);
}

std::string read_checksum(const std::string& path) {
  const hdf5::Handle file = hdf5::open_file(path);
  return H5Aexists(file, "network_checksum") > 0 ? hdf5::read_text(file, "network_checksum") : "";
}

}  // namespace

RunFile::RunFile(OutputOptions options, RunHeader header)
    : options_(std::move(options)),
      header_(std::move(header)),
      shard_folder_(options_.path + ".shards"),
      last_flush_(std::chrono::steady_clock::now()) {
  const bool there = fs::exists(options_.path) || fs::exists(shard_folder_);
  if (there && !options_.resume && !options_.overwrite) {
    throw InputError(
        "-output", options_.path,
        "a file that doesn't exist yet; -resume continues the run it holds, -overwrite replaces it");
  }
  check_writable();
  if (there && options_.resume) resume();
}

/// By writing: permissions alone don't tell of read-only or special file systems.
void RunFile::check_writable() const {
  const bool other_kind = fs::exists(options_.path) && !fs::is_regular_file(options_.path);
  try {
    if (other_kind) throw InputError("a folder or a device");
    { const hdf5::Handle probe = hdf5::create_file(options_.path + ".part"); }
    fs::remove(options_.path + ".part");
  } catch (const std::exception&) {
    throw InputError("-output", options_.path, "a plain file in a folder that exists and can be written");
  }
}

/// From here on the output is this run's: an old one goes, an empty one stands until the end.
void RunFile::claim() {
  if (claimed_) return;
  const bool theirs = !options_.resume && !options_.overwrite && fs::exists(options_.path);
  if (theirs) throw InputError("-output", options_.path, "a file that no other run has begun meanwhile");
  if (!options_.resume) fs::remove_all(shard_folder_);
  if (!options_.resume || !fs::exists(options_.path)) write_atomically(options_.path, {});
  fs::create_directories(shard_folder_);
  claimed_ = true;
}

void RunFile::resume() {
  std::vector<std::string> paths = shard_paths(shard_folder_);
  if (fs::exists(options_.path)) paths.push_back(options_.path);
  for (const std::string& path : paths) {
    const std::string differing = differing_options(header_.options, read_options_text(path));
    if (!differing.empty()) {
      throw InputError("-resume of " + options_.path + " with " + differing, "",
                       "the options it was begun with");
    }
    if (read_checksum(path) != header_.checksum) {
      throw InputError("-resume of " + options_.path,
                       "with another network than before in " + value_of(header_.options, "-lattice_file"),
                       "the network it was begun with");
    }
    for (const SampleRecord& record : read_records(path)) finished_.insert(record.summary.index);
  }
  while (fs::exists(shard_folder_ + "/" + std::to_string(shards_) + ".h5")) ++shards_;
}

void RunFile::write_atomically(const std::string& path, std::span<const SampleRecord> records) const {
  const std::string temporary = path + ".part";
  try {
    write_run(temporary, header_, options_.record, records);
    sync_to_disk(temporary, O_RDONLY);
    fs::rename(temporary, path);
    sync_to_disk(folder_of(path), O_RDONLY | O_DIRECTORY);
  } catch (...) {
    std::remove(temporary.c_str());
    throw;
  }
}

void RunFile::add(SampleRecord record) {
  waiting_.push_back(std::move(record));
  const std::chrono::duration<double> age = std::chrono::steady_clock::now() - last_flush_;
  if (age.count() >= kFlushSeconds) flush();
}

void RunFile::flush() {
  last_flush_ = std::chrono::steady_clock::now();
  if (waiting_.empty()) return;
  claim();
  write_atomically(shard_folder_ + "/" + std::to_string(shards_) + ".h5", waiting_);
  ++shards_;
  waiting_.clear();
}

std::vector<SampleRecord> RunFile::collect() const {
  std::vector<SampleRecord> all = read_records(options_.path);
  for (const std::string& path : shard_paths(shard_folder_)) {
    for (SampleRecord& record : read_records(path)) all.push_back(std::move(record));
  }
  const auto index = [](const SampleRecord& record) { return record.summary.index; };
  std::ranges::stable_sort(all, {}, index);
  const auto repeated = std::ranges::unique(all, {}, index);
  all.erase(repeated.begin(), repeated.end());
  return all;
}

std::vector<SampleSummary> RunFile::finish() {
  flush();
  if (!fs::exists(options_.path)) claim();  // a run killed before its first merge has shards only
  const std::vector<SampleRecord> all = collect();
  if (fs::exists(shard_folder_)) {
    write_atomically(options_.path, all);
    fs::remove_all(shard_folder_);
  }
  std::vector<SampleSummary> summaries;
  summaries.reserve(all.size());
  for (const SampleRecord& record : all) summaries.push_back(record.summary);
  return summaries;
}

}  // namespace crackle
