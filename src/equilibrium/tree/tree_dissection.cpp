#include "crackle/equilibrium/tree/tree_dissection.hpp"

#include <metis.h>

#include <algorithm>
#include <array>
#include <limits>
#include <new>
#include <numeric>
#include <stdexcept>

#include "crackle/base/error.hpp"
#include "crackle/equilibrium/tree/vertex_cover.hpp"

namespace crackle {

namespace {

static_assert(sizeof(idx_t) == sizeof(std::int32_t), "METIS with 32-bit indices");

constexpr std::size_t kMetisPerUnknown = 24;
constexpr std::size_t kMetisPerNeighbour = 8;

/// Where an unknown falls when its region is cut. METIS's numbers.
enum class Side : std::uint8_t { first = 0, second = 1, separator = 2 };

constexpr std::int32_t kOutside = -1;

class Dissector {
 public:
  Dissector(const UnknownGraph& graph, Dissection dissection, int leaf_unknowns)
      : graph_(graph),
        dissection_(dissection),
        leaf_(leaf_unknowns),
        side_(graph.unknowns()),
        local_(graph.unknowns(), kOutside),
        number_(graph.unknowns(), kOutside) {}

  /// Appends the cuts of a region and returns the numbers of its roots.
  std::vector<std::int32_t> cut(std::vector<Dof> region, bool wrapped) {
    if (region.empty()) return {};
    if (region.size() <= static_cast<std::size_t>(leaf_)) return {append(std::move(region), {})};
    wrapped = split(region, wrapped);
    std::array<std::vector<Dof>, 3> part;
    for (const Dof i : region) part[static_cast<std::size_t>(side_[i])].push_back(i);
    if (part[0].empty() || part[1].empty()) return {append(std::move(region), {})};
    region = {};
    std::vector<std::int32_t> roots = cut(std::move(part[0]), wrapped);
    const std::vector<std::int32_t> others = cut(std::move(part[1]), wrapped);
    roots.insert(roots.end(), others.begin(), others.end());
    if (part[2].empty()) return roots;  // the region was in two pieces
    return {append(std::move(part[2]), std::move(roots))};
  }

  std::vector<Cut> take() && { return std::move(cuts_); }
  std::int32_t append(std::vector<Dof> separator, std::vector<std::int32_t> children) {
    cuts_.push_back({std::move(separator), std::move(children)});
    return static_cast<std::int32_t>(cuts_.size()) - 1;
  }

 private:
  /// Fills side_ for the region's unknowns. Returns whether the parts still close on themselves in x.
  bool split(std::span<const Dof> region, bool wrapped) {
    mark(region);
    if (dissection_ == Dissection::coordinates) {
      wrapped = split_by_coordinates(region, wrapped);
    } else {
      split_by_metis(region);
    }
    for (const Dof i : region) local_[i] = kOutside;
    return wrapped;
  }

  /// Across or along: what leaves the smaller separator. A ring is halved, or opened by two cuts.
  bool split_by_coordinates(std::span<const Dof> region, bool wrapped) {
    split_at_median(region, [this](Dof i) { return graph_.position[i].y; });
    const std::size_t across = thin_separator(region);
    halves_.clear();
    for (const Dof i : region) halves_.push_back(side_[i]);
    if (wrapped) {
      open_ring(region);
    } else {
      split_at_median(region, [this](Dof i) { return graph_.position[i].x; });
    }
    if (thin_separator(region) < across && has_two_sides(region)) return false;
    for (std::size_t i = 0; i < region.size(); ++i) side_[region[i]] = halves_[i];
    return wrapped;
  }

  [[nodiscard]] bool has_two_sides(std::span<const Dof> region) const {
    const auto has = [&](Side side) {
      return std::ranges::any_of(region, [&](Dof i) { return side_[i] == side; });
    };
    return has(Side::first) && has(Side::second);
  }

  void open_ring(std::span<const Dof> region) {
    double low = std::numeric_limits<double>::infinity();
    for (const Dof i : region) low = std::min(low, graph_.position[i].x);
    const double middle = low + graph_.period_x / 2;
    for (const Dof i : region) side_[i] = graph_.position[i].x < middle ? Side::first : Side::second;
  }

  template <class Coordinate>
  void split_at_median(std::span<const Dof> region, Coordinate coordinate) {
    value_.clear();
    for (const Dof i : region) value_.push_back(coordinate(i));
    const auto middle = value_.begin() + static_cast<std::ptrdiff_t>(value_.size() / 2);
    std::ranges::nth_element(value_, middle);
    // Unknowns at the median itself (a row of a lattice) go where they leave the halves more equal.
    const double median = *middle;
    const auto below = std::ranges::count_if(value_, [=](double v) { return v < median; });
    const auto up_to = std::ranges::count_if(value_, [=](double v) { return v <= median; });
    const auto size = static_cast<std::ptrdiff_t>(region.size());
    const bool with_median = below == 0 || up_to - size / 2 < size / 2 - below;
    for (const Dof i : region) {
      const double v = coordinate(i);
      side_[i] = v < median || (with_median && v == median) ? Side::first : Side::second;
    }
  }

  /// The fewest unknowns that meet every pair coupled across the cut become the separator. Returns how many.
  std::size_t thin_separator(std::span<const Dof> region) {
    CoupledPairs pairs;
    std::vector<Dof> left;
    std::vector<Dof> right;
    for (const Dof i : region) {
      if (side_[i] != Side::first) continue;
      const std::size_t before = pairs.right.size();
      for (const Dof j : graph_.neighbours(i)) {
        if (local_[j] == kOutside || side_[j] != Side::second) continue;
        if (number_[j] == kOutside) {
          number_[j] = static_cast<std::int32_t>(right.size());
          right.push_back(j);
        }
        pairs.right.push_back(number_[j]);
      }
      if (pairs.right.size() == before) continue;
      left.push_back(i);
      pairs.start.push_back(static_cast<std::int32_t>(pairs.right.size()));
    }
    pairs.rights = static_cast<std::int32_t>(right.size());
    for (const Dof j : right) number_[j] = kOutside;
    const VertexCover cover = least_vertex_cover(pairs);
    for (const std::int32_t i : cover.left) side_[left[i]] = Side::separator;
    for (const std::int32_t j : cover.right) side_[right[j]] = Side::separator;
    return cover.left.size() + cover.right.size();
  }

  void split_by_metis(std::span<const Dof> region) {
    start_.assign(1, 0);
    neighbour_.clear();
    for (const Dof i : region) {
      for (const Dof other : graph_.neighbours(i)) {
        if (local_[other] != kOutside) neighbour_.push_back(local_[other]);
      }
      start_.push_back(static_cast<idx_t>(neighbour_.size()));
    }
    auto size = static_cast<idx_t>(region.size());
    std::vector<idx_t> weight(region.size(), 1);
    std::vector<idx_t> part(region.size());
    std::array<idx_t, METIS_NOPTIONS> options{};
    METIS_SetDefaultOptions(options.data());
    options[METIS_OPTION_SEED] = 1;
    idx_t separator = 0;
    // METIS ends the process when it finds no memory: of about this much
    expect_memory(sizeof(idx_t) *
                  (kMetisPerUnknown * region.size() + kMetisPerNeighbour * neighbour_.size()));
    if (METIS_ComputeVertexSeparator(&size, start_.data(), neighbour_.data(), weight.data(), options.data(),
                                     &separator, part.data()) != METIS_OK) {
      throw std::runtime_error("METIS_ComputeVertexSeparator failed");
    }
    for (std::size_t i = 0; i < region.size(); ++i) side_[region[i]] = static_cast<Side>(part[i]);
  }

  void mark(std::span<const Dof> region) {
    for (std::size_t i = 0; i < region.size(); ++i) local_[region[i]] = static_cast<std::int32_t>(i);
  }

  const UnknownGraph& graph_;
  Dissection dissection_;
  int leaf_;
  std::vector<Cut> cuts_;
  std::vector<Side> side_;            // [unknowns] of the region being cut
  std::vector<std::int32_t> local_;   // [unknowns] number within that region, or kOutside
  std::vector<std::int32_t> number_;  // [unknowns] workspace of thin_separator, kOutside between calls
  std::vector<Side> halves_;
  std::vector<double> value_;
  std::vector<idx_t> start_;
  std::vector<idx_t> neighbour_;
};

}  // namespace

UnknownGraph make_unknown_graph(const Network& network) {
  UnknownGraph graph;
  const Dof unknowns = network.plate;
  graph.period_x = network.lattice.period_x;
  graph.position.resize(unknowns);
  graph.on_plate.assign(unknowns, 0);
  for (NodeId node = 0; node < network.lattice.nodes(); ++node) {
    for (int c = 0; c < network.components; ++c) {
      const Dof dof = network.dof[static_cast<std::size_t>(node) * network.components + c];
      if (dof != Network::kFixed && dof != network.plate)
        graph.position[dof] = network.lattice.position[node];
    }
  }
  std::vector<std::vector<Dof>> touching(unknowns);
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (!network.can_stretch(e)) continue;
    const auto dofs = network.bond_dofs(e);
    const auto values = network.bond_values(e);
    for (std::size_t i = 0; i < dofs.size(); ++i) {
      for (std::size_t j = 0; j < dofs.size(); ++j) {
        if (values[i] == 0 || values[j] == 0 || dofs[i] == dofs[j] || dofs[i] == network.plate) continue;
        if (dofs[j] == network.plate) {
          graph.on_plate[dofs[i]] = 1;
        } else {
          touching[dofs[i]].push_back(dofs[j]);
        }
      }
    }
  }
  graph.start.assign(1, 0);
  for (std::vector<Dof>& row : touching) {
    std::ranges::sort(row);
    const auto repeated = std::ranges::unique(row);
    graph.neighbour.insert(graph.neighbour.end(), row.begin(), repeated.begin());
    graph.start.push_back(static_cast<std::int32_t>(graph.neighbour.size()));
  }
  return graph;
}

std::vector<Cut> dissect(const UnknownGraph& graph, std::span<const Dof> idle, Dissection dissection,
                         int leaf_unknowns) {
  Dissector dissector(graph, dissection, leaf_unknowns);
  std::vector<Dof> all(graph.unknowns());
  std::iota(all.begin(), all.end(), 0);
  std::erase_if(all, [&](Dof i) { return std::ranges::binary_search(idle, i); });
  std::vector<std::int32_t> roots = dissector.cut(std::move(all), graph.period_x > 0);
  dissector.append({}, std::move(roots));
  return std::move(dissector).take();
}

}  // namespace crackle
