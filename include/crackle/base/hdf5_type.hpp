/// HDF5's names of our types.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <type_traits>

namespace crackle::hdf5 {

/// T: int8, int32, int64, double.
template <class T>
hid_t memory_type() {
  if constexpr (std::is_same_v<T, std::int8_t>) return H5T_NATIVE_INT8;
  if constexpr (std::is_same_v<T, std::int32_t>) return H5T_NATIVE_INT32;
  if constexpr (std::is_same_v<T, std::int64_t>) return H5T_NATIVE_INT64;
  if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
}

}  // namespace crackle::hdf5
