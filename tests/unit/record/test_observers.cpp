#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/fracture/fracture.hpp"
#include "crackle/record/part_breaks.hpp"
#include "crackle/record/part_profile.hpp"
#include "crackle/record/part_snapshot.hpp"
#include "support/break_record.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// Breaks one sample of a network before these observers.
SampleSummary watch(Equilibrium& equilibrium, std::int64_t sample, std::vector<Observer*> observers) {
  const auto threshold = test::uniform_thresholds(equilibrium.network(), sample);
  return break_sample(equilibrium, sample, threshold, {}, observers);
}

std::int32_t sum(const std::vector<std::int32_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), 0);
}

TEST(ObserveBreaks, KeepsTheSequenceAfreshForEachSample) {
  const Network network = test::triangular_networks(4)[0].network;
  PhaseTimes times;
  const auto equilibrium = make_equilibrium(network, {}, times);
  SampleRecord record;
  ObserveBreaks breaks(record);
  (void)watch(*equilibrium, 1, {&breaks});
  const SampleSummary summary = watch(*equilibrium, 0, {&breaks});
  ASSERT_EQ(std::ssize(record.bond), summary.n_f);
  ASSERT_EQ(record.load.size(), record.bond.size());
  ASSERT_EQ(record.stiffness.size(), record.bond.size());
  EXPECT_EQ(*std::ranges::max_element(record.load), summary.peak_load);
  EXPECT_EQ(record.load[summary.n_p - 1], summary.peak_load);
  EXPECT_EQ(record.load[summary.n_p - 1] / record.stiffness[summary.n_p - 1], summary.peak_displacement);
  // a strategy may take the one from its factor's last pivot, the other from displacements
  EXPECT_NEAR(record.stiffness[0] / summary.initial_stiffness, 1, 1e-13);
  EXPECT_TRUE(std::ranges::is_sorted(record.stiffness, std::greater{})) << "F only falls";
  EXPECT_TRUE(record.profile_peak.empty() && record.profile_failure.empty() && record.snapshots.empty())
      << "nothing that nobody asked for";
}

/// With a row spacing of 0.7 the third row is at 3 * 0.7, which divided by 0.7 is less than 3.
TEST(ObserveProfile, CountsEveryBreakInItsRow) {
  for (const double row_spacing : {1.0, std::sqrt(0.75), 0.7}) {
    SCOPED_TRACE(row_spacing);
    const int size = 6;
    const Network network =
        make_network(triangular_lattice(size, row_spacing), Model::spring, Grips::sliding, {});
    PhaseTimes times;
    const auto equilibrium = make_equilibrium(network, {}, times);
    SampleRecord record;
    ObserveBreaks breaks(record);
    ObserveProfile profile(network, row_spacing, record);
    EXPECT_EQ(profile.sections(), size + 1);
    for (BondId e = 0; e < network.bonds(); ++e) {
      EXPECT_EQ(profile.section(e), network.lattice.bond[e][0] / (size + 1)) << "bond " << e;
    }
    (void)watch(*equilibrium, 1, {&breaks, &profile});
    const SampleSummary summary = watch(*equilibrium, 0, {&breaks, &profile});
    EXPECT_EQ(sum(record.profile_failure), summary.n_f);
    EXPECT_EQ(sum(record.profile_peak), summary.n_p);
    std::vector<std::int32_t> expected(size + 1, 0);
    for (int i = 0; i < summary.n_p; ++i) ++expected[profile.section(record.bond[i])];
    EXPECT_EQ(record.profile_peak, expected);
  }
}

/// A lattice in other units has the sections of its rows.
TEST(ObserveProfile, TheUsualHeightIsThatOfARowInAnyUnit) {
  for (const double unit : {1.0, 1e10, 1e-3}) {
    SCOPED_TRACE(unit);
    Lattice rows = triangular_lattice(6, 0.7);
    for (Vector2& p : rows.position) p = {p.x * unit, (p.y - 1e3) * unit};
    const Network network = make_network(make_lattice(7 * unit, rows.position, rows.grip, rows.bond),
                                         Model::spring, Grips::sliding, {});
    const double height = usual_section_height(network.lattice);
    EXPECT_NEAR(height / unit, 0.7, 1e-9);
    EXPECT_NO_THROW(check_section_height(network.lattice, height));
    SampleRecord record;
    EXPECT_EQ(ObserveProfile(network, height, record).sections(), 7);
    test::expect_refused([&] { check_section_height(network.lattice, 1e-6 * unit); },
                         {"-record_profile_height", "at most 65536 sections"});
  }
}

/// What crosses the gap above each row, in the state just before a break.
void expect_cuts_carry(const Network& network, const Snapshot& snapshot, double load) {
  const auto rows = static_cast<int>(network.lattice.position.back().y);
  for (int row = 0; row < rows; ++row) {
    double carried = 0;
    for (BondId e = 0; e < network.bonds(); ++e) {
      const auto [a, b] = network.lattice.bond[e];
      const bool crosses = network.lattice.position[a].y == row && network.lattice.position[b].y == row + 1;
      const double along = network.components == 1 ? 1 : network.lattice.direction[e].y;
      if (crosses) carried += along * snapshot.force[e];
    }
    EXPECT_NEAR(carried, load, 1e-12 * std::max(1.0, load)) << "above row " << row;
  }
}

TEST(ObserveSnapshot, EveryCutCarriesTheLoadWhenAskedFor) {
  {
    for (const test::NamedNetwork& named : test::triangular_networks(5)) {
      SCOPED_TRACE(named.name);
      const Network& network = named.network;
      PhaseTimes times;
      const auto equilibrium = make_equilibrium(network, {}, times);
      SampleRecord record;
      ObserveBreaks breaks(record);
      ObserveSnapshot snapshot({1, 4, 7}, record);
      (void)watch(*equilibrium, 1, {&breaks, &snapshot});
      (void)watch(*equilibrium, 0, {&breaks, &snapshot});
      ASSERT_EQ(record.snapshots.size(), 3u);
      for (const Snapshot& taken : record.snapshots) {
        SCOPED_TRACE(taken.number);
        const int i = taken.number - 1;
        expect_cuts_carry(network, taken, record.load[i]);
        for (int earlier = 0; earlier < i; ++earlier) EXPECT_EQ(taken.force[record.bond[earlier]], 0);
        const double ratio =
            taken.force[record.bond[i]] / test::uniform_thresholds(network, 0)[record.bond[i]];
        EXPECT_NEAR(std::abs(ratio), 1, 1e-10) << "what breaks is at its threshold";
        EXPECT_NEAR(taken.displacement.back(), record.load[i] / record.stiffness[i], 1e-12) << "plate";
        EXPECT_EQ(taken.displacement[network.components - 1], 0) << "lower grip";
      }
    }
  }
  {
    const Network network = test::bundle(3);
    PhaseTimes times;
    const auto equilibrium = make_equilibrium(network, {}, times);
    SampleRecord record;
    ObserveSnapshot snapshot({2, 4, 100}, record);
    (void)watch(*equilibrium, 0, {&snapshot});
    ASSERT_EQ(record.snapshots.size(), 1u);
    EXPECT_EQ(record.snapshots[0].number, 2);
    EXPECT_TRUE(record.bond.empty());
  }
}

}  // namespace
}  // namespace crackle
