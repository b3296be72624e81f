/// Cuts a network's node graph into regions and separators, recursively.
///
/// The graph's vertices are the blocks of `components` unknowns that a network numbers together; the plate's
/// block is not among them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/network.hpp"
#include "crackle/separator_tree.hpp"

namespace crackle {

using BlockId = std::int32_t;

/// Which blocks share a bond, in compressed rows; every row ascending, without the block itself.
struct BlockGraph {
  std::vector<std::int32_t> start;  ///< [blocks + 1]
  std::vector<BlockId> neighbour;
  std::vector<Vector2> position;       ///< [blocks] of the block's node
  std::vector<std::uint8_t> on_plate;  ///< [blocks] 1: a bond joins it to the plate
  double period_x = 0;

  [[nodiscard]] BlockId blocks() const { return static_cast<BlockId>(position.size()); }
  [[nodiscard]] std::span<const BlockId> neighbours(BlockId b) const {
    return {neighbour.data() + start[b], static_cast<std::size_t>(start[b + 1] - start[b])};
  }
};

/// The graph of the bonds that can stretch.
[[nodiscard]] BlockGraph make_block_graph(const Network& network);

/// A node of the dissection: the blocks it eliminates and the roots of what it separates.
struct Cut {
  std::vector<BlockId> separator;      ///< or a whole leaf cluster
  std::vector<std::int32_t> children;  ///< numbers of earlier cuts
};

/// All cuts in postorder. A last one without a separator gathers the roots.
[[nodiscard]] std::vector<Cut> dissect(const BlockGraph& graph, Dissection dissection, int leaf_blocks);

}  // namespace crackle
