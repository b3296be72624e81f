/// What one sample leaves behind: the rows that the run file gets. Parts that nobody asked for stay empty.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "crackle/fracture/observer.hpp"

namespace crackle {

/// Which parts a run keeps: `-record`.
struct RecordOptions {
  std::set<std::string, std::less<>> parts{"breaks"};  ///< names of rows of record_parts()
  bool network = false;
  double profile_height = 0;  ///< of a section; 0: a row of a generated lattice, or the usual one
  std::vector<std::int32_t> snapshot_at{};  ///< break numbers, ascending, from 1

  [[nodiscard]] bool has(std::string_view part) const { return parts.contains(part); }
};

/// The fields just before a bond breaks, at the load at which it does.
struct Snapshot {
  std::int32_t number = 0;             ///< of the break
  std::vector<double> displacement{};  ///< [N * components] of every node
  std::vector<double> force{};         ///< [M] of every bond; 0 for a broken one
};

struct SampleRecord {
  SampleSummary summary;
  std::vector<BondId> bond;                   ///< [n_f] in the order of breaking
  std::vector<double> load;                   ///< [n_f]
  std::vector<double> stiffness;              ///< [n_f]
  std::vector<std::int32_t> profile_peak;     ///< [sections] broken up to and with the peak load
  std::vector<std::int32_t> profile_failure;  ///< [sections] broken in all
  std::vector<Snapshot> snapshots;
  /// Parts that keep numbers of each sample: of dataset "group/name".
  std::map<std::string, double, std::less<>> number;
};

}  // namespace crackle
