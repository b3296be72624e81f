/// What a type of preconditioner does about a break: one table. A new one is a file pc_NAME.cpp and a row in
/// preconditioner_kind.cpp.
#pragma once

#include <petscksp.h>

#include <cstdint>
#include <limits>

#include "crackle/factor/cholmod_factor.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

struct PreconditionerCounts {
  std::int64_t factorizations = 0;  ///< set-ups from scratch
  std::int64_t null_pivots = 0;     ///< pinned in the last one
  std::int64_t entries = 0;         ///< of the factor; 0 where the solver doesn't tell
  /// The smallest pivot but those over its diagonal entry, in the last one; NaN where the solver doesn't tell.
  double smallest_pivot = std::numeric_limits<double>::quiet_NaN();
};

/// A row. What a type has no need of does nothing.
struct PreconditionerKind {
  PetscErrorCode (*make_known)() = nullptr;  ///< to PCSetType; null: PETSc knows it
  bool (*is)(PC pc) = nullptr;               ///< a PC of this type; null: any
  bool is_ours = true;                       ///< of this library, for one process
  bool follows = false;                      ///< a direct factor that changes with every break
  /// Once, before all that follows. Throws InputError for a network that it can't work with.
  void (*begin)(PC pc, const Network& network) = [](PC, const Network&) {};
  /// Breaks that it may leave to the iteration, plus one.
  int (*rank)(PC pc) = [](PC) { return 1; };
  /// K has changed by - w w^T and is assembled. Returns the slack; 1 where none is known.
  double (*remove)(PC pc, const RankOne& w) = [](PC, const RankOne&) { return 1.0; };
  /// Made anew from K as it is; false: K is singular.
  bool (*renew)(PC pc) = [](PC) { return true; };
  /// K is the intact network's: what restore goes back to.
  void (*keep)(PC pc) = [](PC) {};
  /// K is the intact network's again. False: nothing was kept, the next set-up starts from scratch.
  bool (*restore)(PC pc) = [](PC) { return true; };
  PreconditionerCounts (*counts)(PC pc) = [](PC) { return PreconditionerCounts{}; };
};

/// The row of a PC; of one that is none of ours, PETSc's.
[[nodiscard]] const PreconditionerKind& kind_of(PC pc);

/// Makes `-pc_type updown`, `circulant` and `woodbury` known; once after PetscInitialize.
void register_preconditioners();

}  // namespace crackle
