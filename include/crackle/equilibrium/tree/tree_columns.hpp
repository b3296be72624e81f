/// The columns Y = L^-1 g_e of a chosen set of bonds, and their Gram matrix G = Y^T D^-1 Y = g^T K^-1 g.
///
/// While bonds of the set break, G alone tells exactly how the forces in the set follow. A column is zero off
/// the path from its bond to the root: kLanes columns make a panel that keeps the union of their paths only.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/tree/separator_tree.hpp"
#include "crackle/equilibrium/tree/tree_factor.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"

namespace crackle {

class TreeColumns {
 public:
  static constexpr int kMost = 25 * kLanes;  ///< columns there is room for; at most 32 panels

  /// All arguments must outlive this; scratch: see TreeFactor. Its threads share the work.
  TreeColumns(const SeparatorTree& tree, const TreeBonds& bonds, const TreeFactor& factor,
              const TreeKernels& kernels, TreeScratch& scratch);

  /// Forgets all columns; to be called whenever the factor changes.
  void clear();

  /// Adds columns of bonds not in the set yet, as many as there is room for: from the front of `chosen`, in
  /// whole panels but for the last, which is filled up with nothing. Returns how many.
  int add(std::span<const BondId> chosen);

  /// Fronts that forward passes visited, and entries of the factor that they read, since the start.
  [[nodiscard]] std::int64_t fronts_visited() const { return fronts_visited_; }
  [[nodiscard]] std::int64_t entries_read() const { return entries_read_; }

  /// Columns, those that fill up panels included.
  [[nodiscard]] int size() const { return static_cast<int>(bond_.size()); }
  [[nodiscard]] BondId bond(int i) const { return bond_[i]; }  ///< -1: fills up a panel
  /// The column of a bond; -1: it has none.
  [[nodiscard]] int find(BondId e) const { return column_of_[e]; }
  /// g_i^T K^-1 g_j; row i.
  [[nodiscard]] const double* gram(int i) const { return gram_.data() + static_cast<std::size_t>(i) * kMost; }
  /// g_i . u at unit plate load: exact for the factor's present state.
  [[nodiscard]] double stretch(int i) const;

  /// Right-hand side of a backward pass with all lanes: D^-1 L^-1 (e_plate + sum_i g_i coefficient[i][lane]),
  /// where i runs over `columns`. Writes x (positions x kLanes) on the fronts that these columns reach and on
  /// the plate's, listed in `fronts` (ascending); it is zero elsewhere.
  void combine(std::span<const int> columns, const double* coefficient, double* x,
               std::vector<FrontId>& fronts);
  /// The same of one lane: x, [positions].
  void combine_one(std::span<const int> columns, const double* coefficient, std::span<double> x) const;
  /// The same without e_plate, in single precision; rows of x are `lanes` apart.
  void combine_single(std::span<const int> columns, const double* coefficient, float* x, int lanes,
                      std::vector<FrontId>& fronts);

 private:
  /// A front on a panel's path.
  struct Place {
    std::int32_t offset = -1;  // first row of its pivots in Panel::rows; -1: not on the path
    LaneRange lanes;           // whose bonds lie below it; zero in all others
  };
  struct Panel {
    std::vector<FrontId> path;
    std::vector<Place> place;  // [fronts]
    AlignedVector rows;        // kLanes wide
  };

  void lay_out(Panel& panel, std::span<const BondId> bonds);
  void solve(Panel& panel, std::span<const BondId> bonds);
  void solve_part(Panel& panel, std::span<const BondId> bonds, const PartOfPath& at, int member,
                  const TreeScratch::Loan& loan);
  void solve_alone(const FrontBlock& block, double* pivots, double* x, const LaneRange& lanes, int member);
  void solve_together(const FrontBlock& block, double* pivots, double* x, const LaneRange& lanes);
  void keep(Panel& panel, FrontId f, double* pivots);
  void multiply(int a, int b);

  void spread(std::span<const int> columns, const double* coefficient);
  [[nodiscard]] PanelPart part_at(FrontId f, int p) const;
  [[nodiscard]] bool takes_part(FrontId f, std::uint32_t panels) const;
  template <class Act>
  void for_each_front(std::vector<FrontId>& fronts, const Act& act);

  const SeparatorTree& tree_;
  const TreeBonds& bonds_;
  const TreeFactor& factor_;
  const TreeKernels& kernels_;
  std::vector<BondId> bond_;
  std::vector<std::int32_t> column_of_;  // [M] -1: none
  std::vector<Panel> panel_;
  int panels_ = 0;
  std::int64_t fronts_visited_ = 0;
  std::int64_t entries_read_ = 0;
  AlignedVector gram_;  // kMost x kMost
  TreeScratch& scratch_;
  std::vector<BondId> sorted_;
  std::vector<PartOfPath> parts_;  // of a panel's path
  std::vector<FrontId> top_;
  std::vector<std::pair<int, int>> pairs_;  // of panels, to be multiplied
  std::vector<AlignedVector> column_;       // [threads][tallest front] workspace of the kernels
  // Of a combination, by panel and lane:
  std::array<std::int32_t, kMost / kLanes + 1>
      used_start_{};                             // [panels + 1] where each panel's columns start
  std::array<std::int32_t, kMost> used_lane_{};  // [columns that take part]
  AlignedVector spread_;                         // and their coefficients, kLanes each
  std::vector<std::uint8_t> on_path_;            // [fronts] workspace of solve
  std::vector<std::uint32_t> panels_at_;         // [fronts] bit p: panel p passes through it
};

}  // namespace crackle
