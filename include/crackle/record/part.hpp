/// The parts of a run file that `-record` asks for: one table. A new one is a file part_NAME.cpp, a row in part.cpp, and a
/// reader in Python.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "crackle/base/hdf5_handle.hpp"
#include "crackle/fracture/observer.hpp"
#include "crackle/record/judge.hpp"
#include "crackle/record/record.hpp"

namespace crackle {

/// What an observer may need to know beforehand.
struct PartScene {
  const Network& network;
  const RecordOptions& options;
  double section_height = 1;  ///< of a profile
};

/// What the head of a file says of its samples.
struct RecordFacts {
  BondId bonds = 0;                ///< of the network; 0: not known
  std::int64_t displacements = 0;  ///< nodes times components; 0: not known
  RecordOptions record;            ///< the parts that every sample has at least
};

struct RecordPart {
  const char* name;     ///< in `-record`
  const char* group;    ///< of the run file: there when the part is
  const char* meaning;  ///< one line
  /// Fills the part of a record, which outlives it, while a sample breaks; goes on with a sample as it was left.
  std::unique_ptr<Observer> (*observe)(const PartScene& scene, SampleRecord& record);
  void (*write)(hid_t file, std::span<const SampleRecord> records);
  /// Throws InputError for what is missing or has another shape. Summaries have been read.
  void (*read)(hid_t file, std::span<SampleRecord> records);
  bool (*same)(const SampleRecord& a, const SampleRecord& b);  ///< bit for bit
  /// Numbers that no run leaves behind. Parts come in the order of the table.
  void (*check)(const SampleRecord& record, const RecordFacts& facts, const Judge& judge);
};

/// In the order in which they are written.
[[nodiscard]] std::span<const RecordPart* const> record_parts();

/// Words of `-record`: the parts, and "network", which is of the run, not of its samples.
[[nodiscard]] std::vector<std::string> record_words();

[[nodiscard]] bool same_bits(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace crackle
