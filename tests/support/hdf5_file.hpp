/// HDF5 files of a test's own.
#pragma once

#include <string>

#include "crackle/base/durable_file.hpp"
#include "crackle/base/hdf5_handle.hpp"

namespace crackle::test {

/// A file with what `fill` writes into it.
template <class Fill>
void write_hdf5(const std::string& path, Fill fill) {
  hdf5::NewFile file;
  fill(static_cast<hid_t>(file));
  write_durably(path, path + ".part", file.finish());
}

}  // namespace crackle::test
