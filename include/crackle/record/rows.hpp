/// Datasets that have a row, or a number of them, for each sample.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "crackle/base/error.hpp"
#include "crackle/base/hdf5_handle.hpp"
#include "crackle/record/record.hpp"

namespace crackle {

/// One dataset of the vectors that every record has, end to end; columns: as many a row, 0: no rows.
template <class T>
void write_joined(hid_t where, const std::string& name, std::span<const SampleRecord> records,
                  std::vector<T> SampleRecord::*part, std::size_t columns = 0) {
  std::vector<T> values;
  for (const SampleRecord& record : records) {
    values.insert(values.end(), (record.*part).begin(), (record.*part).end());
  }
  hdf5::write<T>(where, name, values, columns);
}

/// A dataset of one value for each of `rows`, or with columns != nullptr of a row of as many each.
template <class T>
std::vector<T> read_rows(hid_t file, const std::string& name, std::size_t rows,
                         std::size_t* columns = nullptr) {
  std::vector<hsize_t> shape;
  std::vector<T> values = hdf5::read<T>(file, name, &shape);
  if (shape.size() != (columns == nullptr ? 1 : 2) || shape[0] != rows) {
    throw InputError("shape of dataset /" + name, "",
                     "[" + std::to_string(rows) + "]" + (columns == nullptr ? "" : "[..]"));
  }
  if (columns != nullptr) *columns = static_cast<std::size_t>(shape[1]);
  return values;
}

/// The values that belong to one row.
template <class T>
std::vector<T> row_of(const std::vector<T>& values, std::size_t row, std::size_t columns) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(row * columns);
  return {begin, begin + static_cast<std::ptrdiff_t>(columns)};
}

/// One dataset GROUP/NAME of a number that every record has: SampleRecord::number of that name; 0 where it is missing.
inline void write_number(hid_t file, const std::string& name, std::span<const SampleRecord> records) {
  std::vector<double> values;
  for (const SampleRecord& record : records) {
    const auto found = record.number.find(name);
    values.push_back(found == record.number.end() ? 0 : found->second);
  }
  hdf5::write<double>(file, name, values);
}

inline void read_number(hid_t file, const std::string& name, std::span<SampleRecord> records) {
  const std::vector<double> values = read_rows<double>(file, name, records.size());
  for (std::size_t s = 0; s < records.size(); ++s) records[s].number[name] = values[s];
}

}  // namespace crackle
