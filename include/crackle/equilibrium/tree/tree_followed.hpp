/// The set of bonds that a prediction follows: those with a column, and those that are to get one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "crackle/equilibrium/tree/tree_columns.hpp"
#include "crackle/equilibrium/tree/tree_predictor.hpp"
#include "crackle/equilibrium/tree/tree_search.hpp"
#include "crackle/network/neighbourhood.hpp"

namespace crackle {

/// The last state of the network that is certain, as a pass has seen it.
struct CertainState {
  int state = 0;      ///< its number in TreeSearch
  double ratio = 0;   ///< its largest ratio
  double force = 0;   ///< of the bond that broke in it
  double listed = 0;  ///< what the pass has not listed has at most about this ratio
};

class TreeFollowed {
 public:
  using Ranking = std::span<const std::pair<double, BondId>>;

  /// All arguments must outlive this.
  TreeFollowed(const Network& network, const TreeSearch& search, const TreeColumns& columns);

  /// Best-ranked bonds that are followed from the start.
  [[nodiscard]] std::size_t first() const { return first_; }

  /// Whatever has a column loses it: to be called before columns are cleared.
  void clear();

  /// Lists bonds that get a column: `fresh`, which have broken without being followed, the best of `ranked`, and those
  /// near the last of `fresh`.
  void choose(std::span<const BondId> fresh, Ranking ranked, const CertainState& last);
  /// The same of bonds near those that are predicted to break.
  void extend(const Prediction& prediction, Ranking ranked, const CertainState& last);

  /// Lists those of `bonds` (kLanes at most) that have no column yet, and fills the panel with what may be needed next.
  void choose_also(std::span<const BondId> bonds, Ranking ranked, const CertainState& last);

  /// What the last call listed, none of which has a column yet.
  [[nodiscard]] std::span<const BondId> list() const { return list_; }

 private:
  void take(BondId e);
  void take_near(BondId e, double force, const CertainState& last);
  void take_ranked(Ranking ranked, std::size_t begin, std::size_t end);
  void fill_panel(Ranking ranked, std::size_t begin);

  const TreeSearch& search_;
  const TreeColumns& columns_;
  Neighbourhood neighbourhood_;
  std::size_t first_;
  int hops_;                          // how near a bond must be to a break to be followed as well
  std::vector<std::uint8_t> in_set_;  // [M] 1: has a column, or is in list_
  std::vector<BondId> list_;
  std::vector<BondId> near_;       // workspace of take_near
  std::vector<std::size_t> ring_;  // the same
};

}  // namespace crackle
