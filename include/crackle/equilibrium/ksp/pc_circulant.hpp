/// `-pc_type circulant`: the exact inverse of the intact periodic lattice (see PeriodicInverse), for CG.
///
/// It is made once and never changes, whatever breaks: set-up and memory cost next to nothing, iterations grow
/// with the damage.
#pragma once

#include <petscksp.h>

#include "crackle/network/network.hpp"

namespace crackle {

/// Makes "circulant" known to PCSetType; once after PetscInitialize. Returns PETSc's error code.
[[nodiscard]] PetscErrorCode register_pc_circulant();

/// True for a PC of type circulant.
[[nodiscard]] bool is_pc_circulant(PC pc);

/// The network whose intact lattice it inverts, which must outlive it. Throws InputError for one that is not a
/// generated triangular lattice.
void pc_circulant_set_network(PC pc, const Network& network);

}  // namespace crackle
