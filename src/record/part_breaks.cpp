#include "crackle/record/part_breaks.hpp"

#include <algorithm>
#include <cmath>

#include "crackle/record/part.hpp"
#include "crackle/record/rows.hpp"

namespace crackle {

void ObserveBreaks::sample_begins(std::int64_t /*index*/) {
  record_.bond.clear();
  record_.load.clear();
  record_.stiffness.clear();
}

void ObserveBreaks::sample_resumes(const SampleRecord& begun) {
  record_.bond = begun.bond;
  record_.load = begun.load;
  record_.stiffness = begun.stiffness;
}

void ObserveBreaks::bond_breaks(std::int32_t /*number*/, const Critical& critical,
                                Equilibrium& /*equilibrium*/) {
  record_.bond.push_back(critical.bond);
  record_.load.push_back(critical.load);
  record_.stiffness.push_back(critical.stiffness);
}

namespace {

std::unique_ptr<Observer> observe_breaks(const PartScene& /*scene*/, SampleRecord& record) {
  return std::make_unique<ObserveBreaks>(record);
}

void write_breaks(hid_t file, std::span<const SampleRecord> records) {
  std::vector<std::int64_t> offset{0};
  for (const SampleRecord& record : records) offset.push_back(offset.back() + std::ssize(record.bond));
  hdf5::write<std::int64_t>(hdf5::open_group(file, "samples"), "break_offset", offset);
  const hdf5::Handle breaks = hdf5::create_group(file, "breaks");
  write_joined(breaks, "bond", records, &SampleRecord::bond);
  write_joined(breaks, "load", records, &SampleRecord::load);
  write_joined(breaks, "stiffness", records, &SampleRecord::stiffness);
}

void read_breaks(hid_t file, std::span<SampleRecord> records) {
  const auto offset = read_rows<std::int64_t>(file, "samples/break_offset", records.size() + 1);
  std::vector<hsize_t> shape;
  const auto bond = hdf5::read<std::int32_t>(file, "breaks/bond", &shape);
  if (shape.size() != 1) throw InputError("shape of dataset /breaks/bond", "", "[B]");
  if (offset.front() != 0 || !std::ranges::is_sorted(offset) || offset.back() != std::ssize(bond)) {
    throw InputError("dataset /samples/break_offset", "",
                     "ascending places in /breaks, from 0 to " + std::to_string(bond.size()));
  }
  const auto load = read_rows<double>(file, "breaks/load", bond.size());
  const auto stiffness = read_rows<double>(file, "breaks/stiffness", bond.size());
  for (std::size_t s = 0; s < records.size(); ++s) {
    records[s].bond.assign(bond.begin() + offset[s], bond.begin() + offset[s + 1]);
    records[s].load.assign(load.begin() + offset[s], load.begin() + offset[s + 1]);
    records[s].stiffness.assign(stiffness.begin() + offset[s], stiffness.begin() + offset[s + 1]);
  }
}

bool same_breaks(const SampleRecord& a, const SampleRecord& b) {
  return a.bond == b.bond && same_bits(a.load, b.load) && same_bits(a.stiffness, b.stiffness);
}

/// Two ways to the same F may round differently, by so much of it at most.
constexpr double kSameStiffness = 1e-6;

void check_bonds(const SampleRecord& record, BondId bonds, const Judge& judge) {
  for (const BondId bond : record.bond) {
    judge.demand(bond >= 0 && (bonds == 0 || bond < bonds), "/breaks/bond", bond,
                 bonds == 0 ? "a number from 0" : "0 to " + std::to_string(bonds - 1));
  }
  std::vector<BondId> sorted = record.bond;
  std::ranges::sort(sorted);
  const auto twice = std::ranges::adjacent_find(sorted);
  if (twice != sorted.end()) judge.demand(false, "/breaks/bond", *twice, "no bond twice");
}

/// The peak as fracture counts it: the first break with the largest load.
void check_peak(const SampleRecord& record, const Judge& judge) {
  if (record.load.empty()) return;
  const auto first = std::ranges::max_element(record.load);
  const auto at = static_cast<std::size_t>(first - record.load.begin());
  const SampleSummary& summary = record.summary;
  judge.demand(static_cast<std::size_t>(summary.n_p) == at + 1, "/samples/n_p", summary.n_p,
               "the break with the largest load, " + std::to_string(at + 1));
  judge.demand(summary.peak_load == *first, "/samples/peak_load", summary.peak_load,
               "the largest of its loads");
  judge.demand(summary.peak_displacement == *first / record.stiffness[at], "/samples/peak_displacement",
               summary.peak_displacement, "load / stiffness at the peak");
}

void check_breaks(const SampleRecord& record, const RecordFacts& facts, const Judge& judge) {
  judge.demand(std::ssize(record.bond) == record.summary.n_f, "/samples/n_f", record.summary.n_f,
               "its number of breaks, " + std::to_string(record.bond.size()));
  check_bonds(record, facts.bonds, judge);
  for (const double load : record.load) judge.demand_finite("/breaks/load", load);
  for (const double stiffness : record.stiffness) {
    judge.demand(std::isfinite(stiffness) && stiffness > 0, "/breaks/stiffness", stiffness,
                 "a number above 0");
  }
  const double intact = record.summary.initial_stiffness;
  judge.demand(record.stiffness.empty() || std::abs(record.stiffness[0] - intact) <= kSameStiffness * intact,
               "/samples/initial_stiffness", intact, "F before the first break");
  check_peak(record, judge);
}

}  // namespace

extern const RecordPart kBreaksPart;
const RecordPart kBreaksPart{.name = "breaks",
                             .group = "breaks",
                             .meaning = "bond, load and stiffness of every break",
                             .observe = observe_breaks,
                             .write = write_breaks,
                             .read = read_breaks,
                             .same = same_breaks,
                             .check = check_breaks};

}  // namespace crackle
