#include "crackle/record_check.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>

#include "crackle/error.hpp"

namespace crackle {

namespace {

/// Two ways to the same F may round differently, by so much of it at most.
constexpr double kSameStiffness = 1e-6;

/// Complaints about one sample.
class Judge {
 public:
  explicit Judge(std::int64_t sample) : sample_(sample) {}

  void demand(bool holds, const std::string& what, const std::string& value,
              const std::string& allowed) const {
    if (holds) return;
    throw InputError(what + " of sample " + std::to_string(sample_), value, allowed);
  }
  void demand(bool holds, const std::string& what, double value, const std::string& allowed) const {
    if (!holds) demand(holds, what, std::to_string(value), allowed);
  }
  void demand_finite(const std::string& what, double value) const {
    demand(std::isfinite(value) && value >= 0, what, value, "a finite number from 0");
  }

 private:
  std::int64_t sample_;
};

void check_summary(const SampleSummary& summary, const Judge& judge) {
  judge.demand_finite("peak_load", summary.peak_load);
  judge.demand_finite("peak_displacement", summary.peak_displacement);
  judge.demand_finite("wall_time", summary.wall_time);
  judge.demand(summary.n_f >= 0, "n_f", summary.n_f, "a number from 0");
  judge.demand(summary.n_p >= (summary.n_f > 0 ? 1 : 0) && summary.n_p <= summary.n_f, "n_p", summary.n_p,
               "1 to n_f (" + std::to_string(summary.n_f) + ")");
  judge.demand(std::isfinite(summary.initial_stiffness) && summary.initial_stiffness > 0, "initial_stiffness",
               summary.initial_stiffness, "a number above 0");
}

void check_bonds(const SampleRecord& record, BondId bonds, const Judge& judge) {
  for (const BondId bond : record.bond) {
    judge.demand(bond >= 0 && (bonds == 0 || bond < bonds), "a broken bond", bond,
                 bonds == 0 ? "a number from 0" : "0 to " + std::to_string(bonds - 1));
  }
  std::vector<BondId> sorted = record.bond;
  std::ranges::sort(sorted);
  const auto twice = std::ranges::adjacent_find(sorted);
  if (twice != sorted.end()) judge.demand(false, "bond broken twice", *twice, "every bond once");
}

/// The peak as fracture counts it: the first break with the largest load.
void check_peak(const SampleRecord& record, const Judge& judge) {
  if (record.load.empty()) return;
  const auto first = std::ranges::max_element(record.load);
  const auto at = static_cast<std::size_t>(first - record.load.begin());
  const SampleSummary& summary = record.summary;
  judge.demand(static_cast<std::size_t>(summary.n_p) == at + 1, "n_p", summary.n_p,
               "the break with the largest load, " + std::to_string(at + 1));
  judge.demand(summary.peak_load == *first, "peak_load", summary.peak_load, "the largest of its loads");
  judge.demand(summary.peak_displacement == *first / record.stiffness[at], "peak_displacement",
               summary.peak_displacement, "load / stiffness at the peak");
}

void check_breaks(const SampleRecord& record, BondId bonds, const Judge& judge) {
  judge.demand(std::ssize(record.bond) == record.summary.n_f, "n_f", record.summary.n_f,
               "its number of breaks, " + std::to_string(record.bond.size()));
  check_bonds(record, bonds, judge);
  for (const double load : record.load) judge.demand_finite("a load", load);
  for (const double stiffness : record.stiffness) {
    judge.demand(std::isfinite(stiffness) && stiffness > 0, "a stiffness", stiffness, "a number above 0");
  }
  const double intact = record.summary.initial_stiffness;
  judge.demand(record.stiffness.empty() || std::abs(record.stiffness[0] - intact) <= kSameStiffness * intact,
               "initial_stiffness", intact, "F before the first break");
  check_peak(record, judge);
}

void check_profile(const SampleRecord& record, const Judge& judge) {
  const auto sum = [](const std::vector<std::int32_t>& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  };
  const auto from_zero = [](std::int32_t count) { return count >= 0; };
  judge.demand(std::ranges::all_of(record.profile_peak, from_zero) &&
                   std::ranges::equal(record.profile_peak, record.profile_failure, std::less_equal{}),
               "profile", "", "counts from 0, up to the peak no more than in all");
  judge.demand(sum(record.profile_peak) == record.summary.n_p, "sum of /profile/peak",
               static_cast<double>(sum(record.profile_peak)), "n_p");
  judge.demand(sum(record.profile_failure) == record.summary.n_f, "sum of /profile/failure",
               static_cast<double>(sum(record.profile_failure)), "n_f");
}

void check_snapshot(const SampleRecord& record, const Snapshot& snapshot, BondId bonds, const Judge& judge) {
  const auto finite = [](double x) { return std::isfinite(x); };
  judge.demand(
      std::ranges::all_of(snapshot.displacement, finite) && std::ranges::all_of(snapshot.force, finite),
      "a snapshot", "with a NaN or an infinity", "finite numbers");
  judge.demand(bonds == 0 || std::ssize(snapshot.force) == bonds, "forces of a snapshot",
               static_cast<double>(snapshot.force.size()), "one for each bond");
  const auto before =
      std::min<std::size_t>(static_cast<std::size_t>(snapshot.number) - 1, record.bond.size());
  for (std::size_t i = 0; i < before; ++i) {
    const auto bond = static_cast<std::size_t>(record.bond[i]);
    judge.demand(bond < snapshot.force.size() && snapshot.force[bond] == 0, "force in broken bond",
                 std::to_string(bond), "0");
  }
}

void check_snapshots(const SampleRecord& record, const RecordFacts& facts, const Judge& judge) {
  std::vector<std::int32_t> found;
  for (const Snapshot& snapshot : record.snapshots) {
    judge.demand(snapshot.number >= 1 && snapshot.number <= record.summary.n_f, "break of a snapshot",
                 snapshot.number, "1 to n_f");
    check_snapshot(record, snapshot, facts.bonds, judge);
    found.push_back(snapshot.number);
  }
  if (facts.record.snapshot_at.empty()) return;
  std::set<std::int32_t> wanted;
  for (const std::int32_t number : facts.record.snapshot_at) {
    if (number <= record.summary.n_f) wanted.insert(number);
  }
  judge.demand(std::ranges::equal(found, wanted), "snapshots", static_cast<double>(found.size()),
               "one before each break of -record_snapshot_at, in order");
}

}  // namespace

void check_records(std::span<const SampleRecord> records, const RecordFacts& facts) {
  std::set<std::int64_t> seen;
  for (const SampleRecord& record : records) {
    const std::int64_t index = record.summary.index;
    if (index < 0 || index > kLastSample || !seen.insert(index).second) {
      throw InputError("number of a sample", std::to_string(index),
                       "0 to " + std::to_string(kLastSample) + ", each once");
    }
    const Judge judge(index);
    check_summary(record.summary, judge);
    if (facts.record.breaks) check_breaks(record, facts.bonds, judge);
    if (facts.record.profile) check_profile(record, judge);
    if (facts.record.snapshot) check_snapshots(record, facts, judge);
  }
}

}  // namespace crackle
