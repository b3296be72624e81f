#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <numeric>

#include "crackle/base/error.hpp"
#include "crackle/base/hdf5_handle.hpp"

namespace crackle::hdf5 {

namespace fs = std::filesystem;

namespace {

constexpr int kDeepestSource = 8;  // virtual datasets of virtual datasets; more are a loop

/// Names of things that tell their length before they are read: read(buffer, size) gives it.
template <class Read>
std::string read_name(Read read) {
  const ssize_t length = read(nullptr, 0);
  std::string name(length > 0 ? static_cast<std::size_t>(length) + 1 : 1, '\0');
  read(name.data(), name.size());
  name.pop_back();
  return name;
}

std::string file_of(hid_t object) {
  return read_name([object](char* to, std::size_t size) { return H5Fget_name(object, to, size); });
}

/// Where HDF5 looks for a file that another one names.
std::vector<fs::path> places_of(const std::string& name, const std::string& parent) {
  return {fs::path(name), fs::path(parent).parent_path() / fs::path(name).relative_path()};
}

herr_t refuse_special_files(const char* parent, const char* /*group*/, const char* child,
                            const char* /*object*/, unsigned* access, hid_t /*properties*/,
                            void* /*unused*/) {
  *access = H5F_ACC_RDONLY;
  for (const fs::path& place : places_of(child, parent)) {
    std::error_code none;
    const fs::file_status status = fs::status(place, none);
    if (!fs::exists(status) || fs::is_regular_file(status)) continue;
    H5Epush2(H5E_DEFAULT, __FILE__, __func__, __LINE__, H5E_ERR_CLS, H5E_LINK, H5E_CANTOPENFILE,
             "%s is no plain file", place.c_str());
    return -1;
  }
  return 0;
}

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw InputError("dataset " + name + " (" + why + ")", "", "one whose values are all there");
}

hsize_t count_values(hid_t space) {
  return static_cast<hsize_t>(std::max<hssize_t>(0, H5Sget_simple_extent_npoints(space)));
}

std::vector<hsize_t> extent_of(hid_t space) {
  std::vector<hsize_t> extent(static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space))));
  H5Sget_simple_extent_dims(space, extent.data(), nullptr);
  return extent;
}

bool all_chunks_written(hid_t dataset, hid_t properties, hid_t space) {
  std::vector<hsize_t> chunk(extent_of(space));
  std::uint64_t expected = 1;
  H5Pget_chunk(properties, static_cast<int>(chunk.size()), chunk.data());
  const std::vector<hsize_t> extent = extent_of(space);
  for (std::size_t i = 0; i < chunk.size(); ++i)
    expected *= (extent[i] + chunk[i] - 1) / std::max<hsize_t>(1, chunk[i]);
  hsize_t written = 0;
  return H5Dget_num_chunks(dataset, space, &written) >= 0 && written >= expected;
}

bool is_allocated(hid_t dataset) {
  H5D_space_status_t status = H5D_SPACE_STATUS_NOT_ALLOCATED;
  return H5Dget_space_status(dataset, &status) >= 0 && status == H5D_SPACE_STATUS_ALLOCATED;
}

/// External storage: raw files, one after the other.
void check_external(hid_t properties, std::uint64_t bytes, const std::string& name) {
  const int files = H5Pget_external_count(properties);
  for (int i = 0; i < files && bytes > 0; ++i) {
    std::string path(4096, '\0');
    off_t offset = 0;
    hsize_t size = 0;
    H5Pget_external(properties, static_cast<unsigned>(i), path.size(), path.data(), &offset, &size);
    path.resize(std::min(path.find('\0'), path.size()));
    struct stat status {};
    if (stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode))
      refuse(name, path + " is no file to read");
    const std::uint64_t used = std::min<std::uint64_t>(size, bytes);
    if (static_cast<std::uint64_t>(status.st_size) < static_cast<std::uint64_t>(offset) + used) {
      refuse(name, path + " is too short");
    }
    bytes -= used;
  }
  if (bytes > 0) refuse(name, "its external files are too small");
}

void check(hid_t dataset, const std::string& name, int depth);

/// The dataset that one part of a virtual one comes from has all that is taken from it.
void check_source(hid_t dataset, hid_t properties, std::size_t i, const std::string& name, int depth) {
  const std::string file =
      read_name([&](char* to, std::size_t size) { return H5Pget_virtual_filename(properties, i, to, size); });
  const std::string source =
      read_name([&](char* to, std::size_t size) { return H5Pget_virtual_dsetname(properties, i, to, size); });
  const std::string parent = file_of(dataset);
  std::string path = parent;
  if (file != ".") {
    const auto places = places_of(file, parent);
    const auto there = std::ranges::find_if(places, [](const fs::path& place) { return fs::exists(place); });
    if (there == places.end()) refuse(name, "its source " + file + " is not there");
    path = there->string();
  }
  const Handle opened = open_file(path);
  if (!exists(opened, source)) refuse(name, "its source " + file + " has no " + source);
  const Handle from(H5Dopen2(opened, source.c_str(), link_access(Opened::dataset)));
  if (from < 0) refuse(name, "its source " + source + ": " + reason());
  const Handle space(H5Dget_space(from));
  const Handle taken(H5Pget_virtual_srcspace(properties, i));
  const std::vector<hsize_t> extent = extent_of(space);
  std::vector<hsize_t> first(extent.size());
  std::vector<hsize_t> last(extent.size());
  const bool fits = extent_of(taken).size() == extent.size() &&
                    H5Sget_select_bounds(taken, first.data(), last.data()) >= 0 &&
                    std::ranges::equal(last, extent, [](hsize_t a, hsize_t b) { return a < b; });
  if (!fits) refuse(name, "its source " + source + " is smaller than what is taken from it");
  check(from, name + " from " + source, depth + 1);
}

void check_virtual(hid_t dataset, hid_t properties, hsize_t values, const std::string& name, int depth) {
  if (depth > kDeepestSource) refuse(name, "its sources lead back to itself");
  std::size_t parts = 0;
  hsize_t covered = 0;
  H5Pget_virtual_count(properties, &parts);
  for (std::size_t i = 0; i < parts; ++i) {
    const Handle to(H5Pget_virtual_vspace(properties, i));
    const hssize_t count = H5Sget_select_npoints(to);
    if (count < 0 || static_cast<hsize_t>(count) > values)
      refuse(name, "a virtual dataset of unlimited size");
    covered += static_cast<hsize_t>(count);
    check_source(dataset, properties, i, name, depth);
  }
  if (covered < values) refuse(name, "some of its values have no source");
}

void check(hid_t dataset, const std::string& name, int depth) {
  const Handle properties(checked(H5Dget_create_plist(dataset), "look at dataset " + name));
  const Handle space(H5Dget_space(dataset));
  const hsize_t values = count_values(space);
  const H5D_layout_t layout = H5Pget_layout(properties);
  if (values == 0 || layout == H5D_COMPACT) return;
  H5D_fill_value_t fill = H5D_FILL_VALUE_UNDEFINED;
  H5Pfill_value_defined(properties, &fill);
  if (layout == H5D_VIRTUAL) return check_virtual(dataset, properties, values, name, depth);
  if (H5Pget_external_count(properties) > 0) {
    return check_external(properties, values * H5Tget_size(Handle(H5Dget_type(dataset))), name);
  }
  if (fill == H5D_FILL_VALUE_USER_DEFINED) return;
  const bool written =
      layout == H5D_CHUNKED ? all_chunks_written(dataset, properties, space) : is_allocated(dataset);
  if (!written) refuse(name, std::to_string(values) + " numbers, not all of which were ever written");
}

}  // namespace

hid_t link_access(Opened what) {
  static const std::array<hid_t, 3> access = [] {
    std::array<hid_t, 3> all{H5Pcreate(H5P_LINK_ACCESS), H5Pcreate(H5P_GROUP_ACCESS),
                             H5Pcreate(H5P_DATASET_ACCESS)};
    for (const hid_t one : all) checked(H5Pset_elink_cb(one, refuse_special_files, nullptr), "watch links");
    return all;
  }();
  return access[static_cast<std::size_t>(what)];
}

void check_data_is_there(hid_t dataset, const std::string& name) {
  check(dataset, name, 0);
}

}  // namespace crackle::hdf5
