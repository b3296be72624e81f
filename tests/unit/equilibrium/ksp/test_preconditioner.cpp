#include <gtest/gtest.h>

#include "crackle/equilibrium/ksp/equilibrium_ksp.hpp"
#include "crackle/equilibrium/ksp/pc_shell.hpp"
#include "crackle/equilibrium/ksp/preconditioner_kind.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
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

Broken break_ksp(const Network& network, ChosenStrategy options, std::int64_t sample) {
  PhaseTimes times;
  options.strategy = "ksp";
  const auto equilibrium = make_equilibrium(network, options, times);
  Broken broken;
  broken.record = test::break_record(*equilibrium, test::uniform_thresholds(network, sample));
  broken.counts = equilibrium->counts();
  return broken;
}

/// The same bonds as dense, in every kind of network, for three samples with one strategy object.
void expect_dense_breaks(ChosenStrategy options, int size, bool uneven = true) {
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

/// What a lag saves is set-ups. Iterations follow no law but one: an exact factor of another matrix leaves at least two
/// of them (an incomplete one of a nearly singular matrix may be worse than an older one).
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
    const Broken lagged = break_ksp(network, {.ksp = {.refactor_every = 10}}, 0);
    EXPECT_EQ(fresh.record.bond, dense.bond);
    EXPECT_EQ(lagged.record.bond, dense.bond);
    EXPECT_GE(fresh.counts.factorizations, breaks);
    EXPECT_LE(lagged.counts.factorizations, breaks / 10 + 1 + lagged.counts.refactors);
    if (std::string(pc) != "cholesky") continue;
    EXPECT_GE(lagged.counts.iterations, breaks + (breaks - lagged.counts.factorizations));
  }
}

/// A diagonal that counts how often PETSc has it made.
struct CountedDiagonal {
  static constexpr const char* kType = "counted_diagonal";
  static inline std::int64_t made = 0;
  petsc::VecHandle inverse;

  static PetscErrorCode set_up(PC pc) {
    return guarded(pc, kType, [pc] {
      ++made;
      auto& inverse = pc_data<CountedDiagonal>(pc).inverse;
      petsc::check(MatCreateVecs(pc->pmat, inverse.out(), nullptr));
      petsc::check(MatGetDiagonal(pc->pmat, inverse));
      petsc::check(VecReciprocal(inverse));
    });
  }
  static PetscErrorCode apply(PC pc, Vec b, Vec x) {
    return guarded(pc, kType,
                   [&] { petsc::check(VecPointwiseMult(x, b, pc_data<CountedDiagonal>(pc).inverse)); });
  }
  static PetscErrorCode view(PC /*pc*/, PetscViewer /*viewer*/) { return 0; }
  static PetscErrorCode create(PC pc) {
    return guarded(pc, kType, [pc] { pc_create<CountedDiagonal>(pc, set_up, apply, view); });
  }
};

TEST(Preconditioner, ALagLeavesThePreconditionerAlone) {
  petsc::check(PCRegister(CountedDiagonal::kType, CountedDiagonal::create));
  const test::SolverOptions options{{"-ksp_type", "cg"}, {"-pc_type", CountedDiagonal::kType}};
  const Network network = test::triangular_networks(8)[1].network;
  for (const int every : {1, 10}) {
    SCOPED_TRACE(every);
    CountedDiagonal::made = 0;
    const Broken broken = break_ksp(network, {.ksp = {.refactor_every = every}}, 0);
    const auto breaks = static_cast<std::int64_t>(broken.record.bond.size());
    EXPECT_EQ(CountedDiagonal::made, broken.counts.factorizations);
    EXPECT_GE(CountedDiagonal::made, breaks / every);
    EXPECT_LE(CountedDiagonal::made, breaks / every + 1 + broken.counts.refactors);
  }
}

/// The intact factor solves the intact network in one iteration. A break then leaves a residual of the bond's force, a
/// twentieth of the load: a start from there is within half the load at once, one from zero is not.
TEST(Preconditioner, WarmStartsBeginAtTheLastState) {
  const Network network = test::triangular_networks(12)[1].network;
  for (const auto& [warm, expected] : {std::pair{"true", 1}, std::pair{"false", 2}}) {
    SCOPED_TRACE(warm);
    const test::SolverOptions options{{"-ksp_type", "cg"},
                                      {"-pc_type", "cholesky"},
                                      {"-ksp_rtol", "0.5"},
                                      {"-ksp_norm_type", "unpreconditioned"},
                                      {"-ksp_initial_guess_nonzero", warm}};
    PhaseTimes times;
    const auto equilibrium = make_equilibrium_ksp(network, {}, times, {.refactor_every = 10});
    equilibrium->reset(test::uniform_thresholds(network, 0));
    Critical next;
    ASSERT_EQ(equilibrium->find_critical(next), State::carrying);
    EXPECT_EQ(equilibrium->counts().iterations, 1);
    equilibrium->remove(next.bond);
    ASSERT_EQ(equilibrium->find_critical(next), State::carrying);
    EXPECT_EQ(equilibrium->counts().iterations, expected);
  }
}

TEST(Preconditioner, RefusesALagWhereItHasNoMeaning) {
  const Network network = test::triangular_networks(3)[0].network;
  const auto refused = [&](const std::vector<std::string>& words) {
    PhaseTimes times;
    test::expect_refused([&] { (void)make_equilibrium_ksp(network, {}, times, {.refactor_every = 5}); },
                         words);
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

/// Types that are not ours do nothing about a break, whatever they are.
TEST(Preconditioner, EveryTypeOfOursHasARowAndAllOthersShareOne) {
  struct Row {
    const char* type;
    bool is_ours, follows;
  };
  const PreconditionerKind* others = nullptr;
  for (const Row row : {Row{"updown", true, true}, Row{"woodbury", true, true}, Row{"circulant", true, false},
                        Row{PCJACOBI, false, false}, Row{PCCHOLESKY, false, false}}) {
    petsc::KspHandle ksp;
    PC pc = nullptr;
    petsc::check(KSPCreate(PETSC_COMM_SELF, ksp.out()));
    petsc::check(KSPGetPC(ksp, &pc));
    petsc::check(PCSetType(pc, row.type));
    const PreconditionerKind& kind = kind_of(pc);
    EXPECT_EQ(kind.is_ours, row.is_ours) << row.type;
    EXPECT_EQ(kind.follows, row.follows) << row.type;
    if (row.is_ours) {
      EXPECT_TRUE(kind.is(pc)) << row.type;
      continue;
    }
    if (others == nullptr) others = &kind;
    EXPECT_EQ(&kind, others) << row.type;
    EXPECT_EQ(kind.remove(pc, {}), 1) << row.type;
    EXPECT_TRUE(kind.renew(pc)) << row.type;
  }
}

}  // namespace
}  // namespace crackle
