#include "crackle/equilibrium/ksp/preconditioner.hpp"

#include <string>

#include "crackle/base/error.hpp"
#include "crackle/base/petsc_handle.hpp"
#include "crackle/equilibrium/ksp/pc_circulant.hpp"
#include "crackle/equilibrium/ksp/pc_updown.hpp"
#include "crackle/equilibrium/ksp/pc_woodbury.hpp"

namespace crackle {

using petsc::check;

void register_preconditioners() {
  check(register_pc_updown());
  check(register_pc_circulant());
  check(register_pc_woodbury());
}

Preconditioner::Preconditioner(KSP ksp, const Network& network, int refactor_every)
    : ksp_(ksp), refactor_every_(refactor_every) {
  check(KSPGetPC(ksp, &pc_));
  if (is_pc_updown(pc_)) kind_ = Kind::updown;
  if (is_pc_woodbury(pc_)) kind_ = Kind::woodbury;
  if (is_pc_circulant(pc_)) kind_ = Kind::circulant;
  PetscBool preonly = PETSC_FALSE;
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ksp), KSPPREONLY, &preonly));
  if (kind_ == Kind::circulant) pc_circulant_set_network(pc_, network);
  if (rank() > 1 && preonly == PETSC_TRUE) {
    throw InputError("-pc_updown_rank", std::to_string(rank()),
                     "1 under -ksp_type preonly; -ksp_type cg solves what the factor has not yet");
  }
  if (refactor_every == 1) return;
  const std::string given = std::to_string(refactor_every);
  if (preonly == PETSC_TRUE) {
    throw InputError("-equilibrium_refactor_every", given,
                     "1 under -ksp_type preonly; -ksp_type cg solves with an older preconditioner");
  }
  if (kind_ != Kind::petsc) {
    throw InputError("-equilibrium_refactor_every", given,
                     "1 with this -pc_type, which follows the breaks or needs no change (-pc_updown_rank, "
                     "-pc_woodbury_rank)");
  }
}

int Preconditioner::rank() const {
  return kind_ == Kind::updown ? pc_updown_rank(pc_) : 1;
}

double Preconditioner::remove(const RankOne& w) {
  if (kind_ == Kind::updown) return pc_updown_remove(pc_, w);
  if (kind_ == Kind::woodbury) return pc_woodbury_remove(pc_, w);
  if (kind_ == Kind::petsc) ++age_;
  return 1;
}

PetscErrorCode Preconditioner::set_up() {
  const bool due = kind_ == Kind::petsc && (stale_ || age_ >= refactor_every_);
  if (kind_ == Kind::petsc) check(PCSetReusePreconditioner(pc_, due ? PETSC_FALSE : PETSC_TRUE));
  PetscErrorCode code = KSPSetUp(ksp_);
  if (code == 0) code = PCSetUp(pc_);  // a KSP that is set up doesn't look whether its matrix has changed
  if (due) {
    ++set_ups_;
    age_ = 0;
    stale_ = false;
  }
  return code;
}

bool Preconditioner::renew() {
  stale_ = true;
  if (kind_ == Kind::updown) return pc_updown_refactor(pc_);
  if (kind_ == Kind::woodbury) return pc_woodbury_refactor(pc_);
  return true;
}

void Preconditioner::keep() {
  if (kind_ == Kind::updown) pc_updown_keep(pc_);
  if (kind_ == Kind::woodbury) pc_woodbury_keep(pc_);
}

void Preconditioner::restore() {
  stale_ = true;
  if (kind_ == Kind::updown) pc_updown_restore(pc_);
  if (kind_ == Kind::woodbury) pc_woodbury_restore(pc_);
}

PreconditionerCounts Preconditioner::counts() const {
  if (kind_ == Kind::updown) {
    const PcUpdownCounts counts = pc_updown_counts(pc_);
    return {counts.factorizations, counts.null_pivots, counts.entries, counts.smallest_pivot};
  }
  if (kind_ == Kind::woodbury) {
    const PcWoodburyCounts counts = pc_woodbury_counts(pc_);
    return {counts.factorizations, counts.null_pivots, counts.entries, counts.smallest_pivot};
  }
  return {.factorizations = kind_ == Kind::circulant ? 1 : set_ups_};
}

}  // namespace crackle
