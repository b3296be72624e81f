/// The intact network as a linear system: which unknown each node has, how each bond acts on them.
///
/// K = sum_e k_e b_e b_e^T over the bonds, n x n, symmetric positive definite when the network is rigid.
/// The plate (the top grip's displacement) is the last unknown; a unit force on it is the whole load:
/// K u = e_plate. Then u[plate] = 1/F, F the stiffness that the plate sees, and k_e b_e . u is the force in
/// bond e at unit plate load.
///
/// Units: stiffness of the paper's intact bond, length of the lattice spacing along x.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "crackle/network/lattice.hpp"

namespace crackle {

using Dof = std::int32_t;

enum class Model : std::uint8_t { spring, fuse };      ///< 2 components per node, or 1
enum class Grips : std::uint8_t { sliding, clamped };  ///< springs: x free, or 0, in the gripped rows

/// Most nonzeros of a b_e: two nodes times two components.
inline constexpr int kMostBondDofs = 4;

struct Network {
  Lattice lattice;
  Model model = Model::spring;
  Grips grips = Grips::sliding;
  std::vector<double> stiffness;  ///< [M] k_e >= 0

  /// Unknowns come in blocks of `components`, one block for each node that has any, in the order of the
  /// nodes, and the plate's block last. A slot that no bond touches (u_y = 0 in a grip, say, or a lone node)
  /// is idle: K has only a 1 on its diagonal there, the load is 0.
  int components = 2;
  Dof unknowns = 0;       ///< n, idle slots included
  Dof plate = 0;          ///< = n - 1
  std::vector<Dof> dof;   ///< [N * components] unknown of a node's component; plate; or kFixed
  std::vector<Dof> idle;  ///< idle slots, ascending

  /// b_e of bond e, padded with value 0 to `width()` entries; see bond_dofs, bond_values. No two of its
  /// entries with a nonzero value have the same unknown.
  std::vector<Dof> bond_dof;       ///< [M * width()]
  std::vector<double> bond_value;  ///< [M * width()]
  BondId stretchable = 0;          ///< bonds with k_e > 0 and b_e != 0: only these are in the system
  double plate_diagonal = 0;       ///< K's last diagonal entry, the most that F can be
  double norm = 0;  ///< bound on |K| (maximum norm): 2 width() times K's largest diagonal entry

  static constexpr Dof kFixed = -1;

  [[nodiscard]] int width() const { return 2 * components; }
  [[nodiscard]] BondId bonds() const { return lattice.bonds(); }
  [[nodiscard]] std::span<const Dof> bond_dofs(BondId e) const {
    return {bond_dof.data() + static_cast<std::size_t>(e) * width(), static_cast<std::size_t>(width())};
  }
  [[nodiscard]] std::span<const double> bond_values(BondId e) const {
    return {bond_value.data() + static_cast<std::size_t>(e) * width(), static_cast<std::size_t>(width())};
  }
  /// False for a bond between two nodes of one grip that can't stretch, or of no stiffness.
  [[nodiscard]] bool can_stretch(BondId e) const {
    return stiffness[e] > 0 && bond_value[static_cast<std::size_t>(e) * width()] != 0;
  }
};

/// Numbers the unknowns. An empty `stiffness` means 1 for every bond.
///
/// Sliding springs: u_y = 0 at the bottom, u_y = plate at the top, and u_x = 0 at the first bottom node,
/// which stops the rigid translation. Clamped springs: u_x = 0 in both grips as well. Fuses: u = 0 and u =
/// plate. Throws InputError for a stiffness that is NaN, infinite or negative, a wrong number of them, and
/// when no path of bonds with stiffness joins the grips.
[[nodiscard]] Network make_network(Lattice lattice, Model model, Grips grips, std::vector<double> stiffness);

/// b_e . u: the elongation of bond e (fuse: the voltage drop from its second node to its first).
[[nodiscard]] inline double elongation(const Network& network, BondId e, std::span<const double> u) {
  double sum = 0;
  const auto dofs = network.bond_dofs(e);
  const auto values = network.bond_values(e);
  for (std::size_t i = 0; i < dofs.size(); ++i) sum += values[i] * u[dofs[i]];
  return sum;
}

/// sum of k_e (b_e . u)^2 over the bonds for which broken[e] == 0 (size M): twice the energy of the displacements u.
[[nodiscard]] double energy(const Network& network, std::span<const std::uint8_t> broken,
                            std::span<const double> u);

/// Stiffness of the stiffest bond that can stretch over that of the softest.
[[nodiscard]] double contrast(const Network& network);

/// Bonds at a node that a message names.
inline constexpr std::size_t kNamedBonds = 6;
/// The first ones, and one more if there is; -1 where there is none.
using BondsAtNode = std::array<BondId, kNamedBonds + 1>;
inline constexpr BondsAtNode kNoBonds = {-1, -1, -1, -1, -1, -1, -1};
/// Only bonds that can stretch.
[[nodiscard]] BondsAtNode bonds_at(const Network& network, NodeId node);
/// "node 7 (bonds 3, 4, 9)"; with more of them than are named "...", with none "node 7".
[[nodiscard]] std::string name_node(NodeId node, const BondsAtNode& bonds);

/// r = e_plate - K u from the bonds alone, skipping those for which broken[e] != 0 (size M), idle slots as
/// in K. Sizes of u and r: n. Independent of any matrix and factor: what trust is measured by.
void residual(const Network& network, std::span<const std::uint8_t> broken, std::span<const double> u,
              std::span<double> r);

/// Normwise backward error of u: max|r| / (1 + network.norm max|u|). Uses `r` (size n) as workspace.
/// Source: N. J. Higham, Accuracy and Stability of Numerical Algorithms, theorem 7.1.
[[nodiscard]] double backward_error(const Network& network, std::span<const std::uint8_t> broken,
                                    std::span<const double> u, std::span<double> r);

}  // namespace crackle
