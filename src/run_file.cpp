#include "crackle/run_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "crackle/error.hpp"
#include "crackle/hdf5_handle.hpp"
#include "crackle/option_text.hpp"
#include "crackle/run_merge.hpp"

namespace crackle {

namespace fs = std::filesystem;

namespace {

constexpr const char* kLock = "/lock";

std::string value_of(const std::string& options, const std::string& name) {
  const std::size_t at = ("\n" + options).find("\n" + name + " ");
  if (at == std::string::npos) return "";
  const std::size_t start = at + name.size() + 1;
  return options.substr(start, options.find('\n', start) - start);
}

}  // namespace

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
  check_writable();
  if (!there || !options_.resume) return;
  try {
    if (fs::exists(shard_folder(options_.path))) lock();
    resume();
  } catch (...) {
    unlock();
    throw;
  }
}

RunFile::~RunFile() {
  unlock();
}

/// By making a file: permissions alone don't tell of read-only or special file systems. Its name is gone at once, so
/// that a kill leaves nothing behind.
void RunFile::check_writable() const {
  const bool other_kind = fs::exists(options_.path) && !fs::is_regular_file(options_.path);
  const std::string name = options_.path + ".part" + std::to_string(getpid());
  const int probe =
      other_kind ? -1
                 : open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);  // NOLINT(*-vararg)
  if (probe < 0)
    throw InputError("-output", options_.path, "a plain file in a folder that exists and can be written");
  unlink(name.c_str());
  close(probe);
}

/// The system lets go of the lock when the process ends, however it ends.
void RunFile::lock() {
  if (lock_ >= 0) return;
  const std::string path = shard_folder(options_.path) + kLock;
  while (true) {
    lock_is_new_ = !fs::exists(path);
    const int descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);  // NOLINT(*-vararg): POSIX
    if (descriptor < 0) throw InputError("-output", options_.path, "a file in a folder that can be written");
    if (flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      close(descriptor);
      throw InputError("-output", options_.path, "a file that no other run is writing");
    }
    struct stat status {};
    if (fstat(descriptor, &status) == 0 && status.st_nlink > 0) {
      lock_ = descriptor;
      return;
    }
    close(descriptor);  // its holder took it away between our two steps
  }
}

void RunFile::unlock() {
  if (lock_ < 0) return;
  if (lock_is_new_) std::remove((shard_folder(options_.path) + kLock).c_str());
  close(std::exchange(lock_, -1));
}

void RunFile::claim() {
  if (claimed_) return;
  const auto refuse_theirs = [this] {
    if (options_.resume || options_.overwrite || !fs::exists(options_.path)) return;
    throw InputError("-output", options_.path, "a file that no other run has begun meanwhile");
  };
  refuse_theirs();
  fs::create_directories(shard_folder(options_.path));
  lock();
  refuse_theirs();
  if (!options_.resume) {
    for (const auto& entry : fs::directory_iterator(shard_folder(options_.path))) {
      if ("/" + entry.path().filename().string() != kLock) fs::remove_all(entry.path());
    }
  }
  if (!options_.resume || !fs::exists(options_.path)) {
    write_atomically(options_.path,
                     [this](const std::string& name) { write_run(name, header_, options_.record, {}); });
  }
  claimed_ = true;
}

void RunFile::resume() {
  std::vector<std::string> paths = shard_paths(options_.path);
  for (const std::string& path : checkpoint_paths(options_.path)) paths.push_back(path);
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
    if (path.ends_with(kCheckpoint)) continue;
    for (const SampleRecord& record : read_records(path)) finished_.insert(record.summary.index);
  }
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
  const std::string folder = shard_folder(options_.path);
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!kept.contains(entry.path().string())) fs::remove_all(entry.path());
  }
  if (kept.empty()) fs::remove(folder);
}

std::vector<SampleSummary> RunFile::finish() {
  flush();
  if (!fs::exists(options_.path)) claim();  // a run killed before its first merge has shards only
  std::vector<std::string> files = shard_paths(options_.path);
  files.insert(files.begin(), options_.path);
  const std::vector<SampleRecord> all = gather_samples(files, false);
  std::vector<SampleSummary> summaries;
  std::set<std::int64_t> merged;
  summaries.reserve(all.size());
  for (const SampleRecord& record : all) {
    summaries.push_back(record.summary);
    merged.insert(record.summary.index);
  }
  if (fs::exists(shard_folder(options_.path))) {
    lock();
    write_atomically(options_.path,
                     [&](const std::string& name) { write_run(name, header_, options_.record, all); });
    clear_folder(merged);
    unlock();
  }
  return summaries;
}

}  // namespace crackle
