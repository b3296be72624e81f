/// The network as a PETSc matrix that follows the breaks.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/base/petsc_handle.hpp"
#include "crackle/factor/cholmod_factor.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

/// K (SEQAIJ, n x n, block size: components; MPIAIJ where several processes share it by rows), entry by entry the sum over the unbroken bonds in ascending
/// order. An entry that a break touches is summed afresh, never subtracted from: K is at any time, bit for
/// bit, what an assembly from scratch would give, however much stiffer the broken bond was than the rest.
///
/// Its near-nullspace is the rigid motions (a fuse network: the constant), which multigrid asks for.
class NetworkMatrix {
 public:
  explicit NetworkMatrix(const Network& network, MPI_Comm comm = PETSC_COMM_SELF);

  /// Sums all entries that these bonds touch, skipping bonds with broken[e] != 0 (size M), and assembles.
  /// Collective, with the same bonds in every process.
  void update(std::span<const BondId> bonds, std::span<const std::uint8_t> broken);

  /// From now on an unknown other than the plate that no bond is left to hold gets a 1 on its diagonal, like an idle slot: no force changes,
  /// and smoothers that divide by the diagonal can. Not for factors that follow the breaks: K - w w^T has a 0 there.
  void hold_loose() { holds_loose_ = true; }

  [[nodiscard]] Mat get() const { return matrix_; }

 private:
  [[nodiscard]] double entry(Dof row, Dof column, std::span<const std::uint8_t> broken) const;
  void list_bonds();
  void attach_rigid_motions();
  void allocate(MPI_Comm comm);

  const Network& network_;
  bool holds_loose_ = false;
  petsc::MatHandle matrix_;
  PetscInt first_row_ = 0, end_row_ = 0;  ///< of this process
  std::vector<std::int32_t> first_;       ///< [n+1] where the bonds of each unknown start in incident_
  std::vector<BondId> incident_;          ///< ascending for each unknown
};

/// w of the change K - w w^T that a bond's break makes.
[[nodiscard]] RankOne break_change(const Network& network, BondId bond);

}  // namespace crackle
