/// The lattices that can be generated: one table. A new one is a function and a row in lattices.cpp.
///
/// All are L x L, periodic in x, gripped in their bottom and top rows. Bonds are numbered node by node, row by row upwards.
#pragma once

#include <span>

#include "crackle/network/lattice.hpp"

namespace crackle {

struct LatticeKind {
  const char* name;     ///< in `-lattice`
  const char* meaning;  ///< one line
  /// size L >= 1; row_spacing from kLeastRowSpacing to kLargestRowSpacing, in lattice spacings along x.
  Lattice (*make)(int size, double row_spacing);
  const char* floppy;  ///< what springs on it do without resistance: it is for fuses only; null: nothing
};

/// The default first.
[[nodiscard]] std::span<const LatticeKind> lattice_kinds();

/// The paper's triangular lattice: L+1 rows of L+1 nodes, period L+1 in x, odd rows shifted by 1/2,
/// row_spacing apart; the bottom and the top row are gripped.
///
/// One horizontal bond per node in every row and two inclined bonds from each node to the row above:
/// (3L+1)(L+1) bonds; of a node the horizontal one, the one up to the right, the one up to the left.
/// Steps are stated at size 1, where a horizontal bond is half a period long: both of a row lead to the right.
[[nodiscard]] Lattice triangular_lattice(int size, double row_spacing);

}  // namespace crackle
