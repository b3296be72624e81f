/// Records damage profiles: how many broken bonds each row section holds, at the peak load and at the end.
///
/// A section is a row of nodes with the bonds that rise from it (the paper's n_b(y)). In any other network
/// it is a strip one lattice spacing high, and a bond belongs to the strip of its lower node.
#pragma once

#include "crackle/record.hpp"

namespace crackle {

class ObserveProfile final : public Observer {
 public:
  /// Fills record.profile_peak and profile_failure. row_spacing > 0: the height of a section.
  ObserveProfile(const Network& network, double row_spacing, SampleRecord& record);
  void sample_begins(std::int64_t index) override;
  void sample_resumes(const SampleRecord& begun) override;
  void bond_breaks(std::int32_t number, const Critical& critical, Equilibrium& equilibrium) override;

  [[nodiscard]] std::int32_t sections() const { return sections_; }
  [[nodiscard]] std::int32_t section(BondId bond) const { return section_[bond]; }

 private:
  std::vector<std::int32_t> section_;  ///< [M]
  std::int32_t sections_ = 0;
  double peak_load_ = -1;
  SampleRecord& record_;
};

}  // namespace crackle
