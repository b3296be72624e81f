/// Regions of one shape are cut alike: how those that have been cut before were ordered.
///
/// A region's shape is what decides how StraightCuts cuts it and its parts: the places of its unknowns relative to its
/// first one, who shares a bond with whom, and whom each unknown outside touches. A lattice has thousands of regions of a few
/// hundred unknowns and a few dozen shapes of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "crackle/equilibrium/tree/tree_dissection.hpp"
#include "crackle/equilibrium/tree/unknown_graph.hpp"

namespace crackle {

/// The cuts of a region, by numbers within it.
struct CutPattern {
  std::vector<std::int32_t> order;  ///< [region] which of its unknowns, as they ascend, is eliminated when
  std::vector<Cut> cut;             ///< parents by numbers from the first one; -1: a root
};

class CutPatterns {
 public:
  using Shape = std::vector<std::int32_t>;

  /// `place` [unknowns]: as StraightCuts sees them.
  CutPatterns(const UnknownGraph& graph, std::span<const Place> place);

  /// The region's unknowns ascend; `around` as for StraightCuts.
  [[nodiscard]] Shape shape_of(std::span<const Dof> region, std::span<const Dof> around);
  /// Null: none is known.
  [[nodiscard]] const CutPattern* find(const Shape& shape) const;
  void keep(Shape shape, CutPattern pattern);

 private:
  struct Hash {
    std::size_t operator()(const Shape& shape) const;
  };

  void add_row(Dof i, std::int32_t after, Shape& shape) const;

  const UnknownGraph& graph_;
  std::span<const Place> place_;
  std::vector<std::int32_t> local_;  // [unknowns] number within the region being described, or kOutside
  std::vector<Dof> touching_;        // unknowns outside, ascending
  std::unordered_map<Shape, CutPattern, Hash> pattern_;
};

}  // namespace crackle
