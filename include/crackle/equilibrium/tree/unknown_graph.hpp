/// A network's unknowns as a graph with places in the plane: what is dissected.
///
/// The plate is not among the vertices, idle unknowns have no neighbours. A node's components are vertices of their
/// own: a horizontal spring couples only the x components of its nodes, so a vertical separator of the triangular
/// lattice needs three unknowns every two rows, not four.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/network/network.hpp"

namespace crackle {

/// Where an unknown's node is. In a lattice: its column and row, counted in the smallest steps that bonds make along x
/// and y. Else its rank among all x and among all y; nodes of the same coordinate have the same rank.
struct Place {
  std::int32_t x = 0;
  std::int32_t y = 0;
};

/// Which unknowns share a bond, in compressed rows; every row ascending, without the unknown itself.
struct UnknownGraph {
  std::vector<std::int32_t> start;  ///< [unknowns + 1]
  std::vector<Dof> neighbour;
  std::vector<Place> place;            ///< [unknowns] of the node
  std::vector<std::uint8_t> on_plate;  ///< [unknowns] 1: a bond joins it to the plate
  bool wrapped = false;                ///< periodic in x
  bool lattice = false;      ///< places are columns and rows, bonds lead at most kLongestStep of either
  bool whole = false;        ///< a lattice of which hardly a bond is missing
  std::int32_t columns = 0;  ///< of a wrapped lattice: the period

  [[nodiscard]] Dof unknowns() const { return static_cast<Dof>(place.size()); }
  [[nodiscard]] std::span<const Dof> neighbours(Dof i) const {
    return {neighbour.data() + start[i], static_cast<std::size_t>(start[i + 1] - start[i])};
  }
};

/// Columns, or rows, that a bond of a lattice spans at most: two columns are one spacing of the triangular lattice,
/// whose rows are shifted by one.
inline constexpr std::int32_t kLongestStep = 2;

/// The graph of the bonds that can stretch.
[[nodiscard]] UnknownGraph make_unknown_graph(const Network& network);

}  // namespace crackle
