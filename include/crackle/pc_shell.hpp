/// What our PETSc preconditioners have in common: callbacks that let no exception through.
#pragma once

#include <petsc/private/pcimpl.h>

#include <exception>
#include <span>

#include "crackle/petsc_handle.hpp"

namespace crackle {

/// Runs what may throw inside a PETSc callback; no exception crosses PETSc.
template <class Work>
PetscErrorCode guarded(PC pc, const char* type, Work work) {
  try {
    work();
    return 0;
  } catch (const std::exception& error) {
    return PetscError(PetscObjectComm(reinterpret_cast<PetscObject>(pc)), __LINE__, type, __FILE__,
                      PETSC_ERR_LIB, PETSC_ERROR_INITIAL, "%s", error.what());
  }
}

/// solve(b, x) on the arrays of two vectors of one size.
template <class Solve>
void with_arrays(Vec b, Vec x, Solve solve) {
  const PetscScalar* load = nullptr;
  PetscScalar* solution = nullptr;
  PetscInt n = 0;
  petsc::check(VecGetLocalSize(b, &n));
  petsc::check(VecGetArrayRead(b, &load));
  petsc::check(VecGetArrayWrite(x, &solution));
  const auto size = static_cast<std::size_t>(n);
  solve(std::span<const double>(load, size), std::span<double>(solution, size));
  petsc::check(VecRestoreArrayWrite(x, &solution));
  petsc::check(VecRestoreArrayRead(b, &load));
}

}  // namespace crackle
