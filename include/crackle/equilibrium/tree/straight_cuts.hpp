/// Cuts regions of a graph in two along straight lines, each by the thinnest separator that the line leaves.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "crackle/equilibrium/tree/unknown_graph.hpp"
#include "crackle/equilibrium/tree/vertex_cover.hpp"

namespace crackle {

/// Where an unknown falls when its region is cut. METIS's numbers.
enum class Side : std::uint8_t { first = 0, second = 1, separator = 2 };

/// Lines run along x and along y, in a lattice along its two diagonals, too: near the median, in a lattice up to kAside
/// columns and rows aside of it. A region that closes on itself in x is cut across, or opened by two cuts.
///
/// Of all of them that one is taken which lets the factor be smallest, as far as can be foreseen: a separator of s
/// unknowns in a region that touches b outside makes a front of s (s + 1) / 2 + s b entries; a part of n unknowns
/// that touches b will, when cut on in the same way, have about n log2 n + 2 b sqrt(n) and a part linear in n. (Of a
/// cut through n unknowns with c sqrt(n) in the separator both halves inherit half of b and the separator: the
/// coefficients are 5.3 c^2 and 3.4 c. Those of c = 0.5, less than lattices have, fill least: what is foreseen is
/// worth less than what is known. With 0.5 to 3 and 1.5
/// to 2.5 the factor of springs changes by less than 1 %, of the square lattice by 3 %.)
class StraightCuts {
 public:
  /// Regions of up to `leaf_unknowns` will not be cut.
  StraightCuts(const UnknownGraph& graph, int leaf_unknowns);

  /// Writes the side of each unknown of the region; false: no line leaves unknowns on both sides.
  ///
  /// `wrapped`: whether the region, and then its parts, close on themselves. `around`: unknowns outside among which
  /// are all that the region touches, and then all that its parts touch.
  [[nodiscard]] bool cut(std::span<const Dof> region, bool& wrapped, std::vector<Dof>& around,
                         std::span<Side> side);

  /// [unknowns] places as the lines see them: a ring that was opened lies between its two cuts.
  [[nodiscard]] std::span<const Place> places() const { return place_; }

 private:
  /// Of an unknown: x columns + y rows. Up to some number of it they are on the first side.
  struct Line {
    std::int32_t x;
    std::int32_t y;
  };
  struct Span {
    std::int32_t lowest = std::numeric_limits<std::int32_t>::max();
    std::int32_t highest = std::numeric_limits<std::int32_t>::min();

    void include(std::int32_t value);
  };
  struct Separator {
    double entries;  ///< of the factor, foreseen
    Line line;
    std::int32_t last;  ///< value on the first side
    std::vector<Dof> unknown;
  };
  static constexpr std::array<Line, 4> kLines = {{{0, 1}, {1, 0}, {1, 1}, {1, -1}}};

  [[nodiscard]] std::int32_t along(Line line, Dof i) const;
  void try_lines(std::span<const Dof> region, Line line);
  [[nodiscard]] std::int32_t median();
  void find_reach();
  void find_near(std::span<const Dof> region, std::int32_t middle);
  void try_line(std::int32_t last, std::int64_t first, std::int64_t second);
  void find_coupled_pairs(std::int32_t last);
  [[nodiscard]] double entries_of_part(std::int64_t unknowns, std::int64_t touched) const;
  [[nodiscard]] double foresee(const VertexCover& cover, std::int32_t last, std::int64_t before,
                               std::int64_t after) const;
  void write_sides(std::span<const Dof> region, std::span<Side> side);
  void unwrap(std::span<const Dof> region);

  const UnknownGraph& graph_;
  int leaf_;
  std::int32_t aside_;
  std::vector<Place> place_;          // [unknowns] opening a ring moves columns by a period
  std::vector<std::int32_t> region_;  // [unknowns] number of the last region that each was in
  std::int32_t number_of_region_ = 0;
  bool wrapped_ = false;
  Separator best_{};
  Line line_{};                      // that is being tried
  std::vector<std::int32_t> value_;  // [region] along it
  Span values_;
  std::vector<std::int64_t> times_;  // values occur, from the lowest on
  std::vector<std::int32_t> sorted_;
  std::span<const Dof> around_;  // what the region touches
  std::vector<Span> reach_;      // [around_] values of its neighbours in the region
  std::vector<Dof> near_;        // unknowns of the region that a line tried may separate from others
  std::vector<Dof> left_;        // of them, those coupled across the line
  std::vector<Dof> right_;
  std::vector<std::int32_t> number_;  // [unknowns] in right_, or kNone
  CoupledPairs pairs_;
};

}  // namespace crackle
