/// Geometry of a network: where the nodes are, which of them the grips hold, which bonds join them.
///
/// Lengths are in lattice spacings along x. The network is periodic in x when period_x > 0.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace crackle {

using NodeId = std::int32_t;
using BondId = std::int32_t;

struct Vector2 {
  double x = 0;
  double y = 0;
};

/// Which grip holds a node. The numbers are those of the network file.
enum class Grip : std::int8_t { free = 0, bottom = 1, top = 2 };

struct Lattice {
  double period_x = 0;                      ///< 0: not periodic
  std::vector<Vector2> position;            ///< [N]
  std::vector<Grip> grip;                   ///< [N]
  std::vector<std::array<NodeId, 2>> bond;  ///< [M] first and second node
  std::vector<Vector2> direction;           ///< [M] unit vector from the first node to the second

  [[nodiscard]] NodeId nodes() const { return static_cast<NodeId>(position.size()); }
  [[nodiscard]] BondId bonds() const { return static_cast<BondId>(bond.size()); }
};

/// The paper's triangular lattice: L+1 rows of L+1 nodes, period L+1 in x, odd rows shifted by 1/2,
/// row_spacing apart; the bottom and the top row are gripped.
///
/// One horizontal bond per node in every row and two inclined bonds from each node to the row above:
/// (3L+1)(L+1) bonds. They are numbered node by node, row by row upwards: the horizontal bond, the one up
/// to the right, the one up to the left.
/// size >= 1, row_spacing > 0.
[[nodiscard]] Lattice triangular_lattice(int size, double row_spacing);

/// Directions by the nearest image in x of the second node (of two equally near ones, that at +period/2).
///
/// Throws InputError, naming the bond or node, for: a node number out of range, a self-bond, a bond of no
/// length, a position that is not finite, a period that is negative or not finite, no node in a grip,
/// sizes of position and grip that differ.
[[nodiscard]] Lattice make_lattice(double period_x, std::vector<Vector2> position, std::vector<Grip> grip,
                                   std::vector<std::array<NodeId, 2>> bond);

}  // namespace crackle
