/// `-pc_type woodbury`: a factor of the intact matrix K_0 and the capacitance matrix of the broken bonds.
///
///   (K_0 - W W^T)^-1 = K_0^-1 + K_0^-1 W C^-1 W^T K_0^-1,   C = I - W^T K_0^-1 W
///
/// The factor never changes; a break adds a row to C for one solve, an application costs two solves and
/// m^2 operations for m broken bonds. After -pc_woodbury_rank breaks K is factored anew. K is SEQAIJ, symmetric,
/// its block size set, the plate its last row.
#pragma once

#include <petscksp.h>

#include <cstdint>

#include "crackle/factor/cholmod_factor.hpp"

namespace crackle {

struct PcWoodburyCounts {
  std::int64_t factorizations = 0;  ///< from scratch
  std::int64_t null_pivots = 0;     ///< pinned in the last one
  double smallest_pivot = 1;        ///< of the others, over its diagonal entry
  std::int64_t entries = 0;         ///< of the factor
  std::int64_t rank = 0;            ///< bonds in the capacitance matrix now
};

/// Makes "woodbury" known to PCSetType; once after PetscInitialize. Returns PETSc's error code.
[[nodiscard]] PetscErrorCode register_pc_woodbury();

/// True for a PC of type woodbury.
[[nodiscard]] bool is_pc_woodbury(PC pc);

/// K has changed by - w w^T and is assembled. Returns the slack; at or below 0 it must be factored anew.
[[nodiscard]] double pc_woodbury_remove(PC pc, const RankOne& w);

/// Factors K afresh, as it is now, and forgets the capacitance matrix; false when K is singular.
[[nodiscard]] bool pc_woodbury_refactor(PC pc);

/// K's present values are those that pc_woodbury_restore goes back to; the factor is that of them.
void pc_woodbury_keep(PC pc);

/// K has its kept values again and is assembled. False when nothing was kept: the next set-up factors K.
bool pc_woodbury_restore(PC pc);

[[nodiscard]] PcWoodburyCounts pc_woodbury_counts(PC pc);

}  // namespace crackle
