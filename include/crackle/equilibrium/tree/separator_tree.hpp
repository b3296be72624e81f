/// Nested dissection of a network: in which order its unknowns are eliminated, and which blocks that fills.
///
/// A front owns a separator (or a leaf cluster): p pivots, eliminated together, and q boundary
/// unknowns that belong to its ancestors. Fronts are in postorder: children before parents, a subtree
/// contiguous. The last front owns the plate alone. Unknowns are renumbered by position of elimination, idle
/// ones left out. Sources: A. George, SIAM J. Numer. Anal. 10 (1973) 345; G. Karypis & V. Kumar, SIAM J. Sci.
/// Comput. 20 (1998) 359.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/network/network.hpp"

namespace crackle {

using FrontId = std::int32_t;
using Position = std::int32_t;  ///< place of an unknown in the order of elimination

struct Front {
  Position first = 0;            ///< its pivots are first .. first + pivots - 1
  std::int32_t pivots = 0;       ///< p
  std::int32_t boundary = 0;     ///< q
  FrontId parent = -1;           ///< -1: the plate's
  FrontId first_descendant = 0;  ///< its subtree is first_descendant .. itself
  std::int32_t stride = 0;       ///< of its block's columns: p + q or more, a multiple of 8
  std::size_t rows = 0;          ///< where its boundary starts in SeparatorTree::row
  std::size_t block = 0;         ///< where its stride x p block starts among the factor's entries

  /// Of L: what an exact fit would hold, the diagonal included.
  [[nodiscard]] std::int64_t entries() const {
    return static_cast<std::int64_t>(pivots) * (pivots + 1) / 2 +
           static_cast<std::int64_t>(pivots) * boundary;
  }
};

struct SeparatorTree {
  std::vector<Front> front;   ///< postorder
  std::vector<Position> row;  ///< boundaries of all fronts, each ascending
  std::vector<std::int32_t>
      parent_row;                   ///< same size: that unknown's row in the parent's block, 0 .. p + q - 1
  std::vector<Position> position;   ///< [n] of each unknown; -1: idle
  std::vector<Dof> dof;             ///< [positions] the inverse
  std::vector<FrontId> owner;       ///< [positions] the front that it is a pivot of
  std::size_t block_entries = 0;    ///< doubles that hold all blocks, padding included
  std::int64_t factor_entries = 0;  ///< p (p + 1) / 2 + p q, summed: what an exact fit would need

  [[nodiscard]] FrontId fronts() const { return static_cast<FrontId>(front.size()); }
  [[nodiscard]] Position positions() const { return static_cast<Position>(dof.size()); }
  [[nodiscard]] std::span<const Position> boundary(FrontId f) const {
    return {row.data() + front[f].rows, static_cast<std::size_t>(front[f].boundary)};
  }
};

/// How a region is cut in two.
enum class Dissection : std::uint8_t {
  automatic,    ///< a whole lattice: by coordinates; else the other two, and of them the one that fills less
  coordinates,  ///< along straight lines near the median, see StraightCuts
  metis,        ///< METIS_ComputeVertexSeparator: any graph
};

/// Unknowns in a region that is not cut any more. Small: more levels; large: more fill.
inline constexpr int kLeafUnknowns = 16;

[[nodiscard]] SeparatorTree make_separator_tree(const Network& network, Dissection dissection,
                                                int leaf_unknowns = kLeafUnknowns);

}  // namespace crackle
