/// What may watch a sample break: read-only in, records out.
#pragma once

#include <cstdint>

#include "crackle/equilibrium/equilibrium.hpp"

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

struct SampleRecord;

class Observer {
 public:
  virtual ~Observer() = default;
  virtual void sample_begins(std::int64_t /*index*/) {}
  /// The sample goes on from here: `begun` is what was recorded of it.
  virtual void sample_resumes(const SampleRecord& /*begun*/) {}
  /// Bond `critical.bond` breaks next, the number-th of the sample (from 1); it is still in `equilibrium`,
  /// whose displacements are at hand for those who ask.
  virtual void bond_breaks(std::int32_t number, const Critical& critical, Equilibrium& equilibrium) = 0;
  virtual void sample_ends(const SampleSummary& /*summary*/) {}
};

}  // namespace crackle
