/// Which parts of a sample a run keeps.
#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "crackle/fracture/sample_record.hpp"

namespace crackle {

/// Which parts a run keeps: `-record`.
struct RecordOptions {
  std::set<std::string, std::less<>> parts{"breaks"};  ///< names of rows of record_parts()
  bool network = false;
  double profile_height = 0;  ///< of a section; 0: a row of a generated lattice, or the usual one
  std::vector<std::int32_t> snapshot_at{};  ///< break numbers, ascending, from 1

  [[nodiscard]] bool has(std::string_view part) const { return parts.contains(part); }
};

}  // namespace crackle
