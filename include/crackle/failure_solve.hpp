/// Two solves that a singular K doesn't stop: what an iteration that gave up has met, the end of the network or its own.
#pragma once

#include <petscmat.h>

#include "crackle/network.hpp"
#include "crackle/petsc_handle.hpp"

namespace crackle {

/// K (SEQAIJ) by a CHOLMOD factor with its null pivots pinned.
class PinnedSolver {
 public:
  /// K u = load. False: even so K is singular, nothing holds the plate.
  [[nodiscard]] bool solve(Mat K, Vec load, Vec u);

 private:
  petsc::KspHandle ksp_;  // made at the first call
};

/// K u = load with a spring under the plate, so that K is never singular for want of one: 1/u[plate] - spring is F.
/// Any AIJ, by MUMPS with null pivots found; collective.
void solve_on_spring(Mat K, Dof plate, double spring, Vec load, Vec u);

}  // namespace crackle
