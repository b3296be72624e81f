/// Files that are on disk whole, or not there at all.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

namespace crackle {

/// The bytes of a file, in memory that malloc gave.
class Bytes {
 public:
  Bytes(std::byte* data, std::size_t size) : data_(data), size_(size) {}
  operator std::span<const std::byte>() const {
    return {data_.get(), size_};
  }  // NOLINT(*-explicit-*): a view

 private:
  struct Free {
    void operator()(std::byte* data) const { std::free(data); }  // NOLINT(*-no-malloc)
  };
  std::unique_ptr<std::byte, Free> data_;
  std::size_t size_;
};

/// A file could not be written: names it and the system's reason. Nothing of that name has changed.
class WriteError : public std::runtime_error {
 public:
  /// "could not write run.h5: No space left on device". reason: an errno.
  WriteError(const std::string& path, int reason);
  WriteError(const std::string& path, const std::string& reason);

  /// "No space left on device"
  [[nodiscard]] const std::string& reason() const { return reason_; }

 private:
  std::string reason_;
};

/// What the system says of an errno: "No space left on device".
[[nodiscard]] std::string system_reason(int error);

/// The file that a path leads to: symbolic links followed, also to a file that isn't there yet. Throws InputError for
/// links that lead nowhere but back to themselves.
[[nodiscard]] std::string follow_links(const std::string& path);

/// Writes `content` to a new file `temporary`, syncs it, reads it back, compares, gives it the name `path`, and syncs
/// the folder. A file that `path` names already keeps its permissions. Both names must be on one file system; what
/// stands at `temporary` goes, a link itself rather than what it leads to.
///
/// Throws WriteError when any of that fails: a full disk, say, which a system may tell of as late as in the sync.
void write_durably(const std::string& path, const std::string& temporary, std::span<const std::byte> content);

/// Syncs the folder that `path` is in, so that a name that was made there stays. Throws WriteError naming `path`.
void sync_folder_of(const std::string& path);

}  // namespace crackle
