/// What may watch a sample break: read-only in, records out.
#pragma once

#include <cstdint>

#include "crackle/equilibrium/equilibrium.hpp"
#include "crackle/fracture/sample_record.hpp"

namespace crackle {

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
