#include "crackle/separator_tree.hpp"

#include <algorithm>

#include "crackle/tree_dissection.hpp"

namespace crackle {

namespace {

constexpr std::int32_t kRowPadding = 8;  // doubles in a cache line: every column starts on one
constexpr std::int32_t kAliasing = 64;   // columns a multiple of this apart would share few sets of the cache

// Straight cuts give the better-shaped fronts: METIS's must save this much.
constexpr double kWorthwhile = 0.97;

/// Symbolic structure by blocks, then spelt out by unknowns.
class TreeBuilder {
 public:
  TreeBuilder(const Network& network, const BlockGraph& graph, std::vector<Cut> cuts)
      : network_(network),
        graph_(graph),
        cuts_(std::move(cuts)),
        block_position_(graph.blocks() + 1),
        boundary_(cuts_.size()) {}

  SeparatorTree build() {
    order_blocks();
    order_unknowns();
    std::vector<BlockId> marked(graph_.blocks() + 1, -1);
    for (FrontId f = 0; f < tree_.fronts(); ++f) {
      find_boundary(f, marked);
      append_rows(f);
      for (const std::int32_t child : cuts_[f].children) boundary_[child] = {};
    }
    for (FrontId f = 0; f + 1 < tree_.fronts(); ++f) find_parent_rows(f);
    return std::move(tree_);
  }

 private:
  /// Cuts are in postorder already: blocks follow it, the plate's block is last.
  void order_blocks() {
    tree_.front.resize(cuts_.size());
    std::int32_t next = 0;
    for (FrontId f = 0; f < tree_.fronts(); ++f) {
      first_block_.push_back(next);
      for (const BlockId b : cuts_[f].separator) {
        block_position_[b] = next++;
        block_at_.push_back(b);
      }
      tree_.front[f].first_descendant = f;
      for (const std::int32_t child : cuts_[f].children) {
        tree_.front[child].parent = f;
        tree_.front[f].first_descendant =
            std::min(tree_.front[f].first_descendant, tree_.front[child].first_descendant);
      }
    }
    block_position_[graph_.blocks()] = next;
    block_at_.push_back(graph_.blocks());
  }

  void order_unknowns() {
    const int components = network_.components;
    std::vector<std::uint8_t> idle(network_.unknowns, 0);
    for (const Dof slot : network_.idle) idle[slot] = 1;
    tree_.position.assign(network_.unknowns, -1);
    for (FrontId f = 0; f < tree_.fronts(); ++f) {
      Front& front = tree_.front[f];
      front.first = tree_.positions();
      const bool plate = f + 1 == tree_.fronts();
      const std::int32_t last = plate ? first_block_[f] + 1 : first_block_[f + 1];
      for (std::int32_t i = first_block_[f]; i < last; ++i) {
        for (Dof slot = block_at_[i] * components; slot < (block_at_[i] + 1) * components; ++slot) {
          if (idle[slot] != 0) continue;
          tree_.position[slot] = tree_.positions();
          tree_.dof.push_back(slot);
          tree_.owner.push_back(f);
        }
      }
      front.pivots = tree_.positions() - front.first;
    }
  }

  /// Blocks outside the subtree that it touches: its separator's neighbours and its children's boundaries.
  void find_boundary(FrontId f, std::vector<BlockId>& marked) {
    const std::int32_t past = first_block_[f] + static_cast<std::int32_t>(cuts_[f].separator.size());
    std::vector<std::int32_t>& found = boundary_[f];
    const auto add = [&](std::int32_t at) {
      if (at < past || marked[at] == f) return;
      marked[at] = f;
      found.push_back(at);
    };
    for (const BlockId b : cuts_[f].separator) {
      for (const BlockId other : graph_.neighbours(b)) add(block_position_[other]);
      if (graph_.on_plate[b] != 0) add(block_position_[graph_.blocks()]);
    }
    for (const std::int32_t child : cuts_[f].children) {
      for (const std::int32_t at : boundary_[child]) add(at);
    }
    if (f + 1 == tree_.fronts()) found.clear();
    std::ranges::sort(found);
  }

  void append_rows(FrontId f) {
    Front& front = tree_.front[f];
    front.rows = tree_.row.size();
    for (const std::int32_t at : boundary_[f]) {
      for (Dof slot = block_at_[at] * network_.components; slot < (block_at_[at] + 1) * network_.components;
           ++slot) {
        if (tree_.position[slot] >= 0) tree_.row.push_back(tree_.position[slot]);
      }
    }
    front.boundary = static_cast<std::int32_t>(tree_.row.size() - front.rows);
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
  const BlockGraph& graph_;
  std::vector<Cut> cuts_;
  std::vector<std::int32_t> block_position_;  // [blocks + 1] order of elimination; the plate's block last
  std::vector<BlockId> block_at_;             // its inverse
  std::vector<std::int32_t> first_block_;     // [fronts]
  std::vector<std::vector<std::int32_t>>
      boundary_;  // [fronts] in block positions; emptied once the parent has it
  SeparatorTree tree_;
};

}  // namespace

SeparatorTree make_separator_tree(const Network& network, Dissection dissection, int leaf_nodes) {
  const BlockGraph graph = make_block_graph(network);
  const auto build = [&](Dissection how) {
    return TreeBuilder(network, graph, dissect(graph, how, leaf_nodes)).build();
  };
  if (dissection != Dissection::automatic) return build(dissection);
  SeparatorTree by_coordinates = build(Dissection::coordinates);
  SeparatorTree by_metis = build(Dissection::metis);
  const double ratio =
      static_cast<double>(by_metis.factor_entries) / static_cast<double>(by_coordinates.factor_entries);
  return ratio < kWorthwhile ? by_metis : by_coordinates;
}

}  // namespace crackle
