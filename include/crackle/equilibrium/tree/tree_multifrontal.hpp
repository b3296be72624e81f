/// L D L^T of a network on its separator tree, from scratch.
///
/// Each front gathers its own bonds and what its children leave, eliminates its pivots, and leaves the rest,
/// a dense q x q matrix, on a stack for its parent. Sources: I. Duff & J. Reid, ACM Trans. Math. Softw. 9
/// (1983) 302; J. Liu, SIAM Review 34 (1992) 82.
#pragma once

#include <cstdint>
#include <span>

#include "crackle/equilibrium/tree/separator_tree.hpp"
#include "crackle/equilibrium/tree/tree_bonds.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"

namespace crackle {

/// The factor as the fronts hold it; see SeparatorTree and FrontBlock for the shape of the blocks.
struct FactorStorage {
  std::span<double> entries;   ///< [block_entries] all blocks
  std::span<double> diagonal;  ///< [positions] D; 0: pinned
  std::span<double> inverse;   ///< [positions] 1/D; 0: pinned
};

/// A front of those entries.
[[nodiscard]] inline FrontBlock block_of(const SeparatorTree& tree, FrontId f, const double* entries) {
  const Front& front = tree.front[f];
  return {entries + front.block,
          tree.row.data() + front.rows,
          front.stride,
          front.pivots,
          front.boundary,
          nullptr,
          nullptr};
}

struct TreePivots {
  int null = 0;         ///< pinned; the last pivot, the plate's, is never one
  double smallest = 1;  ///< of the others, over their diagonal entries
};

/// Leaves out the bonds for which broken[e] != 0 (size M; empty: none is broken).
TreePivots factorize_tree(const SeparatorTree& tree, const TreeBonds& bonds,
                          std::span<const std::uint8_t> broken, const FactorStorage& factor);

}  // namespace crackle
