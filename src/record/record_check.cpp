#include "crackle/record/record_check.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "crackle/base/error.hpp"

namespace crackle {

namespace {

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
    for (const RecordPart* part : record_parts()) {
      if (facts.record.has(part->name)) part->check(record, facts, judge);
    }
  }
}

}  // namespace crackle
