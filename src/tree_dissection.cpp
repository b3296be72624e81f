#include "crackle/tree_dissection.hpp"

#include <metis.h>

#include <algorithm>
#include <limits>
#include <new>
#include <numeric>
#include <stdexcept>

namespace crackle {

namespace {

static_assert(sizeof(idx_t) == sizeof(std::int32_t), "METIS with 32-bit indices");

/// Where a block falls when its region is cut. METIS's numbers.
enum class Side : std::uint8_t { first = 0, second = 1, separator = 2 };

constexpr std::int32_t kOutside = -1;

class Dissector {
 public:
  Dissector(const BlockGraph& graph, Dissection dissection, int leaf_blocks)
      : graph_(graph),
        dissection_(dissection),
        leaf_(leaf_blocks),
        side_(graph.blocks()),
        local_(graph.blocks(), kOutside) {}

  /// Appends the cuts of a region and returns the numbers of its roots.
  std::vector<std::int32_t> cut(std::vector<BlockId> region, bool wrapped) {
    if (region.empty()) return {};
    if (region.size() <= static_cast<std::size_t>(leaf_)) return {append(std::move(region), {})};
    wrapped = split(region, wrapped);
    std::array<std::vector<BlockId>, 3> part;
    for (const BlockId b : region) part[static_cast<std::size_t>(side_[b])].push_back(b);
    if (part[0].empty() || part[1].empty()) return {append(std::move(region), {})};
    region = {};
    std::vector<std::int32_t> roots = cut(std::move(part[0]), wrapped);
    const std::vector<std::int32_t> others = cut(std::move(part[1]), wrapped);
    roots.insert(roots.end(), others.begin(), others.end());
    if (part[2].empty()) return roots;  // the region was in two pieces
    return {append(std::move(part[2]), std::move(roots))};
  }

  std::vector<Cut> take() && { return std::move(cuts_); }
  std::int32_t append(std::vector<BlockId> separator, std::vector<std::int32_t> children) {
    cuts_.push_back({std::move(separator), std::move(children)});
    return static_cast<std::int32_t>(cuts_.size()) - 1;
  }

 private:
  /// Fills side_ for the region's blocks. Returns whether the parts still close on themselves in x.
  bool split(std::span<const BlockId> region, bool wrapped) {
    if (dissection_ == Dissection::coordinates) {
      wrapped = split_by_coordinates(region, wrapped);
    } else {
      split_by_metis(region);
    }
    return wrapped;
  }

  bool split_by_coordinates(std::span<const BlockId> region, bool wrapped) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    Vector2 low{kFar, kFar};
    Vector2 high{-kFar, -kFar};
    for (const BlockId b : region) {
      const Vector2 p = graph_.position[b];
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    // A ring is opened by two cuts as long as it is high, halved by one as long as its circumference.
    const bool around = wrapped && 2 * (high.y - low.y) < graph_.period_x;
    if (around) {
      const double middle = low.x + graph_.period_x / 2;
      for (const BlockId b : region) side_[b] = graph_.position[b].x < middle ? Side::first : Side::second;
    } else if (wrapped || high.y - low.y >= high.x - low.x) {
      split_at_median(region, [this](BlockId b) { return graph_.position[b].y; });
    } else {
      split_at_median(region, [this](BlockId b) { return graph_.position[b].x; });
    }
    thin_separator(region);
    return wrapped && !around;
  }

  template <class Coordinate>
  void split_at_median(std::span<const BlockId> region, Coordinate coordinate) {
    value_.clear();
    for (const BlockId b : region) value_.push_back(coordinate(b));
    const auto middle = value_.begin() + static_cast<std::ptrdiff_t>(value_.size() / 2);
    std::ranges::nth_element(value_, middle);
    // Blocks at the median itself (a row of a lattice) go where they leave the halves more equal.
    const double median = *middle;
    const auto below = std::ranges::count_if(value_, [=](double v) { return v < median; });
    const auto up_to = std::ranges::count_if(value_, [=](double v) { return v <= median; });
    const auto size = static_cast<std::ptrdiff_t>(region.size());
    const bool with_median = below == 0 || up_to - size / 2 < size / 2 - below;
    for (const BlockId b : region) {
      const double v = coordinate(b);
      side_[b] = v < median || (with_median && v == median) ? Side::first : Side::second;
    }
  }

  /// Of the two sides' blocks at the cut, the fewer become the separator.
  void thin_separator(std::span<const BlockId> region) {
    mark(region);
    std::array<std::vector<BlockId>, 2> at_cut;
    for (const BlockId b : region) {
      const bool touches = std::ranges::any_of(graph_.neighbours(b), [&](BlockId other) {
        return local_[other] != kOutside && side_[other] != side_[b];
      });
      if (touches) at_cut[static_cast<std::size_t>(side_[b])].push_back(b);
    }
    for (const BlockId b : at_cut[at_cut[1].size() < at_cut[0].size() ? 1 : 0]) side_[b] = Side::separator;
    unmark(region);
  }

  void split_by_metis(std::span<const BlockId> region) {
    mark(region);
    start_.assign(1, 0);
    neighbour_.clear();
    for (const BlockId b : region) {
      for (const BlockId other : graph_.neighbours(b)) {
        if (local_[other] != kOutside) neighbour_.push_back(local_[other]);
      }
      start_.push_back(static_cast<idx_t>(neighbour_.size()));
    }
    unmark(region);
    auto size = static_cast<idx_t>(region.size());
    std::vector<idx_t> weight(region.size(), 1);
    std::vector<idx_t> part(region.size());
    std::array<idx_t, METIS_NOPTIONS> options{};
    METIS_SetDefaultOptions(options.data());
    options[METIS_OPTION_SEED] = 1;
    idx_t separator = 0;
    if (METIS_ComputeVertexSeparator(&size, start_.data(), neighbour_.data(), weight.data(), options.data(),
                                     &separator, part.data()) != METIS_OK) {
      throw std::runtime_error("METIS_ComputeVertexSeparator failed");
    }
    for (std::size_t i = 0; i < region.size(); ++i) side_[region[i]] = static_cast<Side>(part[i]);
  }

  void mark(std::span<const BlockId> region) {
    for (std::size_t i = 0; i < region.size(); ++i) local_[region[i]] = static_cast<std::int32_t>(i);
  }
  void unmark(std::span<const BlockId> region) {
    for (const BlockId b : region) local_[b] = kOutside;
  }

  const BlockGraph& graph_;
  Dissection dissection_;
  int leaf_;
  std::vector<Cut> cuts_;
  std::vector<Side> side_;           // [blocks] of the region being cut
  std::vector<std::int32_t> local_;  // [blocks] number within that region, or kOutside
  std::vector<double> value_;
  std::vector<idx_t> start_;
  std::vector<idx_t> neighbour_;
};

}  // namespace

BlockGraph make_block_graph(const Network& network) {
  BlockGraph graph;
  const int components = network.components;
  const BlockId blocks = network.plate / components;
  graph.period_x = network.lattice.period_x;
  graph.position.resize(blocks);
  graph.on_plate.assign(blocks, 0);
  for (NodeId node = 0; node < network.lattice.nodes(); ++node) {
    for (int c = 0; c < components; ++c) {
      const Dof dof = network.dof[static_cast<std::size_t>(node) * components + c];
      if (dof != Network::kFixed && dof != network.plate)
        graph.position[dof / components] = network.lattice.position[node];
    }
  }
  std::vector<std::vector<BlockId>> touching(blocks);
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (!network.can_stretch(e)) continue;
    const auto dofs = network.bond_dofs(e);
    const auto values = network.bond_values(e);
    for (std::size_t i = 0; i < dofs.size(); ++i) {
      for (std::size_t j = 0; j < dofs.size(); ++j) {
        const BlockId a = dofs[i] / components;
        const BlockId b = dofs[j] / components;
        if (values[i] == 0 || values[j] == 0 || a == b || a == blocks) continue;
        if (b == blocks) {
          graph.on_plate[a] = 1;
        } else {
          touching[a].push_back(b);
        }
      }
    }
  }
  graph.start.assign(1, 0);
  for (std::vector<BlockId>& row : touching) {
    std::ranges::sort(row);
    const auto repeated = std::ranges::unique(row);
    graph.neighbour.insert(graph.neighbour.end(), row.begin(), repeated.begin());
    graph.start.push_back(static_cast<std::int32_t>(graph.neighbour.size()));
  }
  return graph;
}

std::vector<Cut> dissect(const BlockGraph& graph, Dissection dissection, int leaf_blocks) {
  Dissector dissector(graph, dissection, leaf_blocks);
  std::vector<BlockId> all(graph.blocks());
  std::iota(all.begin(), all.end(), 0);
  std::vector<std::int32_t> roots = dissector.cut(std::move(all), graph.period_x > 0);
  dissector.append({}, std::move(roots));
  return std::move(dissector).take();
}

}  // namespace crackle
