/// The arrays of a PETSc matrix, as CholmodFactor takes them.
#pragma once

#include <stdexcept>

#include "crackle/base/petsc_handle.hpp"
#include "crackle/factor/cholmod_factor.hpp"

namespace crackle {

/// Borrows the rows of a SEQAIJ matrix for as long as it lives; the matrix must not change meanwhile.
/// Throws std::runtime_error for a matrix of another type.
class MatrixRows {
 public:
  explicit MatrixRows(Mat K) : K_(K) {
    PetscBool done = PETSC_FALSE;
    petsc::check(MatGetRowIJ(K, 0, PETSC_FALSE, PETSC_FALSE, &n_, &start_, &column_, &done));
    if (done == PETSC_FALSE) throw std::runtime_error("-pc_type updown needs a matrix of type seqaij");
    petsc::check(MatSeqAIJGetArrayRead(K, &value_));
  }
  ~MatrixRows() {
    PetscBool done = PETSC_FALSE;
    MatSeqAIJRestoreArrayRead(K_, &value_);
    MatRestoreRowIJ(K_, 0, PETSC_FALSE, PETSC_FALSE, &n_, &start_, &column_, &done);
  }
  MatrixRows(const MatrixRows&) = delete;
  MatrixRows& operator=(const MatrixRows&) = delete;

  [[nodiscard]] SymmetricRows rows() const { return {n_, start_, column_, value_}; }

 private:
  Mat K_;
  PetscInt n_ = 0;
  const PetscInt* start_ = nullptr;
  const PetscInt* column_ = nullptr;
  const PetscScalar* value_ = nullptr;
};

}  // namespace crackle
