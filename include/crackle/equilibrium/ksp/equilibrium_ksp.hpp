/// `-equilibrium ksp`: the network as a PETSc matrix, solved by the KSP that PETSc's options describe.
///
/// Default: -ksp_type preonly -pc_type updown, the paper's algorithm. Any other solver sees a changed matrix
/// after each break and does what PETSc does with one: direct solvers factor it anew. Iterative ones get
/// rtol 1e-12 unless -ksp_rtol says otherwise; -ksp_initial_guess_nonzero starts them from the last state.
/// Where several processes share the network (EquilibriumOptions::ranks) the default is MUMPS's Cholesky.
#pragma once

#include "crackle/equilibrium/equilibrium.hpp"

namespace crackle {

struct KspOptions {
  int refactor_every = 1;  ///< breaks that a preconditioner made from scratch serves
};

/// Throws InputError when the options ask for what can't be (a rank above 1 under preonly).
[[nodiscard]] std::unique_ptr<Equilibrium> make_equilibrium_ksp(const Network& network,
                                                                const EquilibriumOptions& options,
                                                                PhaseTimes& times,
                                                                const KspOptions& ksp = {});

}  // namespace crackle
