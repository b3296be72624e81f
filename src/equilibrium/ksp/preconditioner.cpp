#include "crackle/equilibrium/ksp/preconditioner.hpp"

#include <string>

#include "crackle/base/error.hpp"
#include "crackle/base/petsc_handle.hpp"

namespace crackle {

using petsc::check;

namespace {

PC pc_of(KSP ksp) {
  PC pc = nullptr;
  check(KSPGetPC(ksp, &pc));
  return pc;
}

}  // namespace

Preconditioner::Preconditioner(KSP ksp, const Network& network, int refactor_every)
    : ksp_(ksp), pc_(pc_of(ksp)), kind_(&kind_of(pc_)), refactor_every_(refactor_every) {
  PetscBool preonly = PETSC_FALSE;
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ksp), KSPPREONLY, &preonly));
  kind_->begin(pc_, network);
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
  if (is_ours()) {
    throw InputError("-equilibrium_refactor_every", given,
                     "1 with this -pc_type, which follows the breaks or needs no change (-pc_updown_rank, "
                     "-pc_woodbury_rank)");
  }
}

double Preconditioner::remove(const RankOne& w) {
  if (!is_ours()) ++age_;
  return kind_->remove(pc_, w);
}

PetscErrorCode Preconditioner::set_up() {
  const bool due = !is_ours() && (stale_ || age_ >= refactor_every_);
  if (!is_ours()) check(PCSetReusePreconditioner(pc_, due ? PETSC_FALSE : PETSC_TRUE));
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
  return kind_->renew(pc_);
}

void Preconditioner::restore() {
  stale_ = true;
  (void)kind_->restore(pc_);
}

PreconditionerCounts Preconditioner::counts() const {
  PreconditionerCounts counts = kind_->counts(pc_);
  counts.factorizations += set_ups_;
  return counts;
}

}  // namespace crackle
