/// Records displacements and forces just before chosen breaks.
#pragma once

#include "crackle/fracture/observer.hpp"
#include "crackle/record/record.hpp"

namespace crackle {

class ObserveSnapshot final : public Observer {
 public:
  /// Fills record.snapshots at these break numbers (ascending, from 1).
  ObserveSnapshot(std::vector<std::int32_t> at, SampleRecord& record);
  void sample_begins(std::int64_t index) override;
  void sample_resumes(const SampleRecord& begun) override;
  void bond_breaks(std::int32_t number, const Critical& critical, Equilibrium& equilibrium) override;

 private:
  std::vector<std::int32_t> at_;
  SampleRecord& record_;
};

/// Displacements of every node and forces of every bond at `load`, from those at unit plate load.
[[nodiscard]] Snapshot take_snapshot(std::int32_t number, double load, Equilibrium& equilibrium);

}  // namespace crackle
