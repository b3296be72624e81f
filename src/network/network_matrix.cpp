#include "crackle/network/network_matrix.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace crackle {

using petsc::check;

NetworkMatrix::NetworkMatrix(const Network& network, MPI_Comm comm) : network_(network) {
  list_bonds();
  allocate(comm);
  const std::vector<std::uint8_t> none(network.lattice.bond.size(), 0);
  std::vector<BondId> all;
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (network.can_stretch(e)) all.push_back(e);
  }
  for (const Dof slot : network.idle) {
    if (slot >= first_row_ && slot < end_row_) check(MatSetValue(matrix_, slot, slot, 1.0, INSERT_VALUES));
  }
  update(all, none);
  attach_rigid_motions();
  check(MatSetOption(matrix_, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE));
}

void NetworkMatrix::list_bonds() {
  first_.assign(static_cast<std::size_t>(network_.unknowns) + 1, 0);
  const auto each_end = [this](auto act) {
    for (BondId e = 0; e < network_.bonds(); ++e) {
      if (!network_.can_stretch(e)) continue;
      for (std::size_t i = 0; i < network_.bond_dofs(e).size(); ++i) {
        if (network_.bond_values(e)[i] != 0) act(network_.bond_dofs(e)[i], e);
      }
    }
  };
  each_end([this](Dof dof, BondId) { ++first_[dof + 1]; });
  for (Dof dof = 0; dof < network_.unknowns; ++dof) first_[dof + 1] += first_[dof];
  incident_.resize(static_cast<std::size_t>(first_.back()));
  std::vector<std::int32_t> next(first_.begin(), first_.end() - 1);
  each_end([&](Dof dof, BondId e) { incident_[next[dof]++] = e; });
}

void NetworkMatrix::allocate(MPI_Comm comm) {
  PetscInt n = network_.unknowns;
  PetscInt local = PETSC_DECIDE;
  check(PetscSplitOwnershipBlock(comm, network_.components, &local, &n));
  MPI_Scan(&local, &end_row_, 1, MPIU_INT, MPI_SUM, comm);
  first_row_ = end_row_ - local;
  std::vector<PetscInt> own(static_cast<std::size_t>(local),
                            1);  // entries of a row in this process's columns,
  std::vector<PetscInt> other(static_cast<std::size_t>(local), 0);  // and in the others'
  std::vector<Dof> seen(static_cast<std::size_t>(n), Network::kFixed);
  for (Dof row = first_row_; row < end_row_; ++row) {
    seen[row] = row;
    for (std::int32_t i = first_[row]; i < first_[row + 1]; ++i) {
      const BondId e = incident_[i];
      for (std::size_t j = 0; j < network_.bond_dofs(e).size(); ++j) {
        const Dof column = network_.bond_dofs(e)[j];
        if (network_.bond_values(e)[j] == 0 || seen[column] == row) continue;
        seen[column] = row;
        ++(column >= first_row_ && column < end_row_ ? own : other)[row - first_row_];
      }
    }
  }
  check(MatCreate(comm, matrix_.out()));
  check(MatSetSizes(matrix_, local, local, n, n));
  check(MatSetBlockSize(matrix_, network_.components));
  check(MatSetType(matrix_, MATAIJ));  // SEQAIJ or MPIAIJ; only the call for its kind does something
  check(MatSeqAIJSetPreallocation(matrix_, 0, own.data()));
  check(MatMPIAIJSetPreallocation(matrix_, 0, own.data(), 0, other.data()));
  check(MatSetOption(matrix_, MAT_SYMMETRIC, PETSC_TRUE));
  check(MatSetOption(matrix_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
}

/// Two translations and a rotation, orthonormal; the plate moves with the rows in the first two.
void NetworkMatrix::attach_rigid_motions() {
  const int components = network_.components;
  std::vector<petsc::VecHandle> motions(components == 2 ? 3 : 1);
  std::array<Vec, 3> bare{};
  for (std::size_t m = 0; m < motions.size(); ++m) {
    check(MatCreateVecs(matrix_, motions[m].out(), nullptr));
    double* value = nullptr;
    check(VecGetArray(motions[m], &value));
    const auto is_mine = [this](Dof dof) { return dof >= first_row_ && dof < end_row_; };
    for (std::size_t slot = 0; slot < network_.dof.size(); ++slot) {
      if (!is_mine(network_.dof[slot])) continue;
      const Vector2 p = network_.lattice.position[slot / components];
      const std::size_t c = slot % components;
      value[network_.dof[slot] - first_row_] = m == 2 ? (c == 0 ? -p.y : p.x) : c == m ? 1 : 0;
    }
    if (m == 2 && is_mine(network_.plate)) value[network_.plate - first_row_] = 0;
    check(VecRestoreArray(motions[m], &value));
    for (std::size_t before = 0; before < m; ++before) {
      PetscScalar share = 0;
      check(VecDot(motions[m], motions[before], &share));
      check(VecAXPY(motions[m], -share, motions[before]));
    }
    PetscReal length = 0;
    check(VecNormalize(motions[m], &length));
    if (length == 0) return;  // too few unknowns to move so
    bare[m] = motions[m];
  }
  petsc::NullSpaceHandle space;
  check(MatNullSpaceCreate(PetscObjectComm(reinterpret_cast<PetscObject>(get())), PETSC_FALSE,
                           static_cast<PetscInt>(motions.size()), bare.data(), space.out()));
  check(MatSetNearNullSpace(matrix_, space));
}

double NetworkMatrix::entry(Dof row, Dof column, std::span<const std::uint8_t> broken) const {
  double sum = 0;
  for (std::int32_t i = first_[row]; i < first_[row + 1]; ++i) {
    const BondId e = incident_[i];
    if (broken[e] != 0) continue;
    double at_row = 0;
    double at_column = 0;
    for (std::size_t j = 0; j < network_.bond_dofs(e).size(); ++j) {
      if (network_.bond_values(e)[j] == 0) continue;
      if (network_.bond_dofs(e)[j] == row) at_row = network_.bond_values(e)[j];
      if (network_.bond_dofs(e)[j] == column) at_column = network_.bond_values(e)[j];
    }
    sum += network_.stiffness[e] * (at_row * at_column);
  }
  const bool loose = row == column && row != network_.plate && sum == 0;
  return holds_loose_ && loose ? 1 : sum;
}

void NetworkMatrix::update(std::span<const BondId> bonds, std::span<const std::uint8_t> broken) {
  for (const BondId e : bonds) {
    std::array<PetscInt, kMostBondDofs> dof{};
    std::array<PetscScalar, kMostBondDofs> value{};
    PetscInt size = 0;
    for (std::size_t i = 0; i < network_.bond_dofs(e).size(); ++i) {
      if (network_.bond_values(e)[i] != 0) dof[size++] = network_.bond_dofs(e)[i];
    }
    for (PetscInt i = 0; i < size; ++i) {
      if (dof[i] < first_row_ || dof[i] >= end_row_) continue;
      for (PetscInt j = 0; j < size; ++j) {
        // the shorter list of bonds: the plate has as many as a row of the lattice
        const auto [row, column] = std::minmax(dof[i], dof[j]);
        value[j] = entry(row, column, broken);
      }
      check(MatSetValues(matrix_, 1, &dof[i], size, dof.data(), value.data(), INSERT_VALUES));
    }
  }
  check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
}

RankOne break_change(const Network& network, BondId bond) {
  RankOne w;
  for (std::size_t i = 0; i < network.bond_dofs(bond).size(); ++i) {
    if (network.bond_values(bond)[i] == 0) continue;
    w.row[w.size] = network.bond_dofs(bond)[i];
    w.value[w.size++] = std::sqrt(network.stiffness[bond]) * network.bond_values(bond)[i];
  }
  return w;
}

}  // namespace crackle
