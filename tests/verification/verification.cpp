#include "verification.hpp"

#include <gtest/gtest.h>

#include <ostream>

#include "crackle/base/petsc_handle.hpp"
#include "crackle/equilibrium/ksp/preconditioner_kind.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/factor/cholmod_factor.hpp"
#include "crackle/network/disorder.hpp"
#include "crackle/network/lattices.hpp"
#include "crackle/network/matrix_rows.hpp"
#include "crackle/network/network_matrix.hpp"
#include "crackle/record/part_breaks.hpp"
#include "support/leak_check.hpp"

namespace crackle::verification {

std::ostream& operator<<(std::ostream& out, const Setting& setting) {
  out << (setting.model == Model::fuse ? "fuse" : "spring");
  if (setting.model == Model::spring) out << (setting.grips == Grips::sliding ? "_sliding" : "_clamped");
  return out << (setting.break_on == BreakOn::tension ? "_tension" : "_magnitude") << "_L" << setting.size;
}

Network triangular(const Setting& setting) {
  return make_network(triangular_lattice(setting.size, 1), setting.model, setting.grips, {});
}

std::unique_ptr<Equilibrium> start(const Strategy& strategy, const Network& network, BreakOn break_on,
                                   PhaseTimes& times) {
  petsc::check(PetscOptionsInsertString(nullptr, strategy.petsc_options));
  ChosenStrategy options;
  options.strategy = strategy.equilibrium;
  options.common.break_on = break_on;
  options.tree.verify = strategy.verify;
  options.tree.kernels = strategy.kernels;
  auto equilibrium = make_equilibrium(network, options, times);
  petsc::check(PetscOptionsClear(nullptr));
  return equilibrium;
}

Sequence break_whole(Equilibrium& equilibrium, std::uint64_t seed, std::int64_t sample) {
  std::vector<double> threshold(equilibrium.network().lattice.bond.size());
  draw_uniform_thresholds(seed, sample, threshold);
  SampleRecord record;
  ObserveBreaks breaks(record);
  Observer* const observers[] = {&breaks};
  Sequence sequence;
  sequence.summary = break_sample(equilibrium, sample, threshold, {}, observers);
  sequence.bond = record.bond;
  sequence.load = record.load;
  return sequence;
}

namespace {

std::vector<double> precise_residual(const Network& network, const std::vector<std::uint8_t>& broken,
                                     const std::vector<double>& u) {
  std::vector<long double> r(u.size(), 0.0L);
  r.back() = 1;
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (broken[e] != 0) continue;
    const auto dofs = network.bond_dofs(e);
    const auto values = network.bond_values(e);
    long double force = 0;
    for (std::size_t i = 0; i < dofs.size(); ++i) force += static_cast<long double>(values[i]) * u[dofs[i]];
    force *= network.stiffness[e];
    for (std::size_t i = 0; i < dofs.size(); ++i) r[dofs[i]] -= values[i] * force;
  }
  return {r.begin(), r.end()};
}

}  // namespace

std::vector<double> solve_afresh(const Network& network, const std::vector<std::uint8_t>& broken,
                                 int refinements) {
  NetworkMatrix matrix(network);
  std::vector<BondId> gone;
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (broken[e] != 0) gone.push_back(e);
  }
  matrix.update(gone, broken);
  const MatrixRows view(matrix.get());
  const SymmetricRows rows = view.rows();
  CholmodFactor factor(rows, network.components);
  EXPECT_TRUE(factor.factor(rows));
  std::vector<double> load(static_cast<std::size_t>(rows.n), 0.0);
  std::vector<double> u(load.size());
  load.back() = 1;
  factor.solve(load, u);
  for (std::vector<double> step(load.size()); refinements > 0; --refinements) {
    factor.solve(precise_residual(network, broken, u), step);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] += step[i];
  }
  return u;
}

}  // namespace crackle::verification

#ifdef __SANITIZE_ADDRESS__
// PETSc's interface to CHOLMOD drops two arrays when the matrix is singular; whole stacks are needed to see it
extern "C" const char* __lsan_default_suppressions() {
  return "leak:MatCholeskyFactorNumeric\n";
}  // NOLINT
extern "C" const char* __asan_default_options() {
  return "fast_unwind_on_malloc=0";
}  // NOLINT
#endif

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  crackle::test::ignore_leaks();
  const crackle::petsc::Session session(argc, argv, nullptr);
  crackle::test::note_leaks();
  crackle::register_preconditioners();
  const int failed = RUN_ALL_TESTS();
  crackle::test::check_leaks();
  return failed;
}
