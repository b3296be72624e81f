#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "crackle/record/record_check.hpp"
#include "support/expect_refused.hpp"
#include "support/sample_records.hpp"

namespace crackle {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

RecordFacts all_parts() {
  return {.bonds = test::kRecordBonds,
          .displacements = test::kRecordDisplacements,
          .record = {.parts = {"breaks", "profile", "snapshot"}, .snapshot_at = {}}};
}

TEST(RecordCheck, TakesWhatARunLeaves) {
  std::vector<SampleRecord> records;
  for (std::int64_t index = 0; index < 6; ++index) records.push_back(test::sample_record(index));
  EXPECT_NO_THROW(check_records(records, all_parts()));
  EXPECT_NO_THROW(check_records({}, all_parts()));
  SampleRecord unbroken{.summary = {.index = kLastSample, .initial_stiffness = 1}};
  EXPECT_NO_THROW(check_records(std::vector{unbroken}, all_parts())) << "-stop breaks=0";
  SampleRecord slim;
  slim.summary = test::sample_record(0).summary;
  EXPECT_NO_THROW(check_records(std::vector{slim}, {.record = {.parts = {}}})) << "-record none";
}

/// A record that is whole but for what `spoil` does to it.
void expect_refused_record(const std::string& word, const std::function<void(SampleRecord&)>& spoil) {
  SCOPED_TRACE(word);
  SampleRecord record = test::sample_record(4);
  spoil(record);
  test::expect_refused([&] { check_records(std::vector{record}, all_parts()); }, {word});
}

TEST(RecordCheck, RefusesNumbersThatCanNotBe) {
  for (const double bad : {kNan, kInfinity, -1.0}) {
    expect_refused_record("peak_load", [bad](SampleRecord& r) { r.summary.peak_load = bad; });
    expect_refused_record("peak_displacement", [bad](SampleRecord& r) { r.summary.peak_displacement = bad; });
    expect_refused_record("wall_time", [bad](SampleRecord& r) { r.summary.wall_time = bad; });
    expect_refused_record("initial_stiffness", [bad](SampleRecord& r) { r.summary.initial_stiffness = bad; });
    expect_refused_record("/breaks/load", [bad](SampleRecord& r) { r.load[2] = bad; });
    expect_refused_record("/breaks/stiffness", [bad](SampleRecord& r) { r.stiffness[0] = bad; });
    expect_refused_record("/snapshots/force",
                          [bad](SampleRecord& r) { r.snapshots[0].force[3] = bad == -1.0 ? kNan : bad; });
  }
  expect_refused_record("/breaks/stiffness", [](SampleRecord& r) { r.stiffness[2] = 0; });
  expect_refused_record("initial_stiffness", [](SampleRecord& r) { r.summary.initial_stiffness = 0; });
}

TEST(RecordCheck, RefusesBreaksThatCanNotBe) {
  expect_refused_record("bond", [](SampleRecord& r) { r.bond[1] = -1; });
  expect_refused_record("0 to 4", [](SampleRecord& r) { r.bond[1] = test::kRecordBonds; });
  expect_refused_record("no bond twice", [](SampleRecord& r) { r.bond[2] = r.bond[0]; });
  expect_refused_record("n_f", [](SampleRecord& r) { r.summary.n_f = 2; });
  expect_refused_record("n_f", [](SampleRecord& r) { r.summary.n_f = -3; });
  expect_refused_record("n_p", [](SampleRecord& r) { r.summary.n_p = 1; });
  expect_refused_record("n_p", [](SampleRecord& r) { r.summary.n_p = 4; });
  expect_refused_record("n_p", [](SampleRecord& r) { r.summary.n_p = 0; });
  expect_refused_record("peak_load", [](SampleRecord& r) { r.summary.peak_load *= 1 + 1e-15; });
  expect_refused_record("peak_displacement", [](SampleRecord& r) { r.summary.peak_displacement *= 2; });
  expect_refused_record("n_p", [](SampleRecord& r) { r.load[0] = r.load[1]; });
}

TEST(RecordCheck, RefusesProfilesAndSnapshotsThatDoNotFit) {
  expect_refused_record("profile/peak", [](SampleRecord& r) { r.profile_peak = {1, 0}; });
  expect_refused_record("profile/failure", [](SampleRecord& r) { r.profile_failure = {1, 3}; });
  expect_refused_record("profile", [](SampleRecord& r) { r.profile_peak = {2, 0}; });
  expect_refused_record("profile", [](SampleRecord& r) { r.profile_failure = {-1, 4}; });
  expect_refused_record("/snapshots/number", [](SampleRecord& r) { r.snapshots[0].number = 0; });
  expect_refused_record("/snapshots/number", [](SampleRecord& r) { r.snapshots[0].number = 4; });
  expect_refused_record("5 numbers", [](SampleRecord& r) { r.snapshots[0].force.pop_back(); });
  expect_refused_record("of broken bond", [](SampleRecord& r) {
    r.snapshots[1].force[static_cast<std::size_t>(r.bond[0])] = 1;
  });
}

TEST(RecordCheck, RefusesNumbersThatDoNotAscend) {
  using Numbers = std::vector<std::int64_t>;
  EXPECT_NO_THROW(check_numbers(Numbers{}));
  EXPECT_NO_THROW(check_numbers(Numbers{0, 1, 7, kLastSample}));
  for (const Numbers& numbers : {Numbers{-1}, Numbers{3, 3}, Numbers{4, 3}, Numbers{0, kLastSample + 1}}) {
    test::expect_refused([&] { check_numbers(numbers); }, {"/samples/index", "ascending"});
  }
}

TEST(RecordCheck, RefusesSnapshotsMissing) {
  RecordFacts facts = all_parts();
  facts.record.snapshot_at = {1, 2, 100};
  EXPECT_NO_THROW(check_records(std::vector{test::sample_record(2)}, facts));
  test::expect_refused([&] { check_records(std::vector{test::sample_record(1)}, facts); },
                       {"/snapshots/number", "-record_snapshot_at"});
}

}  // namespace
}  // namespace crackle
