#include "crackle/network/lattices.hpp"

#include <array>
#include <utility>

namespace crackle {

namespace {

Lattice diamond_lattice(int size, double row_spacing) {
  const NodeId width = size + 1;
  std::vector<Vector2> position;
  std::vector<Grip> grip;
  std::vector<std::array<NodeId, 2>> bond;
  for (NodeId row = 0; row < width; ++row) {
    const NodeId shift = row % 2;
    for (NodeId column = 0; column < width; ++column) {
      position.push_back({column + 0.5 * shift, row * row_spacing});
      grip.push_back(row == 0 ? Grip::bottom : row == size ? Grip::top : Grip::free);
      if (row == size) continue;
      const NodeId node = row * width + column;
      const NodeId above = (row + 1) * width;
      bond.push_back({node, above + (column + shift) % width});
      bond.push_back({node, above + (column + shift + width - 1) % width});
    }
  }
  return make_lattice(width, std::move(position), std::move(grip), std::move(bond));
}

Lattice square_lattice(int size, double row_spacing) {
  const NodeId width = size + 1;
  std::vector<Vector2> position;
  std::vector<Grip> grip;
  std::vector<std::array<NodeId, 2>> bond;
  for (NodeId row = 0; row < width; ++row) {
    for (NodeId column = 0; column < width; ++column) {
      const NodeId node = row * width + column;
      position.push_back({static_cast<double>(column), row * row_spacing});
      grip.push_back(row == 0 ? Grip::bottom : row == size ? Grip::top : Grip::free);
      bond.push_back({node, row * width + (column + 1) % width});
      if (row < size) bond.push_back({node, node + width});
    }
  }
  return make_lattice(width, std::move(position), std::move(grip), std::move(bond));
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
  const NodeId width = size + 1;
  std::vector<Vector2> position;
  std::vector<Grip> grip;
  std::vector<std::array<NodeId, 2>> bond;
  std::vector<Vector2> step;
  position.reserve(static_cast<std::size_t>(width) * width);
  grip.reserve(position.capacity());
  bond.reserve(static_cast<std::size_t>(3 * size + 1) * width);
  for (NodeId row = 0; row < width; ++row) {
    const NodeId shift = row % 2;
    for (NodeId column = 0; column < width; ++column) {
      const NodeId node = row * width + column;
      position.push_back({column + 0.5 * shift, row * row_spacing});
      grip.push_back(row == 0 ? Grip::bottom : row == size ? Grip::top : Grip::free);
      bond.push_back({node, row * width + (column + 1) % width});
      if (size == 1) step.push_back({1, 0});
      if (row == size) continue;
      if (size == 1) step.insert(step.end(), {{0.5, row_spacing}, {-0.5, row_spacing}});
      const NodeId above = (row + 1) * width;
      bond.push_back({node, above + (column + shift) % width});
      bond.push_back({node, above + (column + shift + width - 1) % width});
    }
  }
  return make_lattice(width, std::move(position), std::move(grip), std::move(bond), std::move(step));
}

}  // namespace crackle
