/// The paper's solver as a PETSc preconditioner, `-pc_type updown`: a CHOLMOD LDL^T factor that follows the
/// matrix by downdates instead of being made anew.
///
/// K is SEQAIJ, symmetric, its block size set, the plate its last row. With `-ksp_type preonly` the
/// preconditioner is the solver. With `-ksp_type cg`, `-pc_updown_rank m` leaves up to m - 1 breaks to the
/// iteration and then takes m of them in one multiple-rank downdate. Source: P. K. V. V. Nukala, S.
/// Simunovic, J. Phys. A 36 (2003) 11403.
#pragma once

#include <petscksp.h>

#include <cstdint>
#include <span>

#include "crackle/factor/cholmod_factor.hpp"

namespace crackle {

struct PcUpdownCounts {
  std::int64_t factorizations = 0;  ///< from scratch
  std::int64_t downdates = 0;       ///< passes over the factor, of any rank
  std::int64_t rank = 0;            ///< bonds taken out by them
  std::int64_t null_pivots = 0;     ///< pinned in the last factorization
  double smallest_pivot = 1;        ///< of the others, over its diagonal entry
  std::int64_t entries = 0;         ///< of the factor
};

/// Makes "updown" known to PCSetType; once after PetscInitialize. Returns PETSc's error code.
[[nodiscard]] PetscErrorCode register_pc_updown();

/// True for a PC of type updown.
[[nodiscard]] bool is_pc_updown(PC pc);

/// The most breaks that the factor waits for: -pc_updown_rank.
[[nodiscard]] int pc_updown_rank(PC pc);

/// K has changed by - w w^T and is assembled: brings the factor there too, or queues w (see pc_updown_rank).
/// Returns the product of the slacks taken into account by this call; 1 when w was queued.
[[nodiscard]] double pc_updown_remove(PC pc, const RankOne& w);

/// Factors K afresh, as it is now; false when it is singular: the plate is loose.
[[nodiscard]] bool pc_updown_refactor(PC pc);

/// Keeps a copy of the factor; K's present values are those that pc_updown_restore goes back to.
void pc_updown_keep(PC pc);

/// K has its kept values again and is assembled: the factor as it was kept. False when none was kept: the
/// next set-up then factors K.
bool pc_updown_restore(PC pc);

[[nodiscard]] PcUpdownCounts pc_updown_counts(PC pc);

}  // namespace crackle
