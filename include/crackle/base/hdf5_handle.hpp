/// HDF5 at the edge: owned ids, failures as exceptions with HDF5's own reason, vectors in and out.
///
/// What is written carries checksums: those of HDF5's Fletcher32 filter and of zlib on every dataset that has values, and
/// those of HDF5's newer file format (1.10) on everything else. Reading checks them.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "crackle/base/durable_file.hpp"

namespace crackle::hdf5 {

/// Owns one HDF5 id of any kind.
class Handle {
 public:
  Handle() = default;
  explicit Handle(hid_t id) : id_(id) {}
  ~Handle();
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  operator hid_t() const { return id_; }  // NOLINT(*-explicit-*): handed to HDF5's functions as it is
  /// Owns it no more.
  void release() { id_ = -1; }

 private:
  hid_t id_ = -1;
};

/// HDF5 prints its stack of errors unless told not to; ours are one line.
void be_quiet();

/// Why the last call of HDF5 failed, in its own words: the innermost of its stack of errors. Ask at once: every call,
/// closing among them, clears it.
[[nodiscard]] std::string reason();

/// `id`; throws std::runtime_error "HDF5 could not <what>: <reason>" when it is that of a failure.
hid_t checked(hid_t id, const std::string& what);

/// "/network/bonds/nodes"
[[nodiscard]] std::string full_name(hid_t where, const std::string& name);

/// A new file in memory: HDF5 itself never meets a full disk, which it can't tell of to the end.
class NewFile {
 public:
  NewFile();
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  operator hid_t() const { return file_; }  // NOLINT(*-explicit-*)

  /// Closes it and gives its bytes; the last call. Groups and datasets of it must have been closed.
  [[nodiscard]] Bytes finish();

 private:
  struct Image;
  std::unique_ptr<Image> image_;
  Handle file_;
};

/// An existing file to read. Throws InputError, naming it and the reason, when it is missing, not permitted, locked,
/// truncated, no plain file or not HDF5.
[[nodiscard]] Handle open_file(const std::string& path);

[[nodiscard]] Handle create_group(hid_t where, const std::string& name);
/// A group that exists(); throws InputError for what is no group.
[[nodiscard]] Handle open_group(hid_t where, const std::string& name);
/// Something has that name, if only a link that leads nowhere. Throws InputError, with the reason, when that can't be told.
[[nodiscard]] bool exists(hid_t where, const std::string& name);
[[nodiscard]] bool has_attribute(hid_t where, const std::string& name);

void write_attribute(hid_t where, const std::string& name, const std::string& text);
void write_attribute(hid_t where, const std::string& name, double value);
void write_attribute(hid_t where, const std::string& name, std::int32_t value);
[[nodiscard]] std::string read_text(hid_t where, const std::string& name);
[[nodiscard]] double read_number(hid_t where, const std::string& name);

/// A dataset of shape [values.size() / columns] or, with columns > 0, [..][columns]. T: int8, int32, int64,
/// double.
template <class T>
void write(hid_t where, const std::string& name, std::span<const T> values, std::size_t columns = 0);

/// All values of a dataset, converted to T, row by row; its shape in `shape` when asked for. Throws InputError naming
/// the dataset and the reason when it is missing, isn't numeric, can't be read, is damaged, is larger than what memory
/// holds, or has values that were never written or that are in a file which is not there (see check_data_is_there).
template <class T>
[[nodiscard]] std::vector<T> read(hid_t where, const std::string& name,
                                  std::vector<hsize_t>* shape = nullptr);

/// HDF5 reads zeros where it has nothing. Throws InputError for a dataset with values that were never written (unless
/// it names a value for them itself), of a virtual dataset's source that is missing, or smaller than what is taken from
/// it, and for external storage that is missing, too short or no plain file.
void check_data_is_there(hid_t dataset, const std::string& name);

/// How links to other files are followed, to open something: to plain files only, as a pipe would never answer. The
/// properties live as long as HDF5.
enum class Opened : std::uint8_t { link, group, dataset };
[[nodiscard]] hid_t link_access(Opened what);

}  // namespace crackle::hdf5
