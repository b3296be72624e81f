#include <gtest/gtest.h>

#include "crackle/equilibrium/ksp/pc_updown.hpp"
#include "crackle/network/network_matrix.hpp"
#include "support/dense_reference.hpp"
#include "support/small_networks.hpp"
#include "support/solver_options.hpp"

namespace crackle {
namespace {

using petsc::check;

/// A network, its matrix, and a solver with `-pc_type updown` on it.
class Solver {
 public:
  Solver(const Network& network, const char* ksp_type, const std::string& rank = "1")
      : network_(network), matrix_(network), broken_(network.lattice.bond.size(), 0) {
    const test::SolverOptions options{{"-pc_updown_rank", rank}};
    check(KSPCreate(PETSC_COMM_SELF, ksp_.out()));
    check(KSPSetOperators(ksp_, matrix_.get(), matrix_.get()));
    check(KSPSetType(ksp_, ksp_type));
    check(KSPGetPC(ksp_, &pc_));
    check(PCSetType(pc_, "updown"));
    check(KSPSetTolerances(ksp_, 1e-13, PETSC_DEFAULT, PETSC_DEFAULT, 100));
    check(KSPSetFromOptions(ksp_));
    check(MatCreateVecs(matrix_.get(), u_.out(), load_.out()));
    check(VecSetValue(load_, network.plate, 1, INSERT_VALUES));
    check(VecAssemblyBegin(load_));
    check(VecAssemblyEnd(load_));
  }

  std::vector<double> solve() {
    check(KSPSolve(ksp_, load_, u_));
    const double* values = nullptr;
    check(VecGetArrayRead(u_, &values));
    std::vector<double> result(values, values + network_.unknowns);
    check(VecRestoreArrayRead(u_, &values));
    return result;
  }

  /// Takes bonds out of the matrix alone.
  void change(std::span<const BondId> bonds, std::uint8_t broken = 1) {
    for (const BondId e : bonds) broken_[e] = broken;
    matrix_.update(bonds, broken_);
  }

  /// Takes a bond out of the matrix and tells the preconditioner.
  double remove(BondId e) {
    change({&e, 1});
    return pc_updown_remove(pc_, test::bond_change(network_, e));
  }

  [[nodiscard]] double backward_error(const std::vector<double>& u) const {
    std::vector<double> r(u.size());
    return crackle::backward_error(network_, broken_, u, r);
  }
  [[nodiscard]] KSPConvergedReason reason() const {
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    check(KSPGetConvergedReason(ksp_, &reason));
    return reason;
  }
  [[nodiscard]] int iterations() const {
    PetscInt iterations = 0;
    check(KSPGetIterationNumber(ksp_, &iterations));
    return iterations;
  }
  [[nodiscard]] PC pc() const { return pc_; }
  [[nodiscard]] PcUpdownCounts counts() const { return pc_updown_counts(pc_); }
  [[nodiscard]] const std::vector<std::uint8_t>& broken() const { return broken_; }

 private:
  const Network& network_;
  NetworkMatrix matrix_;
  std::vector<std::uint8_t> broken_;
  petsc::KspHandle ksp_;
  petsc::VecHandle u_, load_;
  PC pc_ = nullptr;
};

TEST(PcUpdown, FactorsAfreshOnlyWhatOthersChanged) {
  {
    const Network network = test::triangular_networks(4)[1].network;
    Solver solver(network, KSPPREONLY);
    (void)solver.solve();
    const auto bonds = test::safe_removals(network, 6);
    for (const BondId e : bonds) {
      (void)solver.remove(e);
      (void)solver.solve();
      (void)solver.solve();
    }
    EXPECT_EQ(bonds.size(), 6u);
    EXPECT_EQ(solver.counts().factorizations, 1);
    EXPECT_EQ(solver.counts().downdates, 6);
    EXPECT_EQ(solver.counts().rank, 6);
    EXPECT_EQ(solver.counts().null_pivots, 0);
    EXPECT_GE(solver.counts().entries, network.unknowns);
  }
  {
    const Network network = test::triangular_networks(4)[1].network;
    Solver solver(network, KSPPREONLY);
    (void)solver.solve();
    const auto bonds = test::safe_removals(network, 3);
    solver.change(bonds);
    EXPECT_LT(solver.backward_error(solver.solve()), 1e-15);
    EXPECT_EQ(solver.counts().factorizations, 2);
    EXPECT_EQ(solver.counts().downdates, 0);
    (void)solver.solve();
    EXPECT_EQ(solver.counts().factorizations, 2) << "nothing has changed since";
  }
}

/// With m breaks not yet in the factor the preconditioned matrix has m + 1 eigenvalues: CG ends after m + 1
/// iterations, and where rounding leaves more than the tolerance, after another.
constexpr int kForRounding = 1;

TEST(PcUpdown, LeavesBreaksToConjugateGradientsUpToItsRank) {
  for (const test::NamedNetwork& named : test::triangular_networks(4)) {
    SCOPED_TRACE(named.name);
    Solver solver(named.network, KSPCG, "4");
    ASSERT_EQ(pc_updown_rank(solver.pc()), 4);
    (void)solver.solve();
    EXPECT_LE(solver.iterations(), 1 + kForRounding);
    int waiting = 0;
    for (const BondId e : test::safe_removals(named.network, 9)) {
      const double slack = solver.remove(e);
      waiting = (waiting + 1) % 4;
      if (waiting > 0) {
        EXPECT_EQ(slack, 1);
      }
      if (waiting == 0) {
        EXPECT_LT(slack, 1);
      }
      const auto expected = test::dense_displacements(named.network, solver.broken());
      EXPECT_LT(test::relative_difference(solver.solve(), expected), 1e-11);
      EXPECT_GT(solver.reason(), 0);
      EXPECT_LE(solver.iterations(), waiting + 1 + kForRounding);
    }
    EXPECT_EQ(solver.counts().factorizations, 1);
    EXPECT_EQ(solver.counts().downdates, 2);
    EXPECT_EQ(solver.counts().rank, 8);
  }
}

TEST(PcUpdown, RestoresTheFactorItKeptOrMakesANewOne) {
  {
    for (const char* rank : {"1", "3"}) {
      SCOPED_TRACE(rank);
      const Network network = test::triangular_networks(4)[1].network;
      Solver solver(network, KSPCG, rank);
      const std::vector<double> intact = solver.solve();
      pc_updown_keep(solver.pc());
      const auto bonds = test::safe_removals(network, 5);
      for (const BondId e : bonds) (void)solver.remove(e);
      EXPECT_NE(solver.solve(), intact);
      solver.change(bonds, 0);
      ASSERT_TRUE(pc_updown_restore(solver.pc()));
      EXPECT_EQ(solver.solve(), intact);
      // what waited for the factor is forgotten, too
      for (std::size_t i = 0; i < 3; ++i) (void)solver.remove(bonds[i]);
      const auto expected = test::dense_displacements(network, solver.broken());
      EXPECT_LT(test::relative_difference(solver.solve(), expected), 1e-11);
      EXPECT_LE(solver.iterations(), 1 + kForRounding) << "the factor has all three";
      EXPECT_EQ(solver.counts().factorizations, 1);
    }
  }
  {
    const Network network = test::triangular_networks(4)[1].network;
    Solver solver(network, KSPPREONLY);
    const std::vector<double> intact = solver.solve();
    const BondId e = test::safe_removals(network, 1)[0];
    (void)solver.remove(e);
    solver.change({&e, 1}, 0);
    EXPECT_FALSE(pc_updown_restore(solver.pc()));
    EXPECT_EQ(solver.solve(), intact);
    EXPECT_EQ(solver.counts().factorizations, 2);
  }
}

TEST(PcUpdown, TellsALoosePlateAndCountsPins) {
  {
    const Network network = test::chain(4);
    Solver solver(network, KSPPREONLY);
    EXPECT_NEAR(solver.solve()[network.plate], 4, 1e-14);
    const BondId middle = 2;
    solver.change({&middle, 1});
    EXPECT_FALSE(pc_updown_refactor(solver.pc()));
    (void)solver.solve();
    EXPECT_EQ(solver.reason(), KSP_DIVERGED_PC_FAILED);
    solver.change({&middle, 1}, 0);
    EXPECT_TRUE(pc_updown_refactor(solver.pc()));
    EXPECT_NEAR(solver.solve()[network.plate], 4, 1e-14);
  }
  {
    const Network network = test::inclined_chain(Grips::clamped);
    Solver solver(network, KSPPREONLY);
    EXPECT_NEAR(solver.solve()[network.plate], 2.5, 1e-14);
    EXPECT_EQ(solver.counts().null_pivots, 1);
  }
}

TEST(PcUpdown, IsTheSolverUnderPreonly) {
  for (const test::NamedNetwork& named : test::triangular_networks(4)) {
    SCOPED_TRACE(named.name);
    Solver solver(named.network, KSPPREONLY);
    EXPECT_TRUE(is_pc_updown(solver.pc()));
    EXPECT_EQ(pc_updown_rank(solver.pc()), 1);
    const auto expected = test::dense_displacements(named.network, solver.broken());
    EXPECT_LT(test::relative_difference(solver.solve(), expected), 1e-13);
    for (const BondId e : test::safe_removals(named.network, 6)) {
      EXPECT_GT(solver.remove(e), 0.04);
      const auto after = test::dense_displacements(named.network, solver.broken());
      EXPECT_LT(test::relative_difference(solver.solve(), after), 1e-12) << e;
    }
  }
  petsc::KspHandle ksp;
  PC pc = nullptr;
  check(KSPCreate(PETSC_COMM_SELF, ksp.out()));
  check(KSPGetPC(ksp, &pc));
  check(PCSetType(pc, PCJACOBI));
  EXPECT_FALSE(is_pc_updown(pc));
}

}  // namespace
}  // namespace crackle
