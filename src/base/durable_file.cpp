#include "crackle/base/durable_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "crackle/base/error.hpp"

namespace crackle {

namespace fs = std::filesystem;

namespace {

constexpr int kMostLinks = 40;  // as many as Linux follows
constexpr std::size_t kPiece = std::size_t{1} << 20;

/// Owns a file descriptor. Complaints name the file `path`, which the one at `place` is to become.
class Descriptor {
 public:
  Descriptor(const std::string& path, const std::string& place, int flags, mode_t mode = 0)
      : path_(path), descriptor_(::open(place.c_str(), flags | O_CLOEXEC, mode)) {  // NOLINT(*-vararg): POSIX
    if (descriptor_ < 0) throw WriteError(path, errno);
  }
  ~Descriptor() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  operator int() const { return descriptor_; }  // NOLINT(*-explicit-*): handed to the system as it is

  /// EINVAL: a file system that has no such thing.
  void sync() const {
    if (fsync(descriptor_) != 0 && errno != EINVAL) throw WriteError(path_, errno);
  }
  /// Some systems tell only here that there was no room.
  void close() {
    if (::close(std::exchange(descriptor_, -1)) != 0) throw WriteError(path_, errno);
  }

 private:
  const std::string& path_;
  int descriptor_;
};

void write_all(const Descriptor& file, const std::string& path, std::span<const std::byte> content) {
  while (!content.empty()) {
    const ssize_t written = write(file, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw WriteError(path, errno);
    if (written == 0) throw WriteError(path, ENOSPC);
    content = content.subspan(static_cast<std::size_t>(written));
  }
}

void compare(const std::string& path, const std::string& temporary, std::span<const std::byte> content) {
  const Descriptor file(path, temporary, O_RDONLY | O_NOFOLLOW);
  std::vector<std::byte> piece(std::min(kPiece, content.size() + 1));
  while (true) {
    const ssize_t count = read(file, piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw WriteError(path, errno);
    const auto size = static_cast<std::size_t>(count);
    if (size > content.size() || (size == 0 && !content.empty()) ||
        (size > 0 && std::memcmp(piece.data(), content.data(), size) != 0)) {
      throw WriteError(path, "what was read back is not what was written");
    }
    if (size == 0) return;
    content = content.subspan(size);
  }
}

/// Of the file that is replaced, where the file system has permissions.
void keep_mode(const Descriptor& file, const std::string& path) {
  constexpr mode_t kPermissions = 07777;
  struct stat status {};
  if (stat(path.c_str(), &status) != 0 || fchmod(file, status.st_mode & kPermissions) == 0) return;
  if (errno != EPERM && errno != ENOTSUP) throw WriteError(path, errno);
}

void replace(const std::string& path, const std::string& temporary, std::span<const std::byte> content) {
  constexpr mode_t kForAll = 0666;  // less the user's mask
  unlink(temporary.c_str());
  Descriptor file(path, temporary, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW, kForAll);
  write_all(file, path, content);
  keep_mode(file, path);
  file.sync();
  file.close();
  compare(path, temporary, content);
  if (rename(temporary.c_str(), path.c_str()) != 0) throw WriteError(path, errno);
}

}  // namespace

WriteError::WriteError(const std::string& path, int reason) : WriteError(path, system_reason(reason)) {}

WriteError::WriteError(const std::string& path, const std::string& reason)
    : std::runtime_error("could not write " + path + ": " + reason), reason_(reason) {}

std::string system_reason(int error) {
  return std::generic_category().message(error);
}

std::string follow_links(const std::string& path) {
  fs::path place = path;
  for (int links = 0; links < kMostLinks; ++links) {
    std::error_code none;
    const fs::path target = fs::read_symlink(place, none);
    if (none) return place.string();
    place = target.is_absolute() ? target : place.parent_path() / target;
  }
  throw InputError("path", path, "one whose symbolic links come to an end");
}

void write_durably(const std::string& path, const std::string& temporary,
                   std::span<const std::byte> content) {
  try {
    replace(path, temporary, content);
  } catch (...) {
    unlink(temporary.c_str());
    throw;
  }
  sync_folder_of(path);
}

void sync_folder_of(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  const std::string place = folder.empty() ? "." : folder.string();
  if (access(place.c_str(), R_OK) == 0) Descriptor(path, place, O_RDONLY | O_DIRECTORY).sync();
}

}  // namespace crackle
