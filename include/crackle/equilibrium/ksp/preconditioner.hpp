/// The preconditioner of a KSP, told of every break: ours follow the matrix, PETSc's are made anew every so many
/// breaks and are used as they are in between.
#pragma once

#include <petscksp.h>

#include <cstdint>

#include "crackle/equilibrium/ksp/preconditioner_kind.hpp"

namespace crackle {

class Preconditioner {
 public:
  /// Of a KSP whose options are set and whose matrix is the intact network's. refactor_every >= 1: breaks after
  /// which one of PETSc's own is made anew. Throws InputError when the type can't work with the network or
  /// with refactor_every.
  Preconditioner(KSP ksp, const Network& network, int refactor_every);

  /// A direct factor of ours that changes with every break.
  [[nodiscard]] bool follows() const { return kind_->follows; }
  /// One of this library's own, for one process.
  [[nodiscard]] bool is_ours() const { return kind_->is_ours; }
  /// Breaks that a factor of ours may leave to the iteration, plus one.
  [[nodiscard]] int rank() const { return kind_->rank(pc_); }

  /// A break: K has changed by - w w^T and is assembled. Returns the slack; 1 where none is known.
  [[nodiscard]] double remove(const RankOne& w);

  /// Before every solve: sets up what is due. PETSc's error code.
  [[nodiscard]] PetscErrorCode set_up();

  /// Made before the last break: the solve leans on what is left of it.
  [[nodiscard]] bool lags() const { return age_ > 0; }
  /// The next set_up makes it anew; false when it is of ours and K is singular.
  [[nodiscard]] bool renew();

  /// See PreconditionerKind.
  void keep() { kind_->keep(pc_); }
  /// K is the intact network's again.
  void restore();

  [[nodiscard]] PreconditionerCounts counts() const;

 private:
  KSP ksp_;
  PC pc_ = nullptr;
  const PreconditionerKind* kind_;
  int refactor_every_;
  int age_ = 0;               ///< breaks since the set-up, of PETSc's own
  bool stale_ = true;         ///< it must be made anew
  std::int64_t set_ups_ = 0;  ///< of PETSc's own
};

}  // namespace crackle
