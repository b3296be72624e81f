/// A separator tree cut for several threads: subtrees that know nothing of each other, and the fronts above them.
///
/// What a subtree passes up lies in the boundary of its root, and bonds of different subtrees use different lanes of it:
/// so every number is the sum of the same terms in the same order, whoever computes it and wherever the cut is.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "crackle/equilibrium/tree/separator_tree.hpp"

namespace crackle {

/// A subtree: fronts first .. root, positions begin .. end - 1.
struct TreePart {
  FrontId first = 0;
  FrontId root = 0;
  Position begin = 0;
  Position end = 0;
  std::int64_t entries = 0;  ///< of the factor

  [[nodiscard]] Position size() const { return end - begin; }
};

/// A part's share in a path: path[begin .. end - 1].
struct PartOfPath {
  std::int32_t part = 0;
  std::int32_t begin = 0;
  std::int32_t end = 0;
};

struct TreeParts {
  std::vector<TreePart> part;  ///< ascending
  std::vector<FrontId> top;    ///< fronts of no part, ascending; the last of the tree among them
  /// Like SeparatorTree::row, for fronts in parts: positions less the part's begin; of those above the part, its size and
  /// their place in its root's boundary.
  std::vector<Position> local_row;

  [[nodiscard]] bool is_top(FrontId f) const { return std::ranges::binary_search(top, f); }

  /// Cuts a path (ascending): the parts that it meets, those with the longest way first, and what is left at the top.
  void split(std::span<const FrontId> path, std::vector<PartOfPath>& parts, std::vector<FrontId>& rest) const;
};

/// A part has at most that share of the factor: enough parts for more threads than a tree's memory traffic feeds.
inline constexpr int kPartsAtLeast = 32;

/// Only a function of the tree. Children of one front may all be parts, so there may be more than kPartsAtLeast.
[[nodiscard]] TreeParts make_tree_parts(const SeparatorTree& tree);

/// The tree in one piece: no part, all of it at the top.
[[nodiscard]] TreeParts make_whole_tree(const SeparatorTree& tree);

/// Where a position at or above a part is among its local rows.
[[nodiscard]] Position local_position(const SeparatorTree& tree, const TreePart& part, Position position);

}  // namespace crackle
