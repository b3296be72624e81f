/// What the intact network answers to every bond's pull, and to the plate's.
///
/// G0 = g^T K0^-1 g over the bonds that can stretch, g_e = sqrt(k_e) b_e, K0 the sum of all g g^T: the orthogonal
/// projection onto what displacements can do to stretches.
#pragma once

#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/tree/tree_bonds.hpp"
#include "crackle/equilibrium/tree/tree_factor.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"

namespace crackle {

/// Bonds have numbers here: those that can stretch, ascending. m: their number in whole blocks; n: unknowns, the same;
/// 0 fills up.
struct IntactResponse {
  std::vector<BondId> bond;    ///< [stretchable] by number
  std::vector<double> root;    ///< [stretchable] sqrt(k)
  int size = 0;                ///< m
  int unknowns = 0;            ///< n
  AlignedVector gram;          ///< [stretchable][m] G0, symmetric to the bit
  AlignedVector displacement;  ///< [stretchable][n] K0^-1 g
  AlignedVector stretch;       ///< [m] s0 = g . u at unit plate load
  AlignedVector at_rest;       ///< [n] that u
  double bent = 0;             ///< 1/F
  /// Norm of what a column of G0, or s0, leaves of the balance of forces, g (I - G0) = 0 and g s0 = e_plate, at an unknown
  /// in units of its stiffness's root; or the difference of its square from its own entry, G0^2 = G0. Infinity: no numbers.
  double defect = 0;

  [[nodiscard]] const double* column(int number) const {
    return gram.data() + static_cast<std::size_t>(number) * size;
  }
  [[nodiscard]] const double* motion(int number) const {
    return displacement.data() + static_cast<std::size_t>(number) * unknowns;
  }
};

/// factor: of the intact network.
[[nodiscard]] IntactResponse make_intact_response(const Network& network, const SeparatorTree& tree,
                                                  const TreeBonds& bonds, const TreeFactor& factor,
                                                  const TreeKernels& kernels);

/// `size` in whole blocks.
[[nodiscard]] constexpr int whole_blocks(int size) {
  return (size + kResponseBlock - 1) / kResponseBlock * kResponseBlock;
}

}  // namespace crackle
