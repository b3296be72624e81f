/// The bonds in the terms of a separator tree.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "crackle/equilibrium/tree/separator_tree.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

/// g_e = sqrt(k_e) b_e by positions; a bond's owner is the front that meets it first.
struct TreeBonds {
  int width = 0;
  std::vector<BondId> by_owner;     ///< [stretchable] those that can stretch, by owner, ascending within
  std::vector<std::int32_t> start;  ///< [fronts + 1] where each front's begin in by_owner
  std::vector<std::int32_t> place;  ///< [M] of each bond in by_owner; -1: can't stretch
  std::vector<FrontId> owner;       ///< [M] -1: can't stretch
  std::vector<Position> row;        ///< [stretchable * width] in that order; unused entries: row 0, value 0
  std::vector<double> value;        ///< [stretchable * width] sqrt(k) b

  [[nodiscard]] std::span<const Position> rows(BondId e) const {
    return {row.data() + static_cast<std::size_t>(place[e]) * width, static_cast<std::size_t>(width)};
  }
  [[nodiscard]] std::span<const double> values(BondId e) const {
    return {value.data() + static_cast<std::size_t>(place[e]) * width, static_cast<std::size_t>(width)};
  }
  /// Those that fronts first .. last own, of bonds in the order of their owners: places begin .. end - 1.
  [[nodiscard]] LaneRange owned_by(std::span<const BondId> sorted, FrontId first, FrontId last) const {
    const auto owner_of = [this](BondId e) { return owner[e]; };
    return {static_cast<int>(std::ranges::lower_bound(sorted, first, {}, owner_of) - sorted.begin()),
            static_cast<int>(std::ranges::upper_bound(sorted, last, {}, owner_of) - sorted.begin())};
  }
};

[[nodiscard]] TreeBonds make_tree_bonds(const Network& network, const SeparatorTree& tree);

/// The fronts on the paths from these bonds' owners to the root, ascending, into `path`. `on_path` (size:
/// fronts) must be 0 everywhere and is left so.
void find_path(const SeparatorTree& tree, const TreeBonds& bonds, std::span<const BondId> chosen,
               std::vector<std::uint8_t>& on_path, std::vector<FrontId>& path);

}  // namespace crackle
