#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "crackle/base/hdf5_handle.hpp"
#include "crackle/base/hdf5_type.hpp"

namespace crackle::hdf5 {

namespace {

/// A file in memory grows by so many bytes at a time.
constexpr std::size_t kIncrement = std::size_t{1} << 18;
/// Values are stored, and have their checksum, in pieces of at most so many bytes.
constexpr std::size_t kChunk = std::size_t{1} << 20;
/// Where a superblock says how long the file is; HDF5 File Format Specification 3.0, II.A, versions 2 and 3.
constexpr std::size_t kEndOfFile = 28;

void put_attribute(hid_t where, const std::string& name, hid_t type, const void* value) {
  const std::string what = "write attribute " + name;
  const Handle space(checked(H5Screate(H5S_SCALAR), what));
  const Handle attribute(
      checked(H5Acreate2(where, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), what));
  checked(H5Awrite(attribute, type, value), what);
}

/// Not to compress at all: that would cost more than all else that writing does.
constexpr unsigned kStored = 0;

/// In chunks with checksums; what has no values needs none. Fletcher's sums don't tell the words 0x0000 and 0xFFFF
/// apart; the stream of zlib, which has Adler's, does.
Handle creation_of(std::vector<hsize_t> shape, std::size_t bytes_per_value) {
  Handle properties(checked(H5Pcreate(H5P_DATASET_CREATE), "make properties"));
  checked(H5Pset_obj_track_times(properties, false), "leave out times");
  if (std::ranges::find(shape, hsize_t{0}) != shape.end()) return properties;
  const std::size_t row = shape.size() > 1 ? shape[1] * bytes_per_value : bytes_per_value;
  shape[0] = std::clamp<hsize_t>(kChunk / row, 1, shape[0]);
  checked(H5Pset_chunk(properties, static_cast<int>(shape.size()), shape.data()), "divide a dataset");
  checked(H5Pset_deflate(properties, kStored), "ask for zlib's checksums");
  checked(H5Pset_fletcher32(properties), "ask for checksums");
  return properties;
}

}  // namespace

/// The memory of a file that is being written. HDF5 makes it larger, and leaves it to us when it closes the file.
struct NewFile::Image {
  std::byte* data = nullptr;

  ~Image() { std::free(data); }  // NOLINT(*-no-malloc): as HDF5 grows it by realloc

  H5FD_file_image_callbacks_t callbacks() {
    using Operation = H5FD_file_image_op_t;
    // NOLINTBEGIN(*-no-malloc)
    return {
        .image_malloc = [](std::size_t size, Operation, void*) { return std::malloc(size); },
        .image_memcpy = [](void* to, const void* from, std::size_t size, Operation,
                           void*) { return std::memcpy(to, from, size); },
        .image_realloc = [](void* old, std::size_t size, Operation,
                            void*) { return std::realloc(old, size); },
        .image_free =
            [](void* old, Operation operation, void* image) {
              if (operation == H5FD_FILE_IMAGE_OP_FILE_CLOSE) {
                static_cast<Image*>(image)->data = static_cast<std::byte*>(old);
              } else {
                std::free(old);
              }
              return herr_t{0};
            },
        .udata_copy = [](void* image) { return image; },
        .udata_free = [](void*) { return herr_t{0}; },
        .udata = this,
    };
    // NOLINTEND(*-no-malloc)
  }
};

NewFile::NewFile() : image_(std::make_unique<Image>()) {
  be_quiet();
  const Handle access(checked(H5Pcreate(H5P_FILE_ACCESS), "make properties"));
  H5FD_file_image_callbacks_t callbacks = image_->callbacks();
  checked(H5Pset_fapl_core(access, kIncrement, false), "keep a file in memory");
  checked(H5Pset_file_image_callbacks(access, &callbacks), "keep a file in memory");
  checked(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110), "write its newer format");
  checked(H5Pset_fclose_degree(access, H5F_CLOSE_SEMI), "close a file whole");
  file_ =
      Handle(checked(H5Fcreate("in memory", H5F_ACC_TRUNC, H5P_DEFAULT, access), "make a file in memory"));
}

NewFile::~NewFile() = default;

Bytes NewFile::finish() {
  checked(H5Fclose(file_), "close a file in memory");
  file_.release();
  std::uint64_t size = 0;
  std::memcpy(&size, image_->data + kEndOfFile, sizeof size);
  return {std::exchange(image_->data, nullptr), size};
}

Handle create_group(hid_t where, const std::string& name) {
  return Handle(
      checked(H5Gcreate2(where, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), "make group " + name));
}

void write_attribute(hid_t where, const std::string& name, const std::string& text) {
  const Handle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type, text.size() + 1);
  put_attribute(where, name, type, text.c_str());
}

void write_attribute(hid_t where, const std::string& name, double value) {
  put_attribute(where, name, H5T_NATIVE_DOUBLE, &value);
}

void write_attribute(hid_t where, const std::string& name, std::int32_t value) {
  put_attribute(where, name, H5T_NATIVE_INT32, &value);
}

template <class T>
void write(hid_t where, const std::string& name, std::span<const T> values, std::size_t columns) {
  std::vector<hsize_t> shape{values.size()};
  if (columns > 0) shape = {values.size() / columns, columns};
  const std::string what = "write " + full_name(where, name);
  const Handle space(checked(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), what));
  const Handle properties = creation_of(shape, sizeof(T));
  const Handle data(checked(
      H5Dcreate2(where, name.c_str(), memory_type<T>(), space, H5P_DEFAULT, properties, H5P_DEFAULT), what));
  checked(H5Dwrite(data, memory_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), what);
}

template void write(hid_t, const std::string&, std::span<const std::int8_t>, std::size_t);
template void write(hid_t, const std::string&, std::span<const std::int32_t>, std::size_t);
template void write(hid_t, const std::string&, std::span<const std::int64_t>, std::size_t);
template void write(hid_t, const std::string&, std::span<const double>, std::size_t);

}  // namespace crackle::hdf5
