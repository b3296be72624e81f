#include <gtest/gtest.h>

#include <algorithm>

#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/fracture/fracture.hpp"
#include "crackle/record/part.hpp"
#include "support/break_record.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

const RecordPart& part(const std::string& name) {
  const auto parts = record_parts();
  return **std::ranges::find(parts, name, [](const RecordPart* each) { return std::string(each->name); });
}

SampleRecord broken(const Network& network) {
  PhaseTimes times;
  const auto equilibrium = make_equilibrium(network, {}, times);
  SampleRecord record;
  const RecordOptions options;
  const PartScene scene{network, options};
  const auto breaks = part("breaks").observe(scene, record);
  const auto energy = part("energy").observe(scene, record);
  std::vector<Observer*> observers{breaks.get(), energy.get()};
  record.summary = break_sample(*equilibrium, 0, test::uniform_thresholds(network, 0), {}, observers);
  return record;
}

TEST(PartEnergy, IsStoredAtThePeakAndDissipatedByTheBreaksBefore) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    SCOPED_TRACE(named.name);
    SampleRecord record = broken(named.network);
    double dissipated = 0;
    for (std::int32_t k = 0; k + 1 < record.summary.n_p; ++k) {
      const double u = record.load[k] / record.stiffness[k];
      dissipated += u * u * (record.stiffness[k] - record.stiffness[k + 1]) / 2;
    }
    EXPECT_DOUBLE_EQ(record.number.at("energy/dissipated"), dissipated);
    EXPECT_DOUBLE_EQ(record.number.at("energy/stored"),
                     record.summary.peak_load * record.summary.peak_displacement / 2);
    // a sample that is taken up where it was left, with its breaks
    SampleRecord again = record;
    again.number.clear();
    const RecordOptions options;
    part("energy").observe({named.network, options}, again)->sample_resumes(record);
    EXPECT_TRUE(part("energy").same(record, again));
    again.number["energy/stored"] += 1;
    EXPECT_FALSE(part("energy").same(record, again));
    test::expect_refused([&] { part("energy").check(again, {}, Judge(0)); }, {"/energy/stored", "sample 0"});
    EXPECT_NO_THROW(part("energy").check(record, {}, Judge(0)));
  }
}

/// Two equal fuses side by side with thresholds 0.1 and 0.5: at the break of the first, F = 2 and u = 0.1.
TEST(PartEnergy, IsThatOfABundle) {
  const Network network = test::bundle(2);
  PhaseTimes times;
  const auto equilibrium = make_equilibrium(network, {}, times);
  SampleRecord record;
  const RecordOptions options;
  const auto energy = part("energy").observe({network, options}, record);
  std::vector<Observer*> observers{energy.get()};
  (void)break_sample(*equilibrium, 0, std::vector{0.1, 0.5}, {}, observers);
  EXPECT_DOUBLE_EQ(record.number.at("energy/stored"), 0.5 * 0.5 / 2);
  EXPECT_DOUBLE_EQ(record.number.at("energy/dissipated"), 0.1 * 0.1 * (2 - 1) / 2);
}

}  // namespace
}  // namespace crackle
