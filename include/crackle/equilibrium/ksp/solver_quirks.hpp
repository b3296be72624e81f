/// What single solvers behind PETSc need to be told, or tell only when asked.
#pragma once

#include <petscksp.h>

#include <string>

namespace crackle {

/// MUMPS looks for null pivots, unless the user said otherwise: without that it answers a singular K with numbers.
/// Nothing for another solver. The operators are set, the options read.
void find_null_pivots(PC pc);

/// What MUMPS says of its last error, and what helps; empty for another solver.
[[nodiscard]] std::string mumps_error(PC pc);

/// hypre answers every later call with an error that it has met once, until it is told to forget.
void forget_hypre_errors();

}  // namespace crackle
