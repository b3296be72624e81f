/// What our PETSc preconditioners have in common: callbacks that let no exception through, data that live as long as
/// the PC, and for those with a factor, whether it is still that of the matrix.
#pragma once

#include <petsc/private/pcimpl.h>

#include <exception>
#include <memory>
#include <span>

#include "crackle/base/petsc_handle.hpp"
#include "crackle/factor/cholmod_factor.hpp"

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

template <class Data>
Data& pc_data(PC pc) {
  return *static_cast<Data*>(pc->data);
}

template <class Data>
PetscErrorCode pc_destroy(PC pc) {
  delete static_cast<Data*>(pc->data);  // NOLINT(*-owning-memory): PETSc hands it back
  pc->data = nullptr;
  return 0;
}

/// Gives the PC data of its own, and the callbacks that every type of ours has. apply serves its transpose, too.
template <class Data>
void pc_create(PC pc, PetscErrorCode (*set_up)(PC), PetscErrorCode (*apply)(PC, Vec, Vec),
               PetscErrorCode (*view)(PC, PetscViewer)) {
  pc->data = new Data;  // NOLINT(*-owning-memory): PETSc keeps it
  pc->ops->setup = set_up;
  pc->ops->apply = apply;
  pc->ops->applytranspose = apply;
  pc->ops->view = view;
  pc->ops->destroy = pc_destroy<Data>;
}

[[nodiscard]] bool pc_has_type(PC pc, const char* type);

/// A CHOLMOD factor of the PC's matrix, and which of the matrix's states it belongs to.
struct MatrixFactor {
  std::unique_ptr<CholmodFactor> factor;  ///< null: nothing was factored yet
  PetscObjectState state = -1;            ///< of K, when it was last matched
  bool definite = false;                  ///< the factor can be used

  /// Factors K from scratch; its pattern is analysed the first time.
  void make(PC pc);
  /// The factor, with what the PC knows beside it, is that of K's present state.
  void note_state(PC pc);
  [[nodiscard]] bool is_current(PC pc) const;
  /// What PCSetUp has to answer.
  [[nodiscard]] PCFailedReason failure() const { return definite ? PC_NOERROR : PC_FACTOR_NUMERIC_ZEROPIVOT; }
  /// PCReset: K may be another one, or gone.
  void forget();
};

}  // namespace crackle
