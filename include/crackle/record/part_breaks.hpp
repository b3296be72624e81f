/// Records the break sequence: bond, load and stiffness at every break.
#pragma once

#include "crackle/fracture/observer.hpp"
#include "crackle/record/record.hpp"

namespace crackle {

class ObserveBreaks final : public Observer {
 public:
  /// Fills record.bond, load and stiffness, afresh for each sample.
  explicit ObserveBreaks(SampleRecord& record) : record_(record) {}
  void sample_begins(std::int64_t index) override;
  void sample_resumes(const SampleRecord& begun) override;
  void bond_breaks(std::int32_t number, const Critical& critical, Equilibrium& equilibrium) override;

 private:
  SampleRecord& record_;
};

}  // namespace crackle
