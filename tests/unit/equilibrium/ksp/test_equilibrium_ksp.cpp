#include <gtest/gtest.h>

#include <limits>

#include "crackle/equilibrium/ksp/equilibrium_ksp.hpp"
#include "support/break_record.hpp"
#include "support/dense_reference.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"
#include "support/solver_options.hpp"

namespace crackle {
namespace {

/// Breaks three samples of every kind of network by ksp and by dense. Conditioning grows as the stiffness F falls: of
/// loads and stiffnesses, relative errors up to tolerance F_1 / F_k.
void expect_dense_breaks(int size, double tolerance) {
  for (const test::NamedNetwork& named : test::triangular_networks(size)) {
    for (const std::int64_t sample : {0, 1, 2}) {
      SCOPED_TRACE(named.name + " " + std::to_string(size) + " sample " + std::to_string(sample));
      const auto threshold = test::uniform_thresholds(named.network, sample);
      const SampleRecord dense = test::break_record(named.network, {.strategy = "dense"}, threshold);
      const SampleRecord ksp = test::break_record(named.network, {.strategy = "ksp"}, threshold);
      ASSERT_EQ(ksp.bond, dense.bond);
      EXPECT_EQ(ksp.summary.n_p, dense.summary.n_p);
      for (std::size_t i = 0; i < dense.bond.size(); ++i) {
        const double allowed = tolerance * dense.stiffness[0] / dense.stiffness[i];
        EXPECT_NEAR(ksp.load[i] / dense.load[i], 1, allowed) << i;
        EXPECT_NEAR(ksp.stiffness[i] / dense.stiffness[i], 1, allowed) << i;
      }
    }
  }
}

TEST(EquilibriumKsp, BreaksTheBondsThatDenseBreaks) {
  for (const int size : {1, 2, 3, 6}) expect_dense_breaks(size, 1e-11);
}

TEST(EquilibriumKsp, BreaksThemByConjugateGradientsToo) {
  {
    const test::SolverOptions options{{"-ksp_type", "cg"}, {"-pc_type", "jacobi"}};
    for (const int size : {1, 3}) expect_dense_breaks(size, 1e-9);
  }
  {
    const test::SolverOptions options{{"-ksp_type", "cg"}, {"-pc_updown_rank", "4"}};
    for (const int size : {1, 3, 5}) expect_dense_breaks(size, 1e-9);
  }
}

TEST(EquilibriumKsp, KnowsTheIntactStiffness) {
  PhaseTimes times;
  for (const int size : {1, 2, 3, 16}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      if (named.name == "uneven springs") continue;
      SCOPED_TRACE(named.name + " " + std::to_string(size));
      const auto equilibrium = make_equilibrium_ksp(named.network, {}, times);
      equilibrium->reset(test::uniform_thresholds(named.network, 0));
      Critical next;
      ASSERT_EQ(equilibrium->find_critical(next), State::carrying);
      EXPECT_NEAR(equilibrium->intact_stiffness(), test::intact_stiffness(size, named.network.model), 1e-12);
    }
  }
}

TEST(EquilibriumKsp, LeavesAResidualOfRoundingAfterEveryBreak) {
  PhaseTimes times;
  const Network network = test::triangular_networks(8)[1].network;
  const auto equilibrium = make_equilibrium_ksp(network, {}, times);
  equilibrium->reset(test::uniform_thresholds(network, 0));
  Critical next;
  std::vector<double> r(static_cast<std::size_t>(network.unknowns));
  int breaks = 0;
  for (; equilibrium->find_critical(next) == State::carrying; ++breaks) {
    const double error = backward_error(network, equilibrium->broken(), equilibrium->displacements(), r);
    ASSERT_LT(error, 1e-12) << "break " << breaks;
    equilibrium->remove(next.bond);
  }
  EXPECT_GT(breaks, 20);
  EXPECT_EQ(equilibrium->counts().breaks, breaks);
  EXPECT_EQ(equilibrium->counts().unknowns, network.unknowns);
}

TEST(EquilibriumKsp, FactorsTheIntactNetworkOnceForAllSamples) {
  PhaseTimes times;
  const Network network = test::triangular_networks(5)[0].network;
  const auto equilibrium = make_equilibrium_ksp(network, {}, times);
  const SampleRecord first = test::break_record(*equilibrium, test::uniform_thresholds(network, 0));
  (void)test::break_record(*equilibrium, test::uniform_thresholds(network, 1));
  const SampleRecord again = test::break_record(*equilibrium, test::uniform_thresholds(network, 0));
  EXPECT_EQ(again.bond, first.bond);
  EXPECT_EQ(again.load, first.load) << "to the last bit";
  EXPECT_EQ(again.stiffness, first.stiffness);
  const EquilibriumCounts counts = equilibrium->counts();
  EXPECT_EQ(counts.factorizations, 1 + counts.refactors);
}

TEST(EquilibriumKsp, RefactorsOnlyBehindATinySlack) {
  // Node 1 hangs on a stiff fuse to the bottom and a weak one to the plate, beside a fuse from grip to grip.
  // Without the stiff one it is held 1e9 times less: det K falls from (1 + s)^2 - s^2 to s (1 + s) - s^2.
  {
    const double s = 1e-9;
    const Network network = test::fuses_between(3, {{0, 2}, {0, 1}, {1, 2}}, {1, 1, s});
    PhaseTimes times;
    const auto equilibrium = make_equilibrium_ksp(network, {}, times);
    const SampleRecord record = test::break_record(*equilibrium, std::vector{1.0, 1e-12, 10.0});
    EXPECT_EQ(record.bond, (std::vector<BondId>{1, 0}));
    EXPECT_NEAR(record.load[0], 1e-12 * (1 + 2 * s) / s, 1e-10);
    EXPECT_NEAR(record.load[1], 1, 1e-12);
    EXPECT_NEAR(record.stiffness[1], 1, 1e-12);
    EXPECT_EQ(equilibrium->counts().refactors, 1);
    EXPECT_NEAR(equilibrium->counts().smallest_slack, s / (1 + 2 * s), 1e-3 * s);
  }
  // Two fuses side by side in a chain, one 1e-5 times as strong: a small slack that is still trusted, checked
  // by the residual.
  {
    const double s = 1e-5;
    const Network network = test::fuses_between(4, {{0, 1}, {1, 2}, {1, 2}, {2, 3}}, {1, 1, s, 1});
    PhaseTimes times;
    const auto equilibrium = make_equilibrium_ksp(network, {}, times);
    const SampleRecord record = test::break_record(*equilibrium, std::vector{2.0, 0.5, 1.0, 3.0});
    EXPECT_EQ(record.bond, (std::vector<BondId>{1, 2}));
    EXPECT_NEAR(record.load[0], 0.5 * (1 + s), 1e-12);
    // a slack of s makes a relative rounding of 1/s times that of its terms
    const double rounding = 10 * std::numeric_limits<double>::epsilon() / s;
    EXPECT_NEAR(record.load[1], 1, rounding);
    EXPECT_NEAR(record.stiffness[1], s / (1 + 2 * s), rounding * s);
    EXPECT_EQ(equilibrium->counts().refactors, 0);
    EXPECT_GT(equilibrium->counts().largest_residual, 0);
    EXPECT_LT(equilibrium->counts().largest_residual, 1e-12);
  }
}

TEST(EquilibriumKsp, PinsFloppyUnknownsAndTellsALoosePlate) {
  PhaseTimes times;
  const Network clamped = test::inclined_chain(Grips::clamped);
  const auto equilibrium = make_equilibrium_ksp(clamped, {}, times);
  const SampleRecord record = test::break_record(*equilibrium, std::vector{0.3, 0.2});
  EXPECT_EQ(record.bond, std::vector<BondId>{1});
  EXPECT_NEAR(record.stiffness[0], 0.4, 1e-14);
  EXPECT_EQ(equilibrium->counts().null_pivots, 1);

  const Network sliding = test::inclined_chain(Grips::sliding);
  const auto loose = make_equilibrium_ksp(sliding, {}, times);
  loose->reset(std::vector{0.3, 0.2});
  Critical next;
  EXPECT_EQ(loose->find_critical(next), State::failed);
}

TEST(EquilibriumKsp, RefusesARankForPreonlyAndSaysWhyAnIterationGaveNoAnswer) {
  {
    const test::SolverOptions options{{"-ksp_type", "cg"}, {"-pc_type", "none"}, {"-ksp_max_it", "2"}};
    PhaseTimes times;
    const Network network = test::triangular_networks(5)[3].network;
    const auto equilibrium = make_equilibrium_ksp(network, {}, times);
    equilibrium->reset(test::uniform_thresholds(network, 0));
    Critical next;
    EXPECT_EQ(equilibrium->find_critical(next), State::unsolved);
    EXPECT_NE(equilibrium->complaint().find("DIVERGED_ITS"), std::string::npos) << equilibrium->complaint();
    EXPECT_EQ(equilibrium->counts().confirmations, 1);
  }
  {
    const test::SolverOptions options{{"-pc_updown_rank", "3"}};
    PhaseTimes times;
    const Network network = test::bundle(2);
    test::expect_refused([&] { (void)make_equilibrium_ksp(network, {}, times); },
                         {"-pc_updown_rank", "3", "preonly"});
  }
}

}  // namespace
}  // namespace crackle
