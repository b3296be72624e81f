#include "crackle/equilibrium/tree/tree_predictor.hpp"

#include <algorithm>
#include <cmath>

namespace crackle {

TreePredictor::TreePredictor(const Network& network, const TreeKernels& kernels, BreakOn break_on)
    : network_(network),
      kernels_(kernels),
      magnitude_(break_on == BreakOn::magnitude),
      step_(static_cast<std::size_t>(kMostWaiting + kMostStates + 1) * TreeColumns::kMost),
      weight_(static_cast<std::size_t>(kMostWaiting + kMostStates) * (kMostWaiting + kMostStates)),
      certain_(TreeColumns::kMost),
      stretch_(TreeColumns::kMost),
      per_stretch_(TreeColumns::kMost),
      ratio_(TreeColumns::kMost) {}

void TreePredictor::clear(double plate) {
  waiting_ = 0;
  certain_plate_ = plate;
  followed_ = 0;
}

/// Of break i's own bond: needs no column but those of the earlier breaks.
void TreePredictor::find_weights(int i) {
  double* weight = weight_.data() + static_cast<std::size_t>(i) * (kMostWaiting + kMostStates);
  for (int h = 0; h < i; ++h) weight[h] = step(h)[column_[i]] / slack_[h];
}

/// g^T K_i^-1 g_j over columns begin .. end - 1, j the i-th to break and K_i without those before it: the
/// Gram column, and what each earlier break adds (Sherman-Morrison, one by one).
void TreePredictor::compute_step(const TreeColumns& columns, int i, int begin, int end) {
  const int j = column_[i];
  double* own = step(i);
  std::copy(columns.gram(j) + begin, columns.gram(j) + end, own + begin);
  const double* weight = weight_.data() + static_cast<std::size_t>(i) * (kMostWaiting + kMostStates);
  kernels_.add_rows(step(0) + begin, TreeColumns::kMost, weight, i, own + begin, end - begin);
}

/// Brings columns added since the last call up to the waiting breaks.
void TreePredictor::follow(const TreeColumns& columns) {
  const int size = columns.size();
  for (int c = followed_; c < size; ++c) certain_[c] = columns.bond(c) < 0 ? 0 : columns.stretch(c);
  for (int i = 0; i < waiting_; ++i) {
    compute_step(columns, i, followed_, size);
    const double* own = step(i);
    for (int c = followed_; c < size; ++c) certain_[c] += factor_[i] * own[c];
  }
  followed_ = size;
}

bool TreePredictor::commit(const TreeColumns& columns, int column) {
  if (waiting_ == kMostWaiting) return false;
  follow(columns);
  column_[waiting_] = column;
  find_weights(waiting_);
  compute_step(columns, waiting_, 0, followed_);
  const double* own = step(waiting_);
  slack_[waiting_] = 1 - own[column];
  if (!(slack_[waiting_] >= kLeastPredictedSlack)) return false;
  factor_[waiting_] = certain_[column] / slack_[waiting_];
  certain_plate_ += factor_[waiting_] * certain_[column];
  for (int c = 0; c < followed_; ++c) certain_[c] += factor_[waiting_] * own[c];
  ++waiting_;
  return true;
}

/// The bond that would break: the largest ratio, the lowest BondId among those that tie; -1: none carries anything.
int TreePredictor::largest(const TreeColumns& columns, double& ratio) {
  ratio = kernels_.products(per_stretch_.data(), stretch_.data(), columns.size(), magnitude_, ratio_.data());
  int best = -1;
  const double tied = least_tied(ratio);
  for (int i = 0; ratio > 0 && i < columns.size(); ++i) {
    if (ratio_[i] >= tied && (best < 0 || columns.bond(i) < columns.bond(best))) best = i;
  }
  return best;
}

double TreePredictor::stretch(const TreeColumns& columns, int column, const Prediction& prediction,
                              int state) {
  const double* gram = columns.gram(column);
  double sum = columns.stretch(column);
  for (int i = 0; i < prediction.waiting + state; ++i)
    sum += gram[prediction.column[i]] * prediction.stretch(i, state);
  return sum;
}

double TreePredictor::ratio(const TreeColumns& columns, int column, const Prediction& prediction, int state,
                            double threshold) const {
  const double stretch = TreePredictor::stretch(columns, column, prediction, state);
  const double size = magnitude_ ? std::abs(stretch) : std::max(stretch, 0.0);
  return std::sqrt(network_.stiffness[columns.bond(column)]) / threshold * size;
}

void TreePredictor::predict(const TreeColumns& columns, std::span<const double> threshold, int most,
                            Prediction& prediction) {
  follow(columns);
  for (int c = 0; c < followed_; ++c) {
    const BondId e = columns.bond(c);
    stretch_[c] = certain_[c];
    per_stretch_[c] = e < 0 ? 0 : std::sqrt(network_.stiffness[e]) / threshold[e];
  }
  for (int i = 0; i < waiting_; ++i) per_stretch_[column_[i]] = 0;
  const auto clear_row = [&prediction](int i) {
    for (auto& group : prediction.coefficient) std::fill_n(group.data() + i * kLanes, kLanes, 0.0);
  };
  for (int i = 0; i < waiting_; ++i) clear_row(i);
  prediction.waiting = waiting_;
  prediction.columns = followed_;
  prediction.states = 0;
  prediction.plate[0] = certain_plate_;
  for (int i = 0; i < waiting_; ++i) prediction.stretch(i, 0) = stretch_[column_[i]];
  for (int s = 0; s < most; ++s) {
    const int at = waiting_ + s;
    for (int i = 0; i < at; ++i) prediction.stretch(i, s) = stretch_[column_[i]];
    const int j = largest(columns, prediction.ratio[s]);
    if (j < 0) break;
    clear_row(at);
    column_[at] = j;
    prediction.bond[s] = columns.bond(j);
    prediction.states = s + 1;
    if (s + 1 == most) break;
    find_weights(at);
    compute_step(columns, at, 0, followed_);
    const double* own = step(at);
    slack_[at] = 1 - own[j];
    if (!(slack_[at] >= kLeastPredictedSlack)) break;
    const double factor = stretch_[j] / slack_[at];
    prediction.plate[s + 1] = prediction.plate[s] + factor * stretch_[j];
    for (int c = 0; c < followed_; ++c) stretch_[c] += factor * own[c];
    per_stretch_[j] = 0;
  }
  std::ranges::copy(column_, prediction.column.begin());
}

}  // namespace crackle
