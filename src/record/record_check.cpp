#include "crackle/record/record_check.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>

#include "crackle/base/error.hpp"

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
  judge.demand_finite("/samples/peak_load", summary.peak_load);
  judge.demand_finite("/samples/peak_displacement", summary.peak_displacement);
  judge.demand_finite("/samples/wall_time", summary.wall_time);
  judge.demand(summary.n_f >= 0, "/samples/n_f", summary.n_f, "a number from 0");
  judge.demand(summary.n_p >= (summary.n_f > 0 ? 1 : 0) && summary.n_p <= summary.n_f, "/samples/n_p",
               summary.n_p, "1 to n_f (" + std::to_string(summary.n_f) + ")");
  judge.demand(std::isfinite(summary.initial_stiffness) && summary.initial_stiffness > 0,
               "/samples/initial_stiffness", summary.initial_stiffness, "a number above 0");
}

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

void check_breaks(const SampleRecord& record, BondId bonds, const Judge& judge) {
  judge.demand(std::ssize(record.bond) == record.summary.n_f, "/samples/n_f", record.summary.n_f,
               "its number of breaks, " + std::to_string(record.bond.size()));
  check_bonds(record, bonds, judge);
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

void check_profile(const SampleRecord& record, const Judge& judge) {
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

void check_snapshot(const SampleRecord& record, const Snapshot& snapshot, const RecordFacts& facts,
                    const Judge& judge) {
  const auto check = [&judge](const char* name, const std::vector<double>& values, std::int64_t size) {
    judge.demand(std::ranges::all_of(values, [](double x) { return std::isfinite(x); }), name,
                 "with a NaN or an infinity", "finite numbers");
    judge.demand(size == 0 || std::ssize(values) == size, name, static_cast<double>(values.size()),
                 std::to_string(size) + " numbers");
  };
  check("/snapshots/force", snapshot.force, facts.bonds);
  check("/snapshots/displacement", snapshot.displacement, facts.displacements);
  const auto before =
      std::min<std::size_t>(static_cast<std::size_t>(snapshot.number) - 1, record.bond.size());
  for (std::size_t i = 0; i < before; ++i) {
    const auto bond = static_cast<std::size_t>(record.bond[i]);
    judge.demand(bond < snapshot.force.size() && snapshot.force[bond] == 0, "/snapshots/force",
                 "of broken bond " + std::to_string(bond), "0");
  }
}

void check_snapshots(const SampleRecord& record, const RecordFacts& facts, const Judge& judge) {
  std::vector<std::int32_t> found;
  for (const Snapshot& snapshot : record.snapshots) {
    judge.demand(snapshot.number >= 1 && snapshot.number <= record.summary.n_f, "/snapshots/number",
                 snapshot.number, "1 to n_f");
    check_snapshot(record, snapshot, facts, judge);
    found.push_back(snapshot.number);
  }
  if (facts.record.snapshot_at.empty()) return;
  std::set<std::int32_t> wanted;
  for (const std::int32_t number : facts.record.snapshot_at) {
    if (number <= record.summary.n_f) wanted.insert(number);
  }
  judge.demand(std::ranges::equal(found, wanted), "/snapshots/number", static_cast<double>(found.size()),
               "one snapshot before each break of -record_snapshot_at, in order");
}

}  // namespace

void check_numbers(std::span<const std::int64_t> index) {
  std::int64_t before = -1;
  for (const std::int64_t number : index) {
    if (number <= before || number > kLastSample) {
      throw InputError("/samples/index", std::to_string(number),
                       "0 to " + std::to_string(kLastSample) + ", ascending");
    }
    before = number;
  }
}

void check_records(std::span<const SampleRecord> records, const RecordFacts& facts) {
  for (const SampleRecord& record : records) {
    const Judge judge(record.summary.index);
    check_summary(record.summary, judge);
    if (facts.record.breaks) check_breaks(record, facts.bonds, judge);
    if (facts.record.profile) check_profile(record, judge);
    if (facts.record.snapshot) check_snapshots(record, facts, judge);
  }
}

}  // namespace crackle
