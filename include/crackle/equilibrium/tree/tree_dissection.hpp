/// Cuts a network's graph of unknowns into regions and separators, recursively.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/equilibrium/tree/separator_tree.hpp"
#include "crackle/equilibrium/tree/unknown_graph.hpp"

namespace crackle {

/// A separator, or a region that isn't cut any more.
struct Cut {
  std::int32_t unknowns = 0;
  std::int32_t parent = -1;  ///< number of the cut that separates it from its sibling
};

/// The unknowns in the order of elimination: those of the first cut, of the second, ...
struct Elimination {
  std::vector<Dof> order;  ///< all but the idle ones and the plate
  std::vector<Cut> cut;    ///< postorder; the last one has no unknowns and gathers the roots
};

/// `idle` ascends.
[[nodiscard]] Elimination dissect(const UnknownGraph& graph, std::span<const Dof> idle, Dissection dissection,
                                  int leaf_unknowns);

}  // namespace crackle
