#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <new>
#include <stdexcept>
#include <type_traits>

#include "crackle/base/error.hpp"
#include "crackle/base/hdf5_handle.hpp"
#include "crackle/base/hdf5_type.hpp"

namespace crackle::hdf5 {

namespace {

/// An attribute of one value, which is `kind` ("a number").
Handle open_attribute(hid_t where, const std::string& name, const std::string& kind) {
  if (!has_attribute(where, name)) throw InputError("attribute " + name, "", "present in the file");
  Handle attribute(H5Aopen(where, name.c_str(), H5P_DEFAULT));
  if (attribute < 0) throw InputError("attribute " + name + " (" + reason() + ")", "", "readable");
  const Handle space(H5Aget_space(attribute));
  if (H5Sget_simple_extent_npoints(space) != 1) throw InputError("attribute " + name, "", kind);
  return attribute;
}

/// Of a value that HDF5 converts to T without another meaning.
template <class T>
void check_kind(hid_t type, const std::string& name) {
  const H5T_class_t kind = H5Tget_class(type);
  if (kind == H5T_INTEGER || (kind == H5T_FLOAT && !std::is_integral_v<T>)) return;
  throw InputError("dataset " + name, "",
                   std::is_integral_v<T> ? "an array of integers" : "an array of numbers");
}

/// As many values as the dataset says it has.
template <class T>
std::vector<T> make_room(hid_t space, const std::string& name) {
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  if (count < 0) throw InputError("dataset " + name, "", "an array of numbers");
  try {
    return std::vector<T>(static_cast<std::size_t>(count));
  } catch (const std::exception&) {  // bad_alloc, length_error
    throw InputError("dataset " + name + " of " + std::to_string(count) + " numbers", "",
                     "what memory holds");
  }
}

}  // namespace

Handle open_file(const std::string& path) {
  be_quiet();
  const auto refuse = [&path](const std::string& why) {
    throw InputError("file", path + " (" + why + ")", "a whole, readable HDF5 file that exists");
  };
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) refuse(system_reason(errno));
  if (S_ISDIR(status.st_mode)) refuse("a folder");
  if (!S_ISREG(status.st_mode)) refuse("no plain file");
  if (access(path.c_str(), R_OK) != 0) refuse(system_reason(errno));
  Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  if (file < 0) refuse(reason());
  return file;
}

Handle open_group(hid_t where, const std::string& name) {
  Handle group(H5Gopen2(where, name.c_str(), link_access(Opened::group)));
  if (group < 0) throw InputError("group " + full_name(where, name) + " (" + reason() + ")", "", "a group");
  return group;
}

bool exists(hid_t where, const std::string& name) {
  for (std::size_t end = 0; end != std::string::npos;) {
    end = name.find('/', end + 1);
    const std::string part = name.substr(0, end);
    const htri_t there = H5Lexists(where, part.c_str(), link_access(Opened::link));
    if (there < 0) throw InputError(full_name(where, part) + " (" + reason() + ")", "", "readable");
    if (there == 0) return false;
  }
  return true;
}

bool has_attribute(hid_t where, const std::string& name) {
  return H5Aexists(where, name.c_str()) > 0;
}

std::string read_text(hid_t where, const std::string& name) {
  const std::string kind = "a text of fixed length";
  const Handle attribute = open_attribute(where, name, kind);
  const Handle type(H5Aget_type(attribute));
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0) {
    throw InputError("attribute " + name, "", kind);
  }
  std::string text(H5Tget_size(type), '\0');
  if (H5Aread(attribute, type, text.data()) < 0) {
    throw InputError("attribute " + name + " (" + reason() + ")", "", "readable");
  }
  text.resize(std::min(text.find('\0'), text.size()));
  return text;
}

double read_number(hid_t where, const std::string& name) {
  const Handle attribute = open_attribute(where, name, "a number");
  double value = 0;
  if (H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0) {
    throw InputError("attribute " + name + " (" + reason() + ")", "", "a number");
  }
  return value;
}

template <class T>
std::vector<T> read(hid_t where, const std::string& name, std::vector<hsize_t>* shape) {
  const std::string whole_name = full_name(where, name);
  if (!exists(where, name)) throw InputError("dataset " + whole_name, "", "present in the file");
  const Handle data(H5Dopen2(where, name.c_str(), link_access(Opened::dataset)));
  if (data < 0) throw InputError("dataset " + whole_name + " (" + reason() + ")", "", "an array of numbers");
  const Handle space(H5Dget_space(data));
  const int rank = space < 0 ? -1 : H5Sget_simple_extent_ndims(space);
  if (rank < 0) throw InputError("dataset " + whole_name, "", "an array of numbers");
  check_kind<T>(Handle(H5Dget_type(data)), whole_name);
  check_data_is_there(data, whole_name);
  std::vector<hsize_t> extent(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space, extent.data(), nullptr);
  std::vector<T> values = make_room<T>(space, whole_name);
  if (!values.empty() && H5Dread(data, memory_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    throw InputError("dataset " + whole_name + " (" + reason() + ")", "",
                     "an array of numbers that can be read whole");
  }
  if (shape != nullptr) *shape = extent;
  return values;
}

template std::vector<std::int8_t> read(hid_t, const std::string&, std::vector<hsize_t>*);
template std::vector<std::int32_t> read(hid_t, const std::string&, std::vector<hsize_t>*);
template std::vector<std::int64_t> read(hid_t, const std::string&, std::vector<hsize_t>*);
template std::vector<double> read(hid_t, const std::string&, std::vector<hsize_t>*);

}  // namespace crackle::hdf5
