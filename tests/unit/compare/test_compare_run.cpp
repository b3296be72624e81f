#include <gtest/gtest.h>

#include <cmath>

#include "crackle/compare/compare_run.hpp"
#include "support/break_record.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"
#include "support/solver_options.hpp"

namespace crackle {
namespace {

const StrategyChoice kTree{"tree", "", "", {{"-equilibrium", "tree"}}};
const StrategyChoice kDense{"dense", "", "", {{"-equilibrium", "dense"}}};

StrategyChoice jacobi(const std::string& rtol) {
  return {"jacobi " + rtol,
          "",
          rtol,
          {{"-equilibrium", "ksp"}, {"-ksp_type", "cg"}, {"-pc_type", "jacobi"}, {"-ksp_rtol", rtol}}};
}

/// Three fuses side by side. Each carries a third; then a half; then all: they break at loads 0.6, 1.0, 0.9.
struct ThreeFuses {
  Network network = test::bundle(3);
  CompareScene scene{network, ChosenStrategy(), StopRule(), {0.5, 0.2, 0.9}};
};

TEST(CompareRun, TheReferenceBreaksABundleAsOneDoesByHand) {
  const ThreeFuses three;
  const ReferenceRun run = run_reference(three.scene, {.every = 2});
  EXPECT_EQ(run.bond, (std::vector<BondId>{1, 0, 2}));
  ASSERT_EQ(run.load.size(), 3u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(run.load[k], (std::vector{0.6, 1.0, 0.9})[k], 1e-15) << k;
    EXPECT_NEAR(run.stiffness[k], 3 - k, 1e-14) << k;
  }
  EXPECT_EQ(run.number, (std::vector<std::int64_t>{1, 3}));
  ASSERT_EQ(run.force.size(), 2u);
  EXPECT_NEAR(run.force[0][1], 1.0 / 3, 1e-15);
  EXPECT_NEAR(run.largest_force[1], 1, 1e-15);
  EXPECT_TRUE(run.failed);
  EXPECT_NEAR(run.peak_load, 1.0, 1e-15);
  EXPECT_EQ(run.n_p, 2);
  EXPECT_EQ(run.n_f, 3);
}

TEST(CompareRun, TheReferenceStopsAndSkipsWhereItIsTold) {
  ThreeFuses three;
  const ReferenceRun skipped = run_reference(three.scene, {.every = 2, .skip = 1});
  EXPECT_EQ(skipped.bond, (std::vector<BondId>{1, 0, 2})) << "those skipped included";
  ASSERT_EQ(skipped.load.size(), 2u);
  EXPECT_NEAR(skipped.load[0], 1.0, 1e-15);
  EXPECT_EQ(skipped.number, (std::vector<std::int64_t>{2}));
  EXPECT_EQ(skipped.n_p, 2) << "counted from the intact network";
  EXPECT_EQ(skipped.n_f, 3);
  test::expect_refused([&] { (void)run_reference(three.scene, {.skip = 4}); }, {"-compare_skip 4", "3"});

  three.scene.stop = {StopRule::Kind::breaks, 2};
  const ReferenceRun stopped = run_reference(three.scene, {.every = 1});
  EXPECT_EQ(stopped.bond, (std::vector<BondId>{1, 0}));
  EXPECT_EQ(stopped.n_f, 2);
  EXPECT_FALSE(stopped.failed);
}

TEST(CompareRun, ANetworkThatCarriesNothingIsToldOf) {
  const Network network = test::inclined_chain(Grips::sliding);
  const CompareScene scene{network, ChosenStrategy(), StopRule(), {0.3, 0.2}};
  test::expect_refused<SolverError>([&] { (void)run_reference(scene, {}); }, {"carries"});
}

/// Spring lattice of size 6, sample 0, measured at every 5th break.
struct Springs {
  Network network = test::triangular_networks(6)[1].network;
  CompareScene scene{network, ChosenStrategy(), StopRule(), test::uniform_thresholds(network, 0)};
  CompareOptions options{.every = 5, .repetitions = 2, .quiet = true};
  ReferenceRun reference = run_reference(scene, options);
};

TEST(CompareRun, StrategiesThatAreRightHaveNoDifferenceAndSmallErrors) {
  const Springs springs;
  const ReferenceRun& reference = springs.reference;
  const SampleRecord alone =
      test::break_record(springs.network, {.strategy = "dense"}, springs.scene.threshold);
  EXPECT_EQ(reference.bond, alone.bond);
  EXPECT_EQ(reference.n_p, alone.summary.n_p);
  const std::vector<StrategyChoice> choices{kTree, kDense, jacobi("1e-12")};
  const auto runs = run_strategies(springs.scene, springs.options, reference, choices);
  const std::size_t measured = reference.number.size();
  ASSERT_EQ(measured, (alone.bond.size() + 4) / 5);
  ASSERT_EQ(runs.size(), choices.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const StrategyRun& run = runs[i];
    SCOPED_TRACE(choices[i].name);
    EXPECT_EQ(run.choice.name, choices[i].name);
    EXPECT_EQ(run.complaint, "");
    EXPECT_EQ(run.first_difference, 0);
    EXPECT_EQ(run.differences, 0);
    EXPECT_EQ(run.n_f, reference.n_f);
    EXPECT_EQ(run.n_p, reference.n_p);
    EXPECT_NEAR(run.peak_load / reference.peak_load, 1, 1e-10);
    EXPECT_EQ(run.counts.iterations > 0, i == 2);
    EXPECT_EQ(run.total.size(), 2u);
    EXPECT_EQ(run.set_up.size(), 2u);
    EXPECT_EQ(run.phase.size(), 2 * kPhases);
    ASSERT_EQ(run.time.size(), 2 * measured);
    EXPECT_LE(run.time[0], run.time[measured - 1]);
    EXPECT_LE(run.time[measured - 1], run.total[0]);
    for (const auto* series : {&run.residual, &run.backward_error, &run.force_error, &run.load_error}) {
      ASSERT_EQ(series->size(), measured) << "of the first repetition alone";
      for (const double value : *series) EXPECT_LT(value, 1e-10);
    }
    EXPECT_EQ(run.iterations.size(), measured);
  }
}

/// How many bonds a strategy names that are not the reference's, in the reference's networks.
int wrong_bonds(const Springs& springs, const StrategyChoice& choice) {
  const StrategyOptions petsc_options(choice);
  PhaseTimes times;
  const auto equilibrium =
      make_equilibrium(springs.network, {.strategy = "ksp", .common = {.many_samples = false}}, times);
  equilibrium->reset(springs.scene.threshold);
  int wrong = 0;
  for (const BondId bond : springs.reference.bond) {
    Critical next;
    EXPECT_EQ(equilibrium->find_critical(next), State::carrying);
    if (next.bond != bond) ++wrong;
    equilibrium->remove(bond);
  }
  return wrong;
}

/// Along the reference a wrong bond is counted, and the run goes on in the same networks; along its own breaks nothing is
/// compared after the first.
TEST(CompareRun, AWrongBondIsCountedOrEndsTheComparison) {
  Springs springs;
  const std::vector<StrategyChoice> choices{jacobi("0.5")};
  const StrategyRun along = run_strategies(springs.scene, springs.options, springs.reference, choices)[0];
  ASSERT_EQ(along.complaint, "");
  EXPECT_GT(along.differences, 1);
  EXPECT_EQ(along.differences, wrong_bonds(springs, choices[0]));
  EXPECT_EQ(along.n_f, springs.reference.n_f);
  ASSERT_GT(along.first_difference, 0);
  EXPECT_GT(along.counts.doubtful, 0);
  EXPECT_LE(along.counts.first_doubtful, along.first_difference) << "told before it happens";
  for (const double error : along.force_error) EXPECT_TRUE(std::isfinite(error)) << "one network to the end";

  springs.options.along = Along::own;
  const StrategyRun own = run_strategies(springs.scene, springs.options, springs.reference, choices)[0];
  EXPECT_EQ(own.first_difference, along.first_difference);
  for (std::size_t i = 0; i < own.force_error.size(); ++i) {
    const bool same = springs.reference.number[i] <= own.first_difference;
    EXPECT_EQ(std::isnan(own.force_error[i]), !same) << springs.reference.number[i];
  }
}

/// What it did not reach is unknown, and has its place.
TEST(CompareRun, AStrategyThatEndsEarlySaysSo) {
  const Springs springs;
  StrategyChoice short_of_breath = jacobi("1e-12");
  short_of_breath.options["-ksp_max_it"] = "2";
  const std::vector<StrategyChoice> choices{short_of_breath, kTree};
  const auto runs = run_strategies(springs.scene, springs.options, springs.reference, choices);
  const StrategyRun& run = runs[0];
  const std::size_t measured = springs.reference.number.size();
  EXPECT_TRUE(run.complaint.starts_with("after break 0: ")) << run.complaint;
  EXPECT_EQ(run.n_f, 0);
  EXPECT_EQ(run.first_difference, 0) << "it named no other bond";
  EXPECT_EQ(run.time.size(), 2 * measured);
  EXPECT_EQ(run.total.size(), 2u);
  EXPECT_TRUE(std::isnan(run.total[0]) && std::isnan(run.time[0]));
  EXPECT_EQ(run.iterations, std::vector<std::int64_t>(measured, -1));
  ASSERT_EQ(run.force_error.size(), measured);
  EXPECT_TRUE(std::isnan(run.force_error.back()));
  EXPECT_EQ(runs[1].complaint, "") << "the next one runs all the same";
}

TEST(CompareRun, EveryStrategyIsTriedBeforeTimeIsSpent) {
  const ThreeFuses three;
  StrategyChoice misspelt = jacobi("1e-3");
  misspelt.options["-pc_tipe"] = "icc";
  EXPECT_NO_THROW(try_strategies(three.scene, std::vector{kTree, jacobi("1e-3")}));
  test::expect_refused(
      [&] {
        try_strategies(three.scene, std::vector{kTree, misspelt});
      },
      {"strategy jacobi 1e-3", "-pc_tipe"});
  const StrategyChoice unknown{"mine", "", "", {{"-equilibrium", "guess"}}};
  test::expect_refused([&] { try_strategies(three.scene, std::vector{unknown}); },
                       {"strategy mine", "-equilibrium guess"});
}

}  // namespace
}  // namespace crackle
