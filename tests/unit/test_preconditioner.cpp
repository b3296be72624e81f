#include <gtest/gtest.h>

#include "crackle/equilibrium_ksp.hpp"
#include "support/break_record.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"
#include "support/solver_options.hpp"

namespace crackle {
namespace {

struct Broken {
  SampleRecord record;
  EquilibriumCounts counts;
};

Broken break_ksp(const Network& network, EquilibriumOptions options, std::int64_t sample) {
  PhaseTimes times;
  options.strategy = "ksp";
  const auto equilibrium = make_equilibrium(network, options, times);
  Broken broken;
  broken.record = test::break_record(*equilibrium, test::uniform_thresholds(network, sample));
  broken.counts = equilibrium->counts();
  return broken;
}

/// The same bonds as dense, in every kind of network, for three samples with one strategy object.
void expect_dense_breaks(EquilibriumOptions options, int size, bool uneven = true) {
  for (const test::NamedNetwork& named : test::triangular_networks(size)) {
    if (named.name == "uneven springs" && !uneven) continue;
    PhaseTimes times;
    options.strategy = "ksp";
    const auto equilibrium = make_equilibrium(named.network, options, times);
    for (const std::int64_t sample : {0, 1, 0}) {
      SCOPED_TRACE(named.name + " " + std::to_string(size) + " sample " + std::to_string(sample));
      const auto threshold = test::uniform_thresholds(named.network, sample);
      const SampleRecord dense = test::break_record(named.network, {.strategy = "dense"}, threshold);
      EXPECT_EQ(test::break_record(*equilibrium, threshold).bond, dense.bond);
    }
  }
}

TEST(Preconditioner, CirculantAndWoodburyBreakTheBondsThatDenseBreaks) {
  {
    const test::SolverOptions options{{"-ksp_type", "cg"}, {"-pc_type", "circulant"}};
    for (const int size : {2, 5}) expect_dense_breaks({}, size);
  }
  for (const char* rank : {"500", "4", "1"}) {
    for (const char* ksp : {"preonly", "cg"}) {
      const test::SolverOptions options{
          {"-ksp_type", ksp}, {"-pc_type", "woodbury"}, {"-pc_woodbury_rank", rank}};
      expect_dense_breaks({}, 5);
    }
  }
}

TEST(Preconditioner, LaggingBreaksTheSameBondsWithFewerSetUps) {
  const Network network = test::triangular_networks(8)[1].network;
  const SampleRecord dense =
      test::break_record(network, {.strategy = "dense"}, test::uniform_thresholds(network, 0));
  const auto breaks = static_cast<std::int64_t>(dense.bond.size());
  for (const auto& [pc, package] : {std::pair{"cholesky", "cholmod"}, std::pair{"cholesky", "mumps"},
                                    std::pair{"icc", "petsc"}, std::pair{"gamg", ""}}) {
    SCOPED_TRACE(pc);
    const test::SolverOptions options{
        {"-ksp_type", "cg"}, {"-pc_type", pc}, {"-pc_factor_mat_solver_type", package}};
    const Broken fresh = break_ksp(network, {}, 0);
    const Broken lagged = break_ksp(network, {.refactor_every = 10}, 0);
    EXPECT_EQ(fresh.record.bond, dense.bond);
    EXPECT_EQ(lagged.record.bond, dense.bond);
    EXPECT_GE(fresh.counts.factorizations, breaks);
    EXPECT_LE(lagged.counts.factorizations, breaks / 10 + 3 + lagged.counts.refactors);
    EXPECT_GE(lagged.counts.iterations, fresh.counts.iterations);
  }
}

/// At 1e-12 a start from the last state saves nothing; at loose tolerances it is part of the answer.
TEST(Preconditioner, WarmStartsTakeFewerIterationsToALooseTolerance) {
  const Network network = test::triangular_networks(12)[1].network;
  const auto iterations = [&](const char* warm) {
    const test::SolverOptions options{{"-ksp_type", "cg"},
                                      {"-pc_type", "jacobi"},
                                      {"-ksp_rtol", "1e-3"},
                                      {"-ksp_initial_guess_nonzero", warm}};
    PhaseTimes times;
    const auto equilibrium = make_equilibrium_ksp(network, {}, times);
    (void)test::break_record(*equilibrium, test::uniform_thresholds(network, 0),
                             {StopRule::Kind::breaks, 30});
    return equilibrium->counts().iterations;
  };
  EXPECT_LT(iterations("true"), 0.95 * static_cast<double>(iterations("false")));
}

TEST(Preconditioner, RefusesALagWhereItHasNoMeaning) {
  const Network network = test::triangular_networks(3)[0].network;
  const auto refused = [&](const std::vector<std::string>& words) {
    PhaseTimes times;
    test::expect_refused([&] { (void)make_equilibrium_ksp(network, {.refactor_every = 5}, times); }, words);
  };
  refused({"-equilibrium_refactor_every", "5", "preonly"});
  const test::SolverOptions cg{{"-ksp_type", "cg"}};
  for (const char* type : {"updown", "woodbury", "circulant"}) {
    const test::SolverOptions options{{"-pc_type", type}};
    refused({"-equilibrium_refactor_every", "5", "follows the breaks"});
  }
}

TEST(Preconditioner, CirculantRefusesANetworkThatDoesNotRepeat) {
  const test::SolverOptions options{{"-ksp_type", "cg"}, {"-pc_type", "circulant"}};
  const Network network = test::chain(4);
  PhaseTimes times;
  test::expect_refused([&] { (void)make_equilibrium_ksp(network, {}, times); }, {"-pc_type", "circulant"});
}

}  // namespace
}  // namespace crackle
