/// Records damage profiles: how many broken bonds each row section holds, at the peak load and at the end.
///
/// A section is a row of nodes with the bonds that rise from it (the paper's n_b(y)). In any other network
/// it is a strip as high as most bonds are, and a bond belongs to the strip of its lower node.
#pragma once

#include "crackle/fracture/observer.hpp"
#include "crackle/record/record.hpp"

namespace crackle {

/// Most sections of a profile: twice as many numbers are kept of every sample.
inline constexpr std::int32_t kMostSections = 65536;

/// Height of the strips of a network that isn't a generated lattice: the median of the bonds' extents along y, those
/// aside that are level; 1 where all are.
[[nodiscard]] double usual_section_height(const Lattice& lattice);

/// Throws InputError, naming -record_profile_height, for one that makes more than kMostSections strips.
void check_section_height(const Lattice& lattice, double height);

class ObserveProfile final : public Observer {
 public:
  /// Fills record.profile_peak and profile_failure. section_height: as check_section_height takes it.
  ObserveProfile(const Network& network, double section_height, SampleRecord& record);
  void sample_begins(std::int64_t index) override;
  void sample_resumes(const SampleRecord& begun) override;
  void bond_breaks(std::int32_t number, const Critical& critical, Equilibrium& equilibrium) override;

  [[nodiscard]] std::int32_t sections() const { return sections_; }
  [[nodiscard]] std::int32_t section(BondId bond) const { return section_[bond]; }

 private:
  std::vector<std::int32_t> section_;  ///< [M]
  std::int32_t sections_ = 0;
  double peak_load_ = 0;
  std::int64_t n_p_ = 0;  ///< 0: no peak yet
  SampleRecord& record_;
};

}  // namespace crackle
