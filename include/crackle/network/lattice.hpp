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
  /// [M] the way from the first node to the second, where it is stated; empty: it leads to the nearest image.
  std::vector<Vector2> step{};

  [[nodiscard]] NodeId nodes() const { return static_cast<NodeId>(position.size()); }
  [[nodiscard]] BondId bonds() const { return static_cast<BondId>(bond.size()); }
};

/// Squares of a bond's direction are entries of K, and products of two of those occur in its factor: they must be
/// numbers of full precision.
inline constexpr double kLeastRowSpacing = 1e-50;
inline constexpr double kLargestRowSpacing = 1e50;

/// Directions by the steps; without any, by the nearest image in x of the second node (of two equally near ones,
/// that at +period/2: see check_directions).
///
/// Throws InputError, naming the bond or node, for: a node number out of range, a self-bond, a bond of no
/// length or one beyond the range of doubles, a position that is not finite, a period that is negative or not finite,
/// no node in a grip, sizes of position and grip that differ; a wrong number of steps, a step that doesn't lead from
/// the first node to an image of the second, to kStepTolerance of its length (and the rounding of the positions).
[[nodiscard]] Lattice make_lattice(double period_x, std::vector<Vector2> position, std::vector<Grip> grip,
                                   std::vector<std::array<NodeId, 2>> bond, std::vector<Vector2> step = {});

/// By how much a step may differ from its nodes' positions, and by what share of the period the two nearest images
/// of a node must differ in distance: positions in single precision have 1e-7.
inline constexpr double kStepTolerance = 1e-6;

/// What springs need beyond that, and fuses, to which a bond's direction is nothing, don't. Throws InputError, naming
/// the bond, for two images that are equally near and no step that says which one is meant; for a direction with a
/// component below kLeastRowSpacing that isn't 0.
void check_directions(const Lattice& lattice);

}  // namespace crackle
