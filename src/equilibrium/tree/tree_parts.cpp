#include "crackle/equilibrium/tree/tree_parts.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace crackle {

namespace {

/// Of every front's subtree.
std::vector<std::int64_t> entries_below(const SeparatorTree& tree) {
  std::vector<std::int64_t> entries(tree.fronts(), 0);
  for (FrontId f = 0; f < tree.fronts(); ++f) {
    entries[f] += tree.front[f].entries();
    if (tree.front[f].parent >= 0) entries[tree.front[f].parent] += entries[f];
  }
  return entries;
}

}  // namespace

Position local_position(const SeparatorTree& tree, const TreePart& part, Position position) {
  if (position < part.end) return position - part.begin;
  const auto boundary = tree.boundary(part.root);
  const auto found = std::ranges::lower_bound(boundary, position);
  assert(found != boundary.end() && *found == position);
  return part.size() + static_cast<Position>(found - boundary.begin());
}

TreeParts make_tree_parts(const SeparatorTree& tree) {
  const std::vector<std::int64_t> entries = entries_below(tree);
  const std::int64_t most = entries.back() / kPartsAtLeast;
  TreeParts parts;
  parts.local_row.resize(tree.row.size());
  for (FrontId f = tree.fronts() - 1; f >= 0;) {
    const Front& root = tree.front[f];
    if (entries[f] > most || f + 1 == tree.fronts()) {
      parts.top.push_back(f--);
      continue;
    }
    const TreePart part{root.first_descendant, f, tree.front[root.first_descendant].first,
                        root.first + root.pivots, entries[f]};
    for (std::size_t i = tree.front[part.first].rows; i < root.rows + root.boundary; ++i)
      parts.local_row[i] = local_position(tree, part, tree.row[i]);
    parts.part.push_back(part);
    f = part.first - 1;
  }
  std::ranges::reverse(parts.top);
  std::ranges::reverse(parts.part);
  return parts;
}

TreeParts make_whole_tree(const SeparatorTree& tree) {
  TreeParts parts;
  parts.top.resize(tree.fronts());
  std::iota(parts.top.begin(), parts.top.end(), FrontId{0});
  return parts;
}

void TreeParts::split(std::span<const FrontId> path, std::vector<PartOfPath>& parts,
                      std::vector<FrontId>& rest) const {
  parts.clear();
  rest.clear();
  std::size_t p = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    while (p < part.size() && part[p].root < path[i]) ++p;
    if (p == part.size() || path[i] < part[p].first) {
      rest.push_back(path[i]);
      continue;
    }
    const auto at = static_cast<std::int32_t>(i);
    const auto here = static_cast<std::int32_t>(p);
    if (parts.empty() || parts.back().part != here) parts.push_back({here, at, at});
    parts.back().end = at + 1;
  }
  std::ranges::sort(parts, std::greater{}, [](const PartOfPath& each) { return each.end - each.begin; });
}

}  // namespace crackle
