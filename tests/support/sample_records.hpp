/// Records of samples that were never broken: every field has a value of its own.
#pragma once

#include <gtest/gtest.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "crackle/base/durable_file.hpp"
#include "crackle/record/run_records.hpp"

namespace crackle::test {

inline constexpr std::size_t kRecordBonds = 5;
inline constexpr std::size_t kRecordDisplacements = 3;

/// A sample of three breaks, the second at the peak load, with two profile sections and one snapshot; one of an even
/// index has two.
inline SampleRecord sample_record(std::int64_t index) {
  const double x = 1.0 / static_cast<double>(index + 3);
  const auto first = static_cast<BondId>(index % 3);
  SampleRecord record;
  record.bond = {first, first + 1, first + 2};
  record.load = {5 * x, 7 * x, 6 * x};
  record.stiffness = {10 * x, 9 * x, 8 * x};
  record.summary = {.index = index,
                    .peak_load = record.load[1],
                    .peak_displacement = record.load[1] / record.stiffness[1],
                    .initial_stiffness = 10 * x,
                    .wall_time = 4 * x,
                    .n_p = 2,
                    .n_f = 3};
  record.profile_peak = index % 2 == 0 ? std::vector{1, 1} : std::vector{0, 2};
  record.profile_failure = {1, 2};
  for (std::int32_t number = 1; number <= (index % 2 == 0 ? 2 : 1); ++number) {
    Snapshot snapshot{.number = number,
                      .displacement = std::vector<double>(kRecordDisplacements, number * x),
                      .force = std::vector<double>(kRecordBonds, -number * x)};
    if (number == 2) snapshot.force[static_cast<std::size_t>(first)] = 0;
    record.snapshots.push_back(std::move(snapshot));
  }
  return record;
}

/// A run file of these samples.
inline void write_run(const std::string& path, const RunHeader& header, const RecordOptions& record,
                      std::span<const SampleRecord> records) {
  write_durably(path, path + ".part", format_run(header, record, records));
}

inline void expect_same(const SampleRecord& a, const SampleRecord& b) {
  SCOPED_TRACE("sample " + std::to_string(b.summary.index));
  EXPECT_EQ(a.summary.index, b.summary.index);
  EXPECT_EQ(a.summary.peak_load, b.summary.peak_load);
  EXPECT_EQ(a.summary.peak_displacement, b.summary.peak_displacement);
  EXPECT_EQ(a.summary.initial_stiffness, b.summary.initial_stiffness);
  EXPECT_EQ(a.summary.wall_time, b.summary.wall_time);
  EXPECT_EQ(a.summary.n_p, b.summary.n_p);
  EXPECT_EQ(a.summary.n_f, b.summary.n_f);
  EXPECT_EQ(a.bond, b.bond);
  EXPECT_EQ(a.load, b.load);
  EXPECT_EQ(a.stiffness, b.stiffness);
  EXPECT_EQ(a.profile_peak, b.profile_peak);
  EXPECT_EQ(a.profile_failure, b.profile_failure);
  ASSERT_EQ(a.snapshots.size(), b.snapshots.size());
  for (std::size_t i = 0; i < a.snapshots.size(); ++i) {
    EXPECT_EQ(a.snapshots[i].number, b.snapshots[i].number);
    EXPECT_EQ(a.snapshots[i].displacement, b.snapshots[i].displacement);
    EXPECT_EQ(a.snapshots[i].force, b.snapshots[i].force);
  }
}

/// The file holds the samples of these indices, in this order.
inline void expect_samples(const std::vector<SampleRecord>& records,
                           const std::vector<std::int64_t>& indices) {
  ASSERT_EQ(records.size(), indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) expect_same(records[i], sample_record(indices[i]));
}

}  // namespace crackle::test
