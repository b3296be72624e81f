#include "crackle/hdf5_handle.hpp"

#include <filesystem>
#include <stdexcept>
#include <type_traits>

#include "crackle/error.hpp"

namespace crackle::hdf5 {

namespace {

template <class T>
hid_t memory_type() {
  if constexpr (std::is_same_v<T, std::int8_t>) return H5T_NATIVE_INT8;
  if constexpr (std::is_same_v<T, std::int32_t>) return H5T_NATIVE_INT32;
  if constexpr (std::is_same_v<T, std::int64_t>) return H5T_NATIVE_INT64;
  if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
}

/// HDF5 prints its stack of errors unless told not to; ours are one line.
void be_quiet() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

hid_t checked(hid_t id, const std::string& what) {
  if (id < 0) throw std::runtime_error("HDF5 could not " + what);
  return id;
}

std::string full_name(hid_t where, const std::string& name) {
  std::string path(256, '\0');
  const ssize_t length = H5Iget_name(where, path.data(), path.size());
  path.resize(length < 0 ? 0 : std::min<std::size_t>(static_cast<std::size_t>(length), path.size() - 1));
  return (path == "/" ? "" : path) + "/" + name;
}

void put_attribute(hid_t where, const std::string& name, hid_t type, const void* value) {
  const Handle space(checked(H5Screate(H5S_SCALAR), "describe attribute " + name));
  const Handle attribute(checked(H5Acreate2(where, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                                 "write attribute " + name));
  if (H5Awrite(attribute, type, value) < 0)
    throw std::runtime_error("HDF5 could not write attribute " + name);
}

/// An attribute of one value, which is `kind` ("a number").
Handle open_attribute(hid_t where, const std::string& name, const std::string& kind) {
  if (H5Aexists(where, name.c_str()) <= 0) throw InputError("attribute " + name, "", "present in the file");
  Handle attribute(checked(H5Aopen(where, name.c_str(), H5P_DEFAULT), "open attribute " + name));
  const Handle space(H5Aget_space(attribute));
  if (H5Sget_simple_extent_npoints(space) != 1) throw InputError("attribute " + name, "", kind);
  return attribute;
}

}  // namespace

Handle::~Handle() {
  if (id_ < 0) return;
  switch (H5Iget_type(id_)) {
    case H5I_FILE:
      H5Fclose(id_);
      break;
    case H5I_GROUP:
      H5Gclose(id_);
      break;
    case H5I_DATASET:
      H5Dclose(id_);
      break;
    case H5I_DATASPACE:
      H5Sclose(id_);
      break;
    case H5I_DATATYPE:
      H5Tclose(id_);
      break;
    case H5I_ATTR:
      H5Aclose(id_);
      break;
    default:
      break;
  }
}

Handle create_file(const std::string& path) {
  be_quiet();
  Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  if (file < 0) throw InputError("output file", path, "a path that can be written");
  return file;
}

Handle open_file(const std::string& path) {
  be_quiet();
  if (!std::filesystem::exists(path)) throw InputError("file", path, "an HDF5 file that exists");
  Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  if (file < 0) throw InputError("file", path, "a whole, readable HDF5 file");
  return file;
}

void close_written(Handle file, const std::string& path) {
  if (H5Fflush(file, H5F_SCOPE_GLOBAL) < 0) throw std::runtime_error("HDF5 could not write " + path);
}

Handle create_group(hid_t where, const std::string& name) {
  return Handle(
      checked(H5Gcreate2(where, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), "make group " + name));
}

bool exists(hid_t where, const std::string& name) {
  for (std::size_t end = 0; end != std::string::npos;) {
    end = name.find('/', end + 1);
    if (H5Lexists(where, name.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
  }
  return true;
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

std::string read_text(hid_t where, const std::string& name) {
  const std::string kind = "a text of fixed length";
  const Handle attribute = open_attribute(where, name, kind);
  const Handle type(H5Aget_type(attribute));
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0) {
    throw InputError("attribute " + name, "", kind);
  }
  std::string text(H5Tget_size(type), '\0');
  if (H5Aread(attribute, type, text.data()) < 0) throw InputError("attribute " + name, "", "readable");
  text.resize(text.find('\0') == std::string::npos ? text.size() : text.find('\0'));
  return text;
}

double read_number(hid_t where, const std::string& name) {
  const Handle attribute = open_attribute(where, name, "a number");
  double value = 0;
  if (H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0)
    throw InputError("attribute " + name, "", "a number");
  return value;
}

template <class T>
void write(hid_t where, const std::string& name, std::span<const T> values, std::size_t columns) {
  std::vector<hsize_t> shape{values.size()};
  if (columns > 0) shape = {values.size() / columns, columns};
  const std::string what = "write " + full_name(where, name);
  const Handle space(checked(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), what));
  const Handle data(checked(
      H5Dcreate2(where, name.c_str(), memory_type<T>(), space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), what));
  if (H5Dwrite(data, memory_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    throw std::runtime_error("HDF5 could not " + what);
  }
}

template <class T>
std::vector<T> read(hid_t where, const std::string& name, std::vector<hsize_t>* shape) {
  if (!exists(where, name)) throw InputError("dataset " + full_name(where, name), "", "present in the file");
  const Handle data(H5Dopen2(where, name.c_str(), H5P_DEFAULT));
  const Handle space(data < 0 ? -1 : H5Dget_space(data));
  const int rank = space < 0 ? -1 : H5Sget_simple_extent_ndims(space);
  if (rank < 0) throw InputError("dataset " + full_name(where, name), "", "an array of numbers");
  const Handle type(H5Dget_type(data));
  const H5T_class_t kind = H5Tget_class(type);
  if (kind != H5T_INTEGER && (kind != H5T_FLOAT || std::is_integral_v<T>)) {
    throw InputError("dataset " + full_name(where, name), "",
                     std::is_integral_v<T> ? "an array of integers" : "an array of numbers");
  }
  std::vector<hsize_t> extent(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space, extent.data(), nullptr);
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  if (H5Dread(data, memory_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    throw InputError("dataset " + full_name(where, name), "", "an array of numbers that can be read whole");
  }
  if (shape != nullptr) *shape = extent;
  return values;
}

template void write(hid_t, const std::string&, std::span<const std::int8_t>, std::size_t);
template void write(hid_t, const std::string&, std::span<const std::int32_t>, std::size_t);
template void write(hid_t, const std::string&, std::span<const std::int64_t>, std::size_t);
template void write(hid_t, const std::string&, std::span<const double>, std::size_t);
template std::vector<std::int8_t> read(hid_t, const std::string&, std::vector<hsize_t>*);
template std::vector<std::int32_t> read(hid_t, const std::string&, std::vector<hsize_t>*);
template std::vector<std::int64_t> read(hid_t, const std::string&, std::vector<hsize_t>*);
template std::vector<double> read(hid_t, const std::string&, std::vector<hsize_t>*);

}  // namespace crackle::hdf5
