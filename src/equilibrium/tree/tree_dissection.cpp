#include "crackle/equilibrium/tree/tree_dissection.hpp"

#include <metis.h>

#include <algorithm>
#include <array>
#include <new>
#include <stdexcept>

#include "crackle/base/error.hpp"
#include "crackle/equilibrium/tree/cut_patterns.hpp"
#include "crackle/equilibrium/tree/straight_cuts.hpp"

namespace crackle {

namespace {

static_assert(sizeof(idx_t) == sizeof(std::int32_t), "METIS with 32-bit indices");

constexpr std::size_t kMetisPerUnknown = 24;
constexpr std::size_t kMetisPerNeighbour = 8;

/// Unknowns in the regions that are compared with earlier ones. Larger ones are hardly ever alike.
constexpr std::size_t kMostRepeated = 4096;

constexpr std::int32_t kOutside = -1;

/// The sides of regions by METIS_ComputeVertexSeparator.
class MetisCuts {
 public:
  explicit MetisCuts(const UnknownGraph& graph) : graph_(graph), local_(graph.unknowns(), kOutside) {}

  void cut(std::span<const Dof> region, std::span<Side> side) {
    find_rows(region);
    auto size = static_cast<idx_t>(region.size());
    weight_.assign(region.size(), 1);
    part_.resize(region.size());
    std::array<idx_t, METIS_NOPTIONS> options{};
    METIS_SetDefaultOptions(options.data());
    options[METIS_OPTION_SEED] = 1;
    idx_t separator = 0;
    // METIS ends the process when it finds no memory: of about this much
    expect_memory(sizeof(idx_t) *
                  (kMetisPerUnknown * region.size() + kMetisPerNeighbour * neighbour_.size()));
    if (METIS_ComputeVertexSeparator(&size, start_.data(), neighbour_.data(), weight_.data(), options.data(),
                                     &separator, part_.data()) != METIS_OK) {
      throw std::runtime_error("METIS_ComputeVertexSeparator failed");
    }
    std::ranges::transform(part_, side.begin(), [](idx_t part) { return static_cast<Side>(part); });
  }

 private:
  /// The region's own graph.
  void find_rows(std::span<const Dof> region) {
    for (std::size_t i = 0; i < region.size(); ++i) local_[region[i]] = static_cast<std::int32_t>(i);
    start_.assign(1, 0);
    neighbour_.clear();
    for (const Dof i : region) {
      for (const Dof other : graph_.neighbours(i)) {
        if (local_[other] != kOutside) neighbour_.push_back(local_[other]);
      }
      start_.push_back(static_cast<idx_t>(neighbour_.size()));
    }
    for (const Dof i : region) local_[i] = kOutside;
  }

  const UnknownGraph& graph_;
  std::vector<std::int32_t> local_;  // [unknowns] number within the region being cut, or kOutside
  std::vector<idx_t> start_;
  std::vector<idx_t> neighbour_;
  std::vector<idx_t> weight_;
  std::vector<idx_t> part_;
};

class Dissector {
 public:
  Dissector(const UnknownGraph& graph, Dissection dissection, int leaf_unknowns)
      : dissection_(dissection),
        leaf_(leaf_unknowns),
        straight_(graph, leaf_unknowns),
        patterns_(graph, straight_.places()),
        most_repeated_(graph.lattice && dissection == Dissection::coordinates ? kMostRepeated : 0),
        metis_(graph) {}

  Elimination run(std::vector<Dof> unknowns, bool wrapped) {
    order_ = std::move(unknowns);
    side_.resize(order_.size());
    waiting_.resize(order_.size());
    dissect(order_, wrapped, {});
    append(0, 0);
    return {std::move(order_), std::move(cuts_)};
  }

 private:
  /// Orders a region, whose unknowns ascend; appends its cuts, and the last of them to roots_. `around`: see StraightCuts.
  void dissect(std::span<Dof> region, bool wrapped, std::vector<Dof> around) {
    if (region.empty()) return;
    if (region.size() <= leaf_) return append(region.size(), roots_.size());
    if (wrapped || region.size() > most_repeated_) return cut(region, wrapped, std::move(around));
    CutPatterns::Shape shape = patterns_.shape_of(region, around);
    if (const CutPattern* known = patterns_.find(shape)) return repeat(region, *known);
    const std::vector<Dof> before(region.begin(), region.end());
    const auto first = static_cast<std::int32_t>(cuts_.size());
    cut(region, wrapped, std::move(around));
    CutPattern pattern;
    for (const Dof i : region) {
      pattern.order.push_back(
          static_cast<std::int32_t>(std::ranges::lower_bound(before, i) - before.begin()));
    }
    for (Cut c : std::span(cuts_).subspan(first)) {
      if (c.parent >= 0) c.parent -= first;
      pattern.cut.push_back(c);
    }
    patterns_.keep(std::move(shape), std::move(pattern));
  }

  void repeat(std::span<Dof> region, const CutPattern& pattern) {
    std::ranges::copy(region, waiting_.begin());
    for (std::size_t k = 0; k < region.size(); ++k) region[k] = waiting_[pattern.order[k]];
    const auto first = static_cast<std::int32_t>(cuts_.size());
    for (Cut c : pattern.cut) {
      if (c.parent >= 0) {
        c.parent += first;
      } else {
        roots_.push_back(static_cast<std::int32_t>(cuts_.size()));
      }
      cuts_.push_back(c);
    }
  }

  /// First its first side, then its second side, then its separator.
  void cut(std::span<Dof> region, bool wrapped, std::vector<Dof> around) {
    const std::size_t roots = roots_.size();
    std::array<std::size_t, 3> size{};
    if (!split(region, wrapped, around, size)) return append(region.size(), roots);
    dissect(region.first(size[0]), wrapped, around);
    dissect(region.subspan(size[0], size[1]), wrapped, std::move(around));
    if (size[2] > 0) append(size[2], roots);  // else the region was in two pieces
  }

  /// False, and nothing is moved, unless there are two sides.
  bool split(std::span<Dof> region, bool& wrapped, std::vector<Dof>& around,
             std::array<std::size_t, 3>& size) {
    const std::span<Side> side = std::span(side_).first(region.size());
    if (dissection_ == Dissection::coordinates) {
      if (!straight_.cut(region, wrapped, around, side)) return false;
    } else {
      metis_.cut(region, side);
    }
    for (const Side s : side) ++size[static_cast<std::size_t>(s)];
    if (size[0] == 0 || size[1] == 0) return false;
    std::ranges::copy(region, waiting_.begin());
    std::array<std::size_t, 3> next = {0, size[0], size[0] + size[1]};
    for (std::size_t i = 0; i < region.size(); ++i) {
      region[next[static_cast<std::size_t>(side[i])]++] = waiting_[i];
    }
    return true;
  }

  /// A cut whose children are the roots from number `first` on.
  void append(std::size_t unknowns, std::size_t first) {
    const auto number = static_cast<std::int32_t>(cuts_.size());
    for (std::size_t i = first; i < roots_.size(); ++i) cuts_[roots_[i]].parent = number;
    roots_.resize(first);
    roots_.push_back(number);
    cuts_.push_back({static_cast<std::int32_t>(unknowns), -1});
  }

  Dissection dissection_;
  std::size_t leaf_;
  StraightCuts straight_;
  CutPatterns patterns_;
  std::size_t most_repeated_;
  MetisCuts metis_;
  std::vector<Dof> order_;
  std::vector<Side> side_;    // of the region being cut
  std::vector<Dof> waiting_;  // its unknowns, while they are moved
  std::vector<Cut> cuts_;
  std::vector<std::int32_t> roots_;  // cuts that have no parent yet
};

}  // namespace

Elimination dissect(const UnknownGraph& graph, std::span<const Dof> idle, Dissection dissection,
                    int leaf_unknowns) {
  std::vector<Dof> all;
  all.reserve(graph.unknowns());
  auto next_idle = idle.begin();
  for (Dof i = 0; i < graph.unknowns(); ++i) {
    if (next_idle != idle.end() && *next_idle == i) {
      ++next_idle;
    } else {
      all.push_back(i);
    }
  }
  return Dissector(graph, dissection, leaf_unknowns).run(std::move(all), graph.wrapped);
}

}  // namespace crackle
