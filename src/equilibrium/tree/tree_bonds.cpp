#include "crackle/equilibrium/tree/tree_bonds.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>

namespace crackle {

TreeBonds make_tree_bonds(const Network& network, const SeparatorTree& tree) {
  TreeBonds bonds;
  bonds.width = network.width();
  bonds.owner.assign(network.bonds(), -1);
  bonds.place.assign(network.bonds(), -1);
  bonds.start.assign(static_cast<std::size_t>(tree.fronts()) + 1, 0);
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (!network.can_stretch(e)) continue;
    Position earliest = tree.positions();
    for (int i = 0; i < bonds.width; ++i) {
      if (network.bond_values(e)[i] != 0)
        earliest = std::min(earliest, tree.position[network.bond_dofs(e)[i]]);
    }
    if (earliest < 0 || earliest >= tree.positions()) {
      throw std::logic_error("bond " + std::to_string(e) + " has no unknown in the tree");
    }
    bonds.owner[e] = tree.owner[earliest];
    ++bonds.start[bonds.owner[e] + 1];
    bonds.by_owner.push_back(e);
  }
  for (FrontId f = 0; f < tree.fronts(); ++f) bonds.start[f + 1] += bonds.start[f];
  std::ranges::stable_sort(bonds.by_owner, {}, [&](BondId e) { return bonds.owner[e]; });
  bonds.row.reserve(bonds.by_owner.size() * bonds.width);
  bonds.value.reserve(bonds.by_owner.size() * bonds.width);
  for (const BondId e : bonds.by_owner) {
    bonds.place[e] = static_cast<std::int32_t>(bonds.row.size() / bonds.width);
    for (int i = 0; i < bonds.width; ++i) {
      const double b = network.bond_values(e)[i];
      bonds.row.push_back(b == 0 ? 0 : tree.position[network.bond_dofs(e)[i]]);
      bonds.value.push_back(std::sqrt(network.stiffness[e]) * b);
    }
  }
  return bonds;
}

void find_path(const SeparatorTree& tree, const TreeBonds& bonds, std::span<const BondId> chosen,
               std::vector<std::uint8_t>& on_path, std::vector<FrontId>& path) {
  assert(std::ranges::count(on_path, 0) == tree.fronts());
  path.clear();
  for (const BondId e : chosen) {
    for (FrontId f = bonds.owner[e]; f >= 0 && on_path[f] == 0; f = tree.front[f].parent) {
      on_path[f] = 1;
      path.push_back(f);
    }
  }
  std::ranges::sort(path);
  for (const FrontId f : path) on_path[f] = 0;
}

}  // namespace crackle
