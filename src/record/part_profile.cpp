#include "crackle/record/part_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numeric>

#include "crackle/base/error.hpp"
#include "crackle/fracture/peak.hpp"
#include "crackle/record/part.hpp"
#include "crackle/record/rows.hpp"

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
  n_p_ = 0;
}

void ObserveProfile::sample_resumes(const SampleRecord& begun) {
  record_.profile_peak = begun.profile_peak;
  record_.profile_failure = begun.profile_failure;
  peak_load_ = begun.summary.peak_load;
  n_p_ = begun.summary.n_p;
}

void ObserveProfile::bond_breaks(std::int32_t number, const Critical& critical,
                                 Equilibrium& /*equilibrium*/) {
  ++record_.profile_failure[section_[critical.bond]];
  if (!is_new_peak(critical.load, peak_load_, n_p_)) return;
  peak_load_ = critical.load;
  n_p_ = number;
  record_.profile_peak = record_.profile_failure;
}

namespace {

std::unique_ptr<Observer> observe_profile(const PartScene& scene, SampleRecord& record) {
  return std::make_unique<ObserveProfile>(scene.network, scene.section_height, record);
}

void write_profiles(hid_t file, std::span<const SampleRecord> records) {
  const hdf5::Handle group = hdf5::create_group(file, "profile");
  const std::size_t sections = records.empty() ? 1 : records.front().profile_peak.size();
  write_joined(group, "peak", records, &SampleRecord::profile_peak, sections);
  write_joined(group, "failure", records, &SampleRecord::profile_failure, sections);
}

void read_profiles(hid_t file, std::span<SampleRecord> records) {
  std::size_t sections = 0;
  const auto peak = read_rows<std::int32_t>(file, "profile/peak", records.size(), &sections);
  std::size_t same = 0;
  const auto failure = read_rows<std::int32_t>(file, "profile/failure", records.size(), &same);
  if (same != sections) throw InputError("columns of /profile/failure", "", "those of /profile/peak");
  for (std::size_t s = 0; s < records.size(); ++s) {
    records[s].profile_peak = row_of(peak, s, sections);
    records[s].profile_failure = row_of(failure, s, sections);
  }
}

bool same_profile(const SampleRecord& a, const SampleRecord& b) {
  return a.profile_peak == b.profile_peak && a.profile_failure == b.profile_failure;
}

void check_profile(const SampleRecord& record, const RecordFacts& /*facts*/, const Judge& judge) {
  const auto check = [&judge](const char* name, const std::vector<std::int32_t>& counts, std::int32_t all) {
    judge.demand(std::ranges::all_of(counts, [](std::int32_t count) { return count >= 0; }), name,
                 "with a number below 0", "counts");
    const auto sum = std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
    judge.demand(sum == all, name, static_cast<double>(sum),
                 "counts of " + std::to_string(all) + " bonds in all");
  };
  check("/profile/peak", record.profile_peak, record.summary.n_p);
  check("/profile/failure", record.profile_failure, record.summary.n_f);
  judge.demand(std::ranges::equal(record.profile_peak, record.profile_failure, std::less_equal{}),
               "/profile/peak", "", "counts up to those of /profile/failure");
}

}  // namespace

extern const RecordPart kProfilePart;
const RecordPart kProfilePart{.name = "profile",
                              .group = "profile",
                              .meaning = "broken bonds in each row section, at the peak load and at the end",
                              .observe = observe_profile,
                              .write = write_profiles,
                              .read = read_profiles,
                              .same = same_profile,
                              .check = check_profile};

}  // namespace crackle
