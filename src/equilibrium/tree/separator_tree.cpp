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
  TreeBuilder(const Network& network, const UnknownGraph& graph, const Elimination& elimination)
      : network_(network), graph_(graph), elimination_(elimination) {}

  SeparatorTree build() {
    order_unknowns();
    std::vector<FrontId> marked(tree_.positions(), -1);
    for (FrontId f = 0; f < tree_.fronts(); ++f) {
      find_boundary(f, marked);
      append_block(f);
    }
    for (FrontId f = 0; f + 1 < tree_.fronts(); ++f) find_parent_rows(f);
    return std::move(tree_);
  }

 private:
  /// Cuts are in postorder already: fronts are numbered like them; the plate is the last one's.
  void order_unknowns() {
    tree_.dof = elimination_.order;
    tree_.dof.push_back(network_.plate);
    tree_.position.assign(network_.unknowns, -1);
    for (Position at = 0; at < tree_.positions(); ++at) tree_.position[tree_.dof[at]] = at;
    tree_.front.resize(elimination_.cut.size());
    tree_.owner.reserve(tree_.dof.size());
    for (FrontId f = 0; f < tree_.fronts(); ++f) tree_.front[f].first_descendant = f;
    for (FrontId f = 0; f < tree_.fronts(); ++f) {
      Front& front = tree_.front[f];
      front.first = static_cast<Position>(tree_.owner.size());
      front.pivots = elimination_.cut[f].unknowns + (f + 1 == tree_.fronts() ? 1 : 0);
      front.parent = elimination_.cut[f].parent;
      tree_.owner.insert(tree_.owner.end(), front.pivots, f);
      if (front.parent < 0) continue;
      FrontId& first = tree_.front[front.parent].first_descendant;
      first = std::min(first, front.first_descendant);
    }
  }

  /// Unknowns outside the subtree that it touches: its separator's neighbours and its children's boundaries.
  void find_boundary(FrontId f, std::vector<FrontId>& marked) {
    boundary_.clear();
    if (f + 1 == tree_.fronts()) return;
    const Front& front = tree_.front[f];
    const Position past = front.first + front.pivots;
    const auto add = [&](Position at) {
      if (at < past || marked[at] == f) return;
      marked[at] = f;
      boundary_.push_back(at);
    };
    for (Position own = front.first; own < past; ++own) {
      const Dof i = tree_.dof[own];
      for (const Dof other : graph_.neighbours(i)) add(tree_.position[other]);
      if (graph_.on_plate[i] != 0) add(tree_.positions() - 1);
    }
    for (FrontId child = f - 1; child >= front.first_descendant;
         child = tree_.front[child].first_descendant - 1) {
      for (const Position at : tree_.boundary(child)) add(at);
    }
    std::ranges::sort(boundary_);
  }

  void append_block(FrontId f) {
    Front& front = tree_.front[f];
    front.rows = tree_.row.size();
    tree_.row.insert(tree_.row.end(), boundary_.begin(), boundary_.end());
    front.boundary = static_cast<std::int32_t>(boundary_.size());
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
  const Elimination& elimination_;
  std::vector<Position> boundary_;  // of the front at hand
  SeparatorTree tree_;
};

}  // namespace

SeparatorTree make_separator_tree(const Network& network, Dissection dissection, int leaf_unknowns) {
  const UnknownGraph graph = make_unknown_graph(network);
  const auto build = [&](Dissection how) {
    return TreeBuilder(network, graph, dissect(graph, network.idle, how, leaf_unknowns)).build();
  };
  if (dissection != Dissection::automatic) return build(dissection);
  if (graph.whole) return build(Dissection::coordinates);
  SeparatorTree by_coordinates = build(Dissection::coordinates);
  SeparatorTree by_metis = build(Dissection::metis);
  const double ratio =
      static_cast<double>(by_metis.factor_entries) / static_cast<double>(by_coordinates.factor_entries);
  return ratio < kWorthwhile ? by_metis : by_coordinates;
}

}  // namespace crackle
