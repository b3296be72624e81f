#include "crackle/equilibrium/ksp/solver_quirks.hpp"

#include <dlfcn.h>

#include <string_view>

#include "crackle/base/petsc_handle.hpp"

namespace crackle {

using petsc::check;

namespace {

/// True once the PC is Cholesky or LU by MUMPS, whose factor can then be asked.
bool is_mumps(PC pc) {
  MatSolverType type = nullptr;
  PetscBool factors = PETSC_FALSE;
  check(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(pc), &factors, PCCHOLESKY, PCLU, ""));
  if (factors == PETSC_TRUE) check(PCFactorGetMatSolverType(pc, &type));
  return type != nullptr && std::string_view(type) == MATSOLVERMUMPS;
}

}  // namespace

void find_null_pivots(PC pc) {
  constexpr PetscInt kNullPivots = 24;
  PetscBool given = PETSC_FALSE;
  const char* prefix = nullptr;
  if (!is_mumps(pc)) return;
  check(PCGetOptionsPrefix(pc, &prefix));
  check(PetscOptionsHasName(nullptr, prefix, "-mat_mumps_icntl_24", &given));
  if (given == PETSC_TRUE) return;
  Mat factor = nullptr;
  check(PCFactorSetUpMatSolverType(pc));
  check(PCFactorGetMatrix(pc, &factor));
  check(MatMumpsSetIcntl(factor, kNullPivots, 1));
}

void forget_hypre_errors() {
  if (void* const clear = dlsym(RTLD_DEFAULT, "HYPRE_ClearAllErrors"); clear != nullptr) {
    reinterpret_cast<int (*)()>(clear)();
  }
}

std::string mumps_error(PC pc) {
  Mat factor = nullptr;
  PetscInt error = 0;
  PetscInt detail = 0;
  if (!is_mumps(pc)) return {};
  check(PCFactorGetMatrix(pc, &factor));
  check(MatMumpsGetInfog(factor, 1, &error));
  check(MatMumpsGetInfog(factor, 2, &detail));
  std::string remedy = "see the MUMPS users' guide";
  if (error == -9 || error == -8 || error == -15) remedy = "a larger -mat_mumps_icntl_14";
  if (error == -19) remedy = "a larger -mat_mumps_icntl_23 (megabytes)";
  if (error == -13 || error == -7) remedy = "there is not enough memory: fewer processes, or another solver";
  if (error == -10) remedy = "-mat_mumps_icntl_24 1 finds null pivots";
  return ": MUMPS says INFOG(1) = " + std::to_string(error) + ", INFOG(2) = " + std::to_string(detail) +
         "; " + remedy;
}

}  // namespace crackle
