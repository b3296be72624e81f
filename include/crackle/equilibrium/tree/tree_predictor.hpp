/// Which bonds break next, as far as a set of columns can tell.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "crackle/equilibrium/criterion.hpp"
#include "crackle/equilibrium/tree/tree_columns.hpp"
#include "crackle/equilibrium/tree/tree_search.hpp"

namespace crackle {

/// Breaks that the factor has not taken in, at most, before those that are predicted.
inline constexpr int kMostWaiting = 96;

/// A sequence of breaks that would follow if only bonds of the set could break. State s is the network after
/// `waiting` breaks that are certain and the first s predicted ones, at unit plate load.
struct Prediction {
  int waiting = 0;
  int columns = 0;  ///< of the set, when it was made
  int states = 0;   ///< 0 .. kMostStates; 0: no bond of the set carries anything
  std::array<int, kMostWaiting + kMostStates>
      column{};                            ///< [waiting + states] the bonds in the order of breaking
  std::array<BondId, kMostStates> bond{};  ///< [states] the bond that breaks in each state
  std::array<double, kMostStates>
      ratio{};  ///< [states] the largest force over threshold, which it has or ties with
  std::array<double, kMostStates> plate{};  ///< [states] u[plate] = 1/F
  /// By group of kLanes states: row i, lane s: g_i . u in that state, of the i-th to break, 0 before that:
  /// u_s = K^-1 (e_plate + sum_i g_i coefficient), K the factor's.
  std::array<std::array<double, (kMostWaiting + kMostStates) * kLanes>, kMostGroups> coefficient{};

  [[nodiscard]] int groups() const { return states > kLanes ? (states + kLanes - 1) / kLanes : 1; }
  [[nodiscard]] double& stretch(int i, int state) {
    return coefficient[state / kLanes][i * kLanes + state % kLanes];
  }
  [[nodiscard]] double stretch(int i, int state) const {
    return coefficient[state / kLanes][i * kLanes + state % kLanes];
  }
};

/// Below this slack a prediction goes no further: what follows is known only as well as a fresh factor knows
/// it.
inline constexpr double kLeastPredictedSlack = 1e-3;

class TreePredictor {
 public:
  TreePredictor(const Network& network, const TreeKernels& kernels, BreakOn break_on);

  /// The factor is current, the set is empty: no break is waiting. plate: u[plate] = 1/F.
  void clear(double plate);

  /// A bond of the set has broken. False: it can't be followed within the set, the factor has to take it in.
  [[nodiscard]] bool commit(const TreeColumns& columns, int column);
  [[nodiscard]] int waiting() const { return waiting_; }

  /// g . u of any column in a state of the prediction, from K^-1 e_plate and the Gram matrix alone: what the prediction's
  /// own steps, one after the other, come to when rounding has not spoilt them.
  [[nodiscard]] static double stretch(const TreeColumns& columns, int column, const Prediction& prediction,
                                      int state);
  /// Force over threshold of that column's bond, 0 for what doesn't count.
  [[nodiscard]] double ratio(const TreeColumns& columns, int column, const Prediction& prediction, int state,
                             double threshold) const;

  /// At most `most` states (0 .. kMostStates). threshold: [M], infinity for what has broken.
  void predict(const TreeColumns& columns, std::span<const double> threshold, int most,
               Prediction& prediction);

 private:
  [[nodiscard]] double* step(int i) {
    return step_.data() + static_cast<std::size_t>(i) * TreeColumns::kMost;
  }
  void follow(const TreeColumns& columns);
  void find_weights(int i);
  void compute_step(const TreeColumns& columns, int i, int begin, int end);
  [[nodiscard]] int largest(const TreeColumns& columns, double& ratio);

  const Network& network_;
  const TreeKernels& kernels_;
  bool magnitude_;
  int waiting_ = 0;
  double certain_plate_ = 0;  // u[plate] after the waiting breaks
  int followed_ = 0;          // columns whose entries below are those after all waiting breaks
  std::array<int, kMostWaiting + kMostStates> column_{};     // [breaks] in order
  std::array<double, kMostWaiting + kMostStates> slack_{};   // [breaks] 1 - g^T K_i^-1 g of each
  std::array<double, kMostWaiting + kMostStates> factor_{};  // [breaks] g . u before the break, over slack
  AlignedVector step_;         // [breaks * kMost] column of K_i^-1 of each break, within the set
  AlignedVector weight_;       // [breaks * breaks] row i: what each earlier break adds to step i
  AlignedVector certain_;      // [columns] g . u after the waiting breaks
  AlignedVector stretch_;      // [columns] and after the predicted ones so far
  AlignedVector per_stretch_;  // [columns] sqrt(k) / threshold; 0: broken or no bond
  AlignedVector ratio_;        // [columns] workspace of largest
};

}  // namespace crackle
