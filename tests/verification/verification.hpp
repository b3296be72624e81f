/// What the verification tests share: scenes by solver options, whole samples, one list of breaks each.
#pragma once

#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

#include "crackle/equilibrium/equilibrium.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "crackle/fracture/fracture.hpp"

namespace crackle::verification {

/// One way to solve: `-equilibrium` and the PETSc options that go with it.
struct Strategy {
  const char* name;
  const char* equilibrium;
  const char* petsc_options;
  bool verify = false;
  const TreeKernels* kernels = nullptr;  ///< tree: null for the fastest
};

inline constexpr Strategy kUpdown{"updown", "ksp", "-ksp_type preonly -pc_type updown"};
inline constexpr Strategy kUpdownCg{"updown_cg", "ksp", "-ksp_type cg -pc_type updown -pc_updown_rank 8"};
inline constexpr Strategy kMumps{
    "mumps", "ksp",
    "-ksp_type preonly -pc_type cholesky -pc_factor_mat_solver_type mumps -mat_mumps_icntl_24 1"};
inline constexpr Strategy kCholmod{
    "cholmod", "ksp",
    "-ksp_type preonly -pc_type cholesky -pc_factor_mat_solver_type cholmod -mat_cholmod_print 0"};
inline constexpr Strategy kTree{"tree", "tree", ""};
inline constexpr Strategy kTreeVerified{"tree, verified", "tree", "", true};
inline constexpr Strategy kDense{"dense", "dense", ""};

struct Setting {
  Model model = Model::spring;
  Grips grips = Grips::sliding;
  BreakOn break_on = BreakOn::magnitude;
  int size = 8;
};

/// Letters, digits and _ alone: names tests.
std::ostream& operator<<(std::ostream& out, const Setting& setting);

[[nodiscard]] Network triangular(const Setting& setting);

/// The strategy on that network; `network` must outlive it. Leaves PETSc's options database empty.
[[nodiscard]] std::unique_ptr<Equilibrium> start(const Strategy& strategy, const Network& network,
                                                 BreakOn break_on, PhaseTimes& times);

/// Breaks of a whole sample, in order.
struct Sequence {
  std::vector<BondId> bond;
  std::vector<double> load;
  SampleSummary summary;
};

[[nodiscard]] Sequence break_whole(Equilibrium& equilibrium, std::uint64_t seed, std::int64_t sample);

/// K u = e_plate with a factor made from scratch for the network without its broken bonds, and so many steps
/// of iterative refinement with residuals from the bonds in long double.
[[nodiscard]] std::vector<double> solve_afresh(const Network& network,
                                               const std::vector<std::uint8_t>& broken, int refinements = 0);

}  // namespace crackle::verification
