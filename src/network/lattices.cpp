#include "crackle/network/lattices.hpp"

#include <array>
#include <utility>

namespace crackle {

namespace {

/// L+1 rows of L+1 nodes, the first and the last gripped; odd rows may be shifted by 1/2.
struct Rows {
  NodeId width;
  std::vector<Vector2> position;
  std::vector<Grip> grip;
  std::vector<std::array<NodeId, 2>> bond;
  std::vector<Vector2> step{};

  Rows(int size, double row_spacing, bool shifted, int bonds_per_node) : width(size + 1) {
    position.reserve(static_cast<std::size_t>(width) * width);
    grip.reserve(position.capacity());
    bond.reserve(position.capacity() * bonds_per_node);
    for (NodeId row = 0; row < width; ++row) {
      for (NodeId column = 0; column < width; ++column) {
        position.push_back({column + (shifted ? 0.5 * shift(row) : 0), row * row_spacing});
        grip.push_back(row == 0 ? Grip::bottom : row == size ? Grip::top : Grip::free);
      }
    }
  }

  [[nodiscard]] static NodeId shift(NodeId row) { return row % 2; }
  [[nodiscard]] NodeId node(NodeId row, NodeId column) const { return row * width + column % width; }
  void add_along(NodeId row, NodeId column) { bond.push_back({node(row, column), node(row, column + 1)}); }
  /// Of shifted rows: up to the right, and up to the left.
  void add_inclined(NodeId row, NodeId column) {
    for (const NodeId left : {0, 1}) {
      bond.push_back({node(row, column), node(row + 1, column + shift(row) + left * (width - 1))});
    }
  }
  [[nodiscard]] Lattice finish() {
    return make_lattice(width, std::move(position), std::move(grip), std::move(bond), std::move(step));
  }
};

Lattice diamond_lattice(int size, double row_spacing) {
  Rows rows(size, row_spacing, true, 2);
  for (NodeId row = 0; row < size; ++row) {
    for (NodeId column = 0; column < rows.width; ++column) rows.add_inclined(row, column);
  }
  return rows.finish();
}

Lattice square_lattice(int size, double row_spacing) {
  Rows rows(size, row_spacing, false, 2);
  for (NodeId row = 0; row < rows.width; ++row) {
    for (NodeId column = 0; column < rows.width; ++column) {
      rows.add_along(row, column);
      if (row < size) rows.bond.push_back({rows.node(row, column), rows.node(row + 1, column)});
    }
  }
  return rows.finish();
}

constexpr std::array kLattices = {
    LatticeKind{"triangular",
                "the paper's: L+1 rows of L+1 nodes, odd rows shifted by 1/2, (3L+1)(L+1) bonds",
                triangular_lattice, nullptr},
    LatticeKind{"diamond",
                "as triangular without its horizontal bonds: the square lattice on edge, 2L(L+1) bonds",
                diamond_lattice, "rows of nodes slide along x, and every rhombus folds"},
    LatticeKind{"square", "L+1 rows of L+1 nodes, bonds along x and straight up, (2L+1)(L+1) bonds",
                square_lattice, "rows of nodes slide along x"},
};

}  // namespace

std::span<const LatticeKind> lattice_kinds() {
  return kLattices;
}

Lattice triangular_lattice(int size, double row_spacing) {
  Rows rows(size, row_spacing, true, 3);
  for (NodeId row = 0; row < rows.width; ++row) {
    for (NodeId column = 0; column < rows.width; ++column) {
      rows.add_along(row, column);
      if (size == 1) rows.step.push_back({1, 0});
      if (row == size) continue;
      if (size == 1) rows.step.insert(rows.step.end(), {{0.5, row_spacing}, {-0.5, row_spacing}});
      rows.add_inclined(row, column);
    }
  }
  return rows.finish();
}

}  // namespace crackle
