#include "crackle/equilibrium/ksp/pc_shell.hpp"

#include "crackle/network/matrix_rows.hpp"

namespace crackle {

namespace {

PetscObjectState state_of(Mat matrix) {
  PetscObjectState state = 0;
  petsc::check(PetscObjectStateGet(reinterpret_cast<PetscObject>(matrix), &state));
  return state;
}

}  // namespace

bool pc_has_type(PC pc, const char* type) {
  PetscBool same = PETSC_FALSE;
  petsc::check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), type, &same));
  return same == PETSC_TRUE;
}

void MatrixFactor::make(PC pc) {
  const MatrixRows view(pc->pmat);
  if (factor == nullptr) {
    PetscInt block_size = 1;
    petsc::check(MatGetBlockSize(pc->pmat, &block_size));
    factor = std::make_unique<CholmodFactor>(view.rows(), block_size);
  }
  definite = factor->factor(view.rows());
  note_state(pc);
}

void MatrixFactor::note_state(PC pc) {
  state = state_of(pc->pmat);
}

bool MatrixFactor::is_current(PC pc) const {
  return state == state_of(pc->pmat);
}

void MatrixFactor::forget() {
  factor.reset();
  state = -1;
}

}  // namespace crackle
