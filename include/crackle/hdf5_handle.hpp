/// HDF5 at the edge: owned ids, failures as exceptions, vectors in and out.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

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

 private:
  hid_t id_ = -1;
};

/// A new file that replaces any other. Throws InputError, naming it, when it can't be written.
[[nodiscard]] Handle create_file(const std::string& path);
/// An existing file to read. Throws InputError, naming it, when it is missing, truncated or not HDF5.
[[nodiscard]] Handle open_file(const std::string& path);

/// Closes a file that was written. Throws std::runtime_error when not all of it could be: a Handle that goes out of
/// life can't tell.
void close_written(Handle file, const std::string& path);

[[nodiscard]] Handle create_group(hid_t where, const std::string& name);
[[nodiscard]] bool exists(hid_t where, const std::string& name);

void write_attribute(hid_t where, const std::string& name, const std::string& text);
void write_attribute(hid_t where, const std::string& name, double value);
void write_attribute(hid_t where, const std::string& name, std::int32_t value);
[[nodiscard]] std::string read_text(hid_t where, const std::string& name);
[[nodiscard]] double read_number(hid_t where, const std::string& name);

/// A dataset of shape [values.size() / columns] or, with columns > 0, [..][columns]. T: int8, int32, int64,
/// double.
template <class T>
void write(hid_t where, const std::string& name, std::span<const T> values, std::size_t columns = 0);

/// All values of a dataset, converted to T, row by row; its shape in `shape` when asked for. Throws
/// InputError naming the dataset when it is missing, isn't numeric or can't be read.
template <class T>
[[nodiscard]] std::vector<T> read(hid_t where, const std::string& name,
                                  std::vector<hsize_t>* shape = nullptr);

}  // namespace crackle::hdf5
