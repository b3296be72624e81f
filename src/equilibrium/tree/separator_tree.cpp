#include "crackle/equilibrium/tree/separator_tree.hpp"

#include <algorithm>

#include "crackle/equilibrium/tree/tree_dissection.hpp"

namespace crackle {

namespace {

constexpr std::int32_t kRowPadding = 8;  // doubles in a cache line: every column starts on one
constexpr std::int32_t kAliasing = 64;   // columns a multiple of this apart would share few sets of the cache

// Straight cuts give the better-shaped fronts: METIS's must save this much.
constexpr double kWorthwhile = 0.97;

class TreeBuilder {
 public:
  TreeBuilder(const Network& network, const UnknownGraph& graph, std::vector<Cut> cuts)
      : network_(network), graph_(graph), cuts_(std::move(cuts)), boundary_(cuts_.size()) {}

  SeparatorTree build() {
    order_unknowns();
    std::vector<FrontId> marked(tree_.positions(), -1);
    for (FrontId f = 0; f < tree_.fronts(); ++f) {
      find_boundary(f, marked);
      append_block(f);
      for (const std::int32_t child : cuts_[f].children) boundary_[child] = {};
    }
    for (FrontId f = 0; f + 1 < tree_.fronts(); ++f) find_parent_rows(f);
    return std::move(tree_);
  }

 private:
  /// Cuts are in postorder already: unknowns follow it, the plate is last.
  void order_unknowns() {
    cuts_.back().separator.push_back(network_.plate);
    tree_.front.resize(cuts_.size());
    tree_.position.assign(network_.unknowns, -1);
    for (FrontId f = 0; f < tree_.fronts(); ++f) {
      Front& front = tree_.front[f];
      front.first = tree_.positions();
      front.pivots = static_cast<std::int32_t>(cuts_[f].separator.size());
      front.first_descendant = f;
      for (const Dof i : cuts_[f].separator) {
        tree_.position[i] = tree_.positions();
        tree_.dof.push_back(i);
        tree_.owner.push_back(f);
      }
      for (const std::int32_t child : cuts_[f].children) {
        tree_.front[child].parent = f;
        front.first_descendant = std::min(front.first_descendant, tree_.front[child].first_descendant);
      }
    }
  }

  /// Unknowns outside the subtree that it touches: its separator's neighbours and its children's boundaries.
  void find_boundary(FrontId f, std::vector<FrontId>& marked) {
    if (f + 1 == tree_.fronts()) return;
    const Position past = tree_.front[f].first + tree_.front[f].pivots;
    std::vector<Position>& found = boundary_[f];
    const auto add = [&](Position at) {
      if (at < past || marked[at] == f) return;
      marked[at] = f;
      found.push_back(at);
    };
    for (const Dof i : cuts_[f].separator) {
      for (const Dof other : graph_.neighbours(i)) add(tree_.position[other]);
      if (graph_.on_plate[i] != 0) add(tree_.positions() - 1);
    }
    for (const std::int32_t child : cuts_[f].children) {
      for (const Position at : boundary_[child]) add(at);
    }
    std::ranges::sort(found);
  }

  void append_block(FrontId f) {
    Front& front = tree_.front[f];
    front.rows = tree_.row.size();
    tree_.row.insert(tree_.row.end(), boundary_[f].begin(), boundary_[f].end());
    front.boundary = static_cast<std::int32_t>(boundary_[f].size());
    const std::int32_t height = front.pivots + front.boundary;
    front.stride = (height + kRowPadding - 1) / kRowPadding * kRowPadding;
    if (front.stride % kAliasing == 0) front.stride += kRowPadding;
    front.block = tree_.block_entries;
    tree_.block_entries += static_cast<std::size_t>(front.stride) * front.pivots;
    tree_.factor_entries += front.entries();
  }

  void find_parent_rows(FrontId f) {
    const Front& parent = tree_.front[tree_.front[f].parent];
    const auto rows = tree_.boundary(tree_.front[f].parent);
    for (const Position at : tree_.boundary(f)) {
      const auto among = std::ranges::lower_bound(rows, at) - rows.begin();
      tree_.parent_row.push_back(at < parent.first + parent.pivots
                                     ? at - parent.first
                                     : parent.pivots + static_cast<std::int32_t>(among));
    }
  }

  const Network& network_;
  const UnknownGraph& graph_;
  std::vector<Cut> cuts_;
  std::vector<std::vector<Position>> boundary_;  // [fronts] emptied once the parent has it
  SeparatorTree tree_;
};

}  // namespace

SeparatorTree make_separator_tree(const Network& network, Dissection dissection, int leaf_unknowns) {
  const UnknownGraph graph = make_unknown_graph(network);
  const auto build = [&](Dissection how) {
    return TreeBuilder(network, graph, dissect(graph, network.idle, how, leaf_unknowns)).build();
  };
  if (dissection != Dissection::automatic) return build(dissection);
  SeparatorTree by_coordinates = build(Dissection::coordinates);
  SeparatorTree by_metis = build(Dissection::metis);
  const double ratio =
      static_cast<double>(by_metis.factor_entries) / static_cast<double>(by_coordinates.factor_entries);
  return ratio < kWorthwhile ? by_metis : by_coordinates;
}

}  // namespace crackle
