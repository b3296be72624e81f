#include "crackle/failure_solve.hpp"

#include <petscksp.h>

namespace crackle {

using petsc::check;

bool PinnedSolver::solve(Mat K, Vec load, Vec u) {
  if (ksp_ == nullptr) {
    PC pc = nullptr;
    check(KSPCreate(PETSC_COMM_SELF, ksp_.out()));
    check(KSPSetType(ksp_, KSPPREONLY));
    check(KSPGetPC(ksp_, &pc));
    check(PCSetType(pc, "updown"));
  }
  check(KSPSetOperators(ksp_, K, K));
  check(KSPSolve(ksp_, load, u));
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(ksp_, &reason));
  return reason >= 0;
}

void solve_on_spring(Mat K, Dof plate, double spring, Vec load, Vec u) {
  constexpr PetscInt kFindNullPivots = 24;
  MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(K));
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  petsc::MatHandle held;
  check(MatDuplicate(K, MAT_COPY_VALUES, held.out()));
  check(MatSetValue(held, plate, plate, rank == 0 ? spring : 0, ADD_VALUES));
  check(MatAssemblyBegin(held, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(held, MAT_FINAL_ASSEMBLY));
  petsc::KspHandle ksp;
  PC pc = nullptr;
  Mat factor = nullptr;
  check(KSPCreate(comm, ksp.out()));
  check(KSPSetOperators(ksp, held, held));
  check(KSPSetType(ksp, KSPPREONLY));
  check(KSPGetPC(ksp, &pc));
  check(PCSetType(pc, PCCHOLESKY));
  check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  check(PCFactorSetUpMatSolverType(pc));
  check(PCFactorGetMatrix(pc, &factor));
  check(MatMumpsSetIcntl(factor, kFindNullPivots, 1));
  check(KSPSolve(ksp, load, u));
}

}  // namespace crackle
