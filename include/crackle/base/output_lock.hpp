/// One writer for every output: OUTPUT.shards/ and the lock in it.
#pragma once

#include <string>

namespace crackle {

/// The folder beside an output that is being written.
[[nodiscard]] std::string shard_folder(const std::string& output);

/// Where a file that is to become OUTPUT is written first, in that folder.
[[nodiscard]] std::string temporary_of(const std::string& output);

/// Held by the program that writes an output, whichever it is. The system lets go of it when the process ends, however
/// it ends.
class OutputLock {
 public:
  OutputLock() = default;
  ~OutputLock() { release(); }
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

  /// Makes the folder if it isn't there and takes the lock; nothing when it is held already. Throws InputError when
  /// another program has it, WriteError when it can't be made.
  void take(const std::string& output);

  /// Removes what runs and merges leave in the folder (is_removable); the lock must be held.
  void clear() const;

  /// Lets go. A lock file that take() made goes, and so does the folder when nothing else is in it.
  void release();

 private:
  [[nodiscard]] bool try_once(const std::string& path);

  std::string output_;
  int descriptor_ = -1;
  bool is_new_ = false;  ///< no killed run has left it
};

/// Whether it is a plain file named by a number and this ending: a shard (".h5"), say. What else somebody has put into
/// the folder is neither read nor removed.
[[nodiscard]] bool is_ours(const std::string& path, const char* ending);

/// Whether a run, a merge or a comparison has made it: shards, checkpoints, and what a kill has left of any file.
[[nodiscard]] bool is_removable(const std::string& path);

/// The first name in the folder of an output that is neither that nor the lock; empty when there is none.
[[nodiscard]] std::string stranger_beside(const std::string& output);

/// Throws InputError, with the system's reason, when `output` can't be made a plain file: by making one beside it, as
/// permissions alone don't tell of read-only or special file systems. Its name is gone at once, so that a kill leaves
/// nothing behind.
void check_writable(const std::string& output);

}  // namespace crackle
