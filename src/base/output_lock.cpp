#include "crackle/base/output_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <utility>

#include "crackle/base/durable_file.hpp"
#include "crackle/base/error.hpp"

namespace crackle {

namespace fs = std::filesystem;

namespace {

constexpr const char* kLock = "lock";
constexpr const char* kOutputPart = "output.part";
constexpr mode_t kForAll = 0666;  // less the user's mask

}  // namespace

std::string shard_folder(const std::string& output) {
  return output + ".shards";
}

std::string temporary_of(const std::string& output) {
  return shard_folder(output) + "/" + kOutputPart;
}

bool is_ours(const std::string& path, const char* ending) {
  std::error_code ignored;
  std::string name = fs::path(path).filename().string();
  const bool digits = name.find_first_not_of("0123456789") == name.size() - std::string(ending).size();
  return digits && name.front() != '.' && name.ends_with(ending) &&
         fs::is_regular_file(fs::symlink_status(path, ignored));
}

bool is_removable(const std::string& path) {
  std::error_code ignored;
  const bool whole = fs::is_regular_file(fs::symlink_status(path, ignored));
  if (whole && fs::path(path).filename() == kOutputPart) return true;
  for (const char* ending : {".h5", ".checkpoint", ".h5.part", ".checkpoint.part"}) {
    if (is_ours(path, ending)) return true;
  }
  return false;
}

std::string stranger_beside(const std::string& output) {
  std::error_code ignored;
  std::string first;
  for (const auto& entry : fs::directory_iterator(shard_folder(output), ignored)) {
    const std::string name = entry.path().filename().string();
    if (name == kLock || is_removable(entry.path().string())) continue;
    if (first.empty() || name < first) first = name;
  }
  return first;
}

void OutputLock::take(const std::string& output) {
  if (descriptor_ >= 0) return;
  output_ = output;
  while (!try_once(shard_folder(output) + "/" + kLock)) {
  }
}

/// False: its last holder took it away between our steps.
bool OutputLock::try_once(const std::string& path) {
  std::error_code failure;
  const bool made = fs::create_directories(shard_folder(output_), failure);
  if (failure) throw WriteError(shard_folder(output_), failure.message());
  if (made) sync_folder_of(shard_folder(output_));
  is_new_ = !fs::exists(path);
  const int descriptor =
      open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kForAll);  // NOLINT(*-vararg): POSIX
  if (descriptor < 0 && errno == ENOENT) return false;
  if (descriptor < 0) throw WriteError(path, errno);
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    close(descriptor);
    throw InputError("-output", output_, "a file that no other run is writing");
  }
  struct stat status {};
  if (fstat(descriptor, &status) == 0 && status.st_nlink > 0) {
    descriptor_ = descriptor;
    return true;
  }
  close(descriptor);
  return false;
}

void OutputLock::clear() const {
  std::error_code ignored;  // what can't be removed does no harm: it is looked at before it is used
  for (const auto& entry : fs::directory_iterator(shard_folder(output_), ignored)) {
    if (is_removable(entry.path().string())) fs::remove(entry.path(), ignored);
  }
}

void OutputLock::release() {
  if (descriptor_ < 0) return;
  const std::string folder = shard_folder(output_);
  std::error_code ignored;
  const bool alone = fs::exists(folder) && std::distance(fs::directory_iterator(folder, ignored), {}) == 1;
  if (is_new_ || alone) unlink((folder + "/" + kLock).c_str());
  if (alone) rmdir(folder.c_str());
  close(std::exchange(descriptor_, -1));
}

void check_writable(const std::string& output) {
  const char* const allowed = "a plain file in a folder that exists and can be written";
  if (fs::is_directory(output)) throw InputError("-output", output + " (a folder)", allowed);
  if (fs::exists(output) && !fs::is_regular_file(output)) {
    throw InputError("-output", output + " (no plain file)", allowed);
  }
  const std::string name = output + ".part" + std::to_string(getpid());
  const int probe =
      open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, kForAll);  // NOLINT(*-vararg)
  if (probe < 0) throw InputError("-output", output + " (" + system_reason(errno) + ")", allowed);
  unlink(name.c_str());
  close(probe);
}

}  // namespace crackle
