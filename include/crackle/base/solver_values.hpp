/// Numbers for PETSc's solvers that PETSc takes without a word, and that are none.
#pragma once

namespace crackle {

/// Throws InputError for an option of a solver, whatever its prefix, whose value is nan, infinite or beyond the range of
/// doubles; for a -ksp_rtol, -ksp_atol, -ksp_divtol or -ksp_max_it that no iteration can end by (PETSc's word for its
/// default among them, which it then takes for -2).
void check_solver_values();

}  // namespace crackle
