#include "crackle/record/observe_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "crackle/base/error.hpp"

namespace crackle {

namespace {

/// Share of a section by which rounding may put a row below its own height.
constexpr double kRowRounding = 1e-9;

/// Share of the network's height up to which a bond counts as level.
constexpr double kLevel = 1e-9;

double lowest_of(const Lattice& lattice) {
  return std::ranges::min_element(lattice.position, {}, &Vector2::y)->y;
}

/// By how much the lower node of a bond is above `lowest`.
double rise(const Lattice& lattice, const std::array<NodeId, 2>& bond, double lowest) {
  return std::min(lattice.position[bond[0]].y, lattice.position[bond[1]].y) - lowest;
}

}  // namespace

double usual_section_height(const Lattice& lattice) {
  const double highest = std::ranges::max_element(lattice.position, {}, &Vector2::y)->y;
  const double level = kLevel * (highest - lowest_of(lattice));
  std::vector<double> extent;
  for (const auto& [a, b] : lattice.bond) {
    const double dy = std::abs(lattice.position[a].y - lattice.position[b].y);
    if (dy > level) extent.push_back(dy);
  }
  if (extent.empty()) return 1;
  const auto middle = extent.begin() + static_cast<std::ptrdiff_t>(extent.size() / 2);
  std::ranges::nth_element(extent, middle);
  return *middle;
}

void check_section_height(const Lattice& lattice, double height) {
  const double lowest = lowest_of(lattice);
  double highest = 0;
  for (const auto& bond : lattice.bond) highest = std::max(highest, rise(lattice, bond, lowest));
  if (highest / height + kRowRounding < kMostSections) return;
  std::array<char, 32> value{};
  std::array<char, 120> allowed{};
  std::snprintf(value.data(), value.size(), "%.6g", height);
  std::snprintf(allowed.data(), allowed.size(), "a number above %.6g: a profile has at most %d sections",
                highest / kMostSections, kMostSections);
  throw InputError("-record_profile_height", value.data(), allowed.data());
}

ObserveProfile::ObserveProfile(const Network& network, double section_height, SampleRecord& record)
    : record_(record) {
  const Lattice& lattice = network.lattice;
  const double lowest = lowest_of(lattice);
  section_.reserve(lattice.bond.size());
  for (const auto& bond : lattice.bond) {
    const double y = rise(lattice, bond, lowest);
    section_.push_back(static_cast<std::int32_t>(std::floor(y / section_height + kRowRounding)));
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
