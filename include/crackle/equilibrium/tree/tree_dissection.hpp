/// Cuts a network's graph of unknowns into regions and separators, recursively.
///
/// The plate is not among the vertices, idle unknowns have no neighbours and are in no region. A node's
/// components are vertices of their own: a horizontal spring couples only the x components of its nodes, so a
/// vertical separator of the triangular lattice needs three unknowns every two rows, not four.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/equilibrium/tree/separator_tree.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

/// Which unknowns share a bond, in compressed rows; every row ascending, without the unknown itself.
struct UnknownGraph {
  std::vector<std::int32_t> start;  ///< [unknowns + 1]
  std::vector<Dof> neighbour;
  std::vector<Vector2> position;       ///< [unknowns] of the node
  std::vector<std::uint8_t> on_plate;  ///< [unknowns] 1: a bond joins it to the plate
  double period_x = 0;

  [[nodiscard]] Dof unknowns() const { return static_cast<Dof>(position.size()); }
  [[nodiscard]] std::span<const Dof> neighbours(Dof i) const {
    return {neighbour.data() + start[i], static_cast<std::size_t>(start[i + 1] - start[i])};
  }
};

/// The graph of the bonds that can stretch.
[[nodiscard]] UnknownGraph make_unknown_graph(const Network& network);

/// A node of the dissection: the unknowns it eliminates and the roots of what it separates.
struct Cut {
  std::vector<Dof> separator;          ///< or a whole leaf cluster
  std::vector<std::int32_t> children;  ///< numbers of earlier cuts
};

/// All cuts in postorder, of all unknowns but those in `idle` (ascending). A last one without a separator gathers the roots.
[[nodiscard]] std::vector<Cut> dissect(const UnknownGraph& graph, std::span<const Dof> idle,
                                       Dissection dissection, int leaf_unknowns);

}  // namespace crackle
