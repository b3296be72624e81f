#include "crackle/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "crackle/error.hpp"

namespace crackle {

namespace {

/// The shortest vector between two nodes, over the images of the second one.
Vector2 nearest_image(Vector2 from, Vector2 to, double period_x) {
  double dx = to.x - from.x;
  if (period_x > 0) {
    dx -= period_x * std::round(dx / period_x);
    if (dx == -period_x / 2) dx = period_x / 2;
  }
  return {dx, to.y - from.y};
}

void check_nodes(const Lattice& lattice) {
  if (!(lattice.period_x >= 0) || std::isinf(lattice.period_x)) {
    throw InputError("period_x", std::to_string(lattice.period_x), "0 (not periodic) or a positive length");
  }
  if (lattice.position.size() != lattice.grip.size()) {
    throw InputError("number of grip marks", std::to_string(lattice.grip.size()),
                     "one for each of the " + std::to_string(lattice.position.size()) + " nodes");
  }
  for (NodeId node = 0; node < lattice.nodes(); ++node) {
    const Vector2 p = lattice.position[node];
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
      throw InputError("position of node " + std::to_string(node), "", "two finite numbers");
    }
    const int mark = static_cast<int>(lattice.grip[node]);
    if (mark < 0 || mark > 2) {
      throw InputError("grip of node " + std::to_string(node), std::to_string(mark),
                       "0 (free), 1 (bottom) or 2 (top)");
    }
  }
  for (const auto& [mark, name] : {std::pair{Grip::bottom, "bottom (1)"}, std::pair{Grip::top, "top (2)"}}) {
    if (std::ranges::find(lattice.grip, mark) == lattice.grip.end()) {
      throw InputError("grip", "", std::string("at least one node marked ") + name);
    }
  }
}

}  // namespace

Lattice make_lattice(double period_x, std::vector<Vector2> position, std::vector<Grip> grip,
                     std::vector<std::array<NodeId, 2>> bond) {
  Lattice lattice{period_x, std::move(position), std::move(grip), std::move(bond), {}};
  check_nodes(lattice);
  lattice.direction.reserve(lattice.bond.size());
  for (BondId e = 0; e < lattice.bonds(); ++e) {
    const std::string name = "bond " + std::to_string(e);
    for (const NodeId node : lattice.bond[e]) {
      if (node < 0 || node >= lattice.nodes()) {
        throw InputError("node " + std::to_string(node) + " of " + name, "",
                         "0 to " + std::to_string(lattice.nodes() - 1));
      }
    }
    const auto [a, b] = lattice.bond[e];
    if (a == b) throw InputError(name, "", "a bond between two different nodes");
    const Vector2 d = nearest_image(lattice.position[a], lattice.position[b], period_x);
    const double length = std::hypot(d.x, d.y);
    if (!(length > 0) || std::isinf(length)) throw InputError("length of " + name, "", "a positive number");
    lattice.direction.push_back({d.x / length, d.y / length});
  }
  return lattice;
}

Lattice triangular_lattice(int size, double row_spacing) {
  const NodeId width = size + 1;
  std::vector<Vector2> position;
  std::vector<Grip> grip;
  std::vector<std::array<NodeId, 2>> bond;
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
      if (row == size) continue;
      const NodeId above = (row + 1) * width;
      bond.push_back({node, above + (column + shift) % width});
      bond.push_back({node, above + (column + shift + width - 1) % width});
    }
  }
  return make_lattice(width, std::move(position), std::move(grip), std::move(bond));
}

}  // namespace crackle
