/// What one sample leaves behind: the rows that the run file gets. Parts that nobody asked for stay empty.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "crackle/network/network.hpp"

namespace crackle {

/// One number a sample; the datasets of /samples in the run file.
struct SampleSummary {
  std::int64_t index = 0;
  double peak_load = 0;          ///< max_k P_k
  double peak_displacement = 0;  ///< of the plate, when the peak load is reached
  double initial_stiffness = 0;  ///< F of the intact network
  double wall_time = 0;          ///< seconds
  std::int32_t n_p = 0;          ///< bonds broken up to and with the one that breaks at the peak load
  std::int32_t n_f = 0;          ///< bonds broken in all
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
