#include "crackle/base/hdf5_handle.hpp"

#include <algorithm>
#include <stdexcept>

#include "crackle/base/error.hpp"

namespace crackle::hdf5 {

namespace {

/// The walk's first word is the innermost. "..., error message = 'Permission denied', ..." says what the system said.
herr_t note_reason(unsigned depth, const H5E_error2_t* error, void* out) {
  auto& text = *static_cast<std::string*>(out);
  if (depth > 0 && !text.empty()) return 0;
  text = error->desc == nullptr ? "" : error->desc;
  const std::string quoted = "error message = '";
  const std::size_t at = text.find(quoted);
  if (at != std::string::npos) {
    text.erase(0, at + quoted.size());
    text.erase(std::min(text.find('\''), text.size()));
  }
  std::ranges::replace(text, '\n', ' ');
  return 0;
}

}  // namespace

Handle::~Handle() {
  if (id_ >= 0) H5Idec_ref(id_);
}

void be_quiet() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

std::string reason() {
  std::string text;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, note_reason, &text);
  return text.empty() ? "it doesn't say why" : text;
}

hid_t checked(hid_t id, const std::string& what) {
  if (id < 0) throw std::runtime_error("HDF5 could not " + what + ": " + reason());
  return id;
}

std::string full_name(hid_t where, const std::string& name) {
  std::string path(256, '\0');
  const ssize_t length = H5Iget_name(where, path.data(), path.size());
  path.resize(length < 0 ? 0 : std::min<std::size_t>(static_cast<std::size_t>(length), path.size() - 1));
  return (path == "/" ? "" : path) + "/" + name;
}

}  // namespace crackle::hdf5
