/// Files that are on disk whole, or not there at all.
#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace crackle {

using Bytes = std::vector<std::byte>;

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

}  // namespace crackle
