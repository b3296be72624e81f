#include "crackle/observe_profile.hpp"

#include <algorithm>
#include <cmath>

namespace crackle {

namespace {

/// Share of a section by which rounding may put a row below its own height.
constexpr double kRowRounding = 1e-9;

}  // namespace

ObserveProfile::ObserveProfile(const Network& network, double row_spacing, SampleRecord& record)
    : record_(record) {
  const Lattice& lattice = network.lattice;
  const double lowest = std::ranges::min_element(lattice.position, {}, &Vector2::y)->y;
  section_.reserve(lattice.bond.size());
  for (const auto& [a, b] : lattice.bond) {
    const double y = std::min(lattice.position[a].y, lattice.position[b].y) - lowest;
    section_.push_back(static_cast<std::int32_t>(std::floor(y / row_spacing + kRowRounding)));
    sections_ = std::max(sections_, section_.back() + 1);
  }
}

void ObserveProfile::sample_begins(std::int64_t /*index*/) {
  record_.profile_peak.assign(static_cast<std::size_t>(sections_), 0);
  record_.profile_failure.assign(static_cast<std::size_t>(sections_), 0);
  peak_load_ = -1;
}

void ObserveProfile::sample_resumes(const SampleRecord& begun) {
  record_.profile_peak = begun.profile_peak;
  record_.profile_failure = begun.profile_failure;
  peak_load_ = begun.summary.peak_load;
}

void ObserveProfile::bond_breaks(std::int32_t /*number*/, const Critical& critical,
                                 Equilibrium& /*equilibrium*/) {
  ++record_.profile_failure[section_[critical.bond]];
  if (critical.load <= peak_load_) return;
  peak_load_ = critical.load;
  record_.profile_peak = record_.profile_failure;
}

}  // namespace crackle
