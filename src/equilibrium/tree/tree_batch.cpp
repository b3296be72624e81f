#include "crackle/equilibrium/tree/tree_batch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

namespace crackle {

namespace {

// What follows sets the speed only: whatever is predicted, a break counts when every bond has been looked at.
constexpr std::size_t kMostFirst = 64;   // best-ranked bonds in the set,
constexpr std::size_t kLeastFirst = 16;  // fewer in small networks:
constexpr std::size_t kBondsPerFirst = 150;
constexpr std::size_t kRankedPerFirst = 2;  // bonds that are ranked for each of them
// A bond near one that breaks joins the set if its ratio would come this near to the largest,
constexpr double kNearRatio = 0.9;
// were it to take over a share of the force that the break sets free: bonds that touch the broken one, those a hop
// away, two hops. Nine in ten of the breaks that a set without them misses are among the first two rings.
constexpr std::array<double, 3> kShare{0.5, 0.25, 0.1};
constexpr int kHops = 2;
constexpr int kHopsWhenSmall = 1;  // in a small network it is not worth while to look further
constexpr std::size_t kWaitingAtMost = kMostWaiting - kMostStates;  // a pass may add so many more
constexpr int kSpareColumns = 6 * kLanes;                           // what a pass may add
constexpr double kWiden = 1.5;  // how much faster candidates are collected when too few were found
constexpr double kWidest = 0.01;

// A factor that is larger than caches usually are is read for two groups of states at a time.
constexpr std::int64_t kEntriesPerGroup = 3'000'000;

/// Predicted and solved displacements agree to rounding, or the state is not used.
constexpr double kAgreement = 1e-9;
constexpr double kNeverCut = 1e300;  // times any threshold of a lattice it is no force
constexpr double kAlwaysCut = 1e-300;

int groups_for(const SeparatorTree& tree) {
  return tree.factor_entries > kEntriesPerGroup ? kMostGroups : 1;
}

}  // namespace

TreeBatch::TreeBatch(const Network& network, const SeparatorTree& tree, const TreeBonds& bonds,
                     const TreeFactor& factor, const TreeKernels& kernels, BreakOn break_on,
                     std::span<double> scratch, PhaseTimes& times)
    : tree_(tree),
      times_(times),
      columns_(tree, bonds, factor, kernels, scratch),
      search_(network, tree, bonds, factor, kernels, break_on, groups_for(tree)),
      predictor_(network, kernels, break_on),
      neighbourhood_(network),
      first_(std::clamp(static_cast<std::size_t>(network.stretchable) / kBondsPerFirst, kLeastFirst,
                        kMostFirst)),
      hops_(first_ < kMostFirst ? kHopsWhenSmall : kHops),
      most_states_(groups_for(tree) * kLanes),
      in_set_(network.bonds(), 0) {}

void TreeBatch::reset(std::span<const double> threshold) {
  threshold_ = threshold;
  search_.set_thresholds(threshold);
  verified_.clear();
  ranked_.clear();
  keep_ = 0;
  blind_ = false;
  last_state_ = 0;
  last_ratio_ = 0;
  refresh();
}

void TreeBatch::remove(BondId bond) {
  waiting_.push_back(bond);
  search_.set_broken(bond);
}

BatchCounts TreeBatch::counts() const {
  BatchCounts counts = counts_;
  counts.fronts += columns_.fronts_visited();
  counts.entries += columns_.entries_read();
  return counts;
}

bool TreeBatch::full() const {
  return waiting_.size() > kWaitingAtMost || columns_.size() + kSpareColumns > TreeColumns::kMost;
}

void TreeBatch::refresh() {
  for (int c = 0; c < columns_.size(); ++c) {
    if (columns_.bond(c) >= 0) in_set_[columns_.bond(c)] = 0;
  }
  columns_.clear();
  predictor_.clear();
  waiting_.clear();
  committed_ = 0;
}

BatchResult TreeBatch::next(double least_stiffness) {
  verified_.clear();
  if (!prepare()) return BatchResult::stale;
  solve();
  const PhaseScope scope(times_, Phase::search);
  return verify(least_stiffness);
}

/// The set of bonds to follow, and a prediction from it.
bool TreeBatch::prepare() {
  {
    const PhaseScope scope(times_, Phase::search);
    choose();
  }
  add_columns();
  {
    const PhaseScope scope(times_, Phase::search);
    if (!commit()) return false;
    predictor_.predict(columns_, threshold_, blind_ ? 0 : most_states_, prediction_);
    if (std::exchange(blind_, false)) return true;
    extend();
  }
  if (list_.empty()) return true;
  add_columns();
  const PhaseScope scope(times_, Phase::search);
  predictor_.predict(columns_, threshold_, most_states_, prediction_);
  return true;
}

void TreeBatch::add_columns() {
  const PhaseScope scope(times_, Phase::solve);
  counts_.columns += columns_.add(list_);
}

bool TreeBatch::commit() {
  for (; committed_ < waiting_.size(); ++committed_) {
    int column = 0;
    while (column < columns_.size() && columns_.bond(column) != waiting_[committed_]) ++column;
    if (column == columns_.size() || !predictor_.commit(columns_, column)) return false;
  }
  return true;
}

/// Bonds that have broken without being followed, those that ranked first, and those near the latest breaks.
void TreeBatch::choose() {
  list_.clear();
  const std::span fresh = std::span(waiting_).subspan(committed_);
  for (const BondId e : fresh) take(e);
  const std::size_t first = std::min(first_, ranked_.size());
  for (std::size_t i = 0; i < first; ++i) {
    if (threshold_[ranked_[i].second] < kNeverCut) take(ranked_[i].second);
  }
  // What earlier breaks did to the forces around them is known; the last one's effect is not.
  if (!fresh.empty()) take_near(fresh.back(), last_force_);
  fill_panel(first);
}

/// Bonds near those that are predicted to break.
void TreeBatch::extend() {
  list_.clear();
  for (int s = 0; s < prediction_.states; ++s)
    take_near(prediction_.bond[s], last_ratio_ * threshold_[prediction_.bond[s]]);
  fill_panel(first_);
}

/// A panel costs the same full or not: the next in rank may come along.
void TreeBatch::fill_panel(std::size_t rank) {
  for (; list_.size() % kLanes != 0 && rank < ranked_.size(); ++rank) {
    if (threshold_[ranked_[rank].second] < kNeverCut) take(ranked_[rank].second);
  }
}

void TreeBatch::take(BondId e) {
  if (in_set_[e] != 0 || static_cast<int>(list_.size()) + columns_.size() >= TreeColumns::kMost) return;
  in_set_[e] = 1;
  list_.push_back(e);
}

/// Bonds near one that breaks, if its force, passed on, could make them critical.
void TreeBatch::take_near(BondId e, double force) {
  if (ranked_.empty()) return;  // no state has been solved for yet
  neighbourhood_.find(e, hops_, near_, ring_);
  std::size_t i = 0;
  for (int ring = 0; ring <= hops_; ++ring) {
    const double added = kShare[ring] * force;
    for (; i < ring_[ring]; ++i) {
      const BondId other = near_[i];
      if (in_set_[other] != 0) continue;
      const double t = threshold_[other];
      if (search_.ratio(other, last_state_) + added / t > kNearRatio * last_ratio_) take(other);
    }
  }
}

void TreeBatch::solve() {
  const PhaseScope scope(times_, Phase::solve);
  const int breaks = prediction_.waiting + std::max(0, prediction_.states - 1);
  const int groups = prediction_.groups();
  for (int g = 0; g < groups; ++g) {
    columns_.combine(std::span(prediction_.column).first(breaks), prediction_.coefficient[g].data(),
                     search_.states(g), fronts_[g]);
    counts_.fronts += tree_.fronts();
  }
  std::array<double, kMostStates> cut{};
  cut.fill(kNeverCut);
  if (prediction_.states == 0) cut[0] = kAlwaysCut;
  for (int s = 0; s < prediction_.states; ++s) cut[s] = std::min(kNeverCut, keep_ * prediction_.ratio[s]);
  search_.run(std::span(fronts_).first(groups), cut.data(), candidate_);
  ++counts_.passes;
  counts_.predicted += std::max(1, prediction_.states);
  counts_.candidates += static_cast<std::int64_t>(candidate_.size());
  counts_.entries += tree_.factor_entries;
}

BatchResult TreeBatch::verify(double least_stiffness) {
  if (prediction_.states == 0) thin_out();
  fill_ratios();
  BatchResult result = BatchResult::found;
  for (int s = 0; s < std::max(1, prediction_.states); ++s) {
    const VerifiedBreak found = largest(s);
    // Below the cut there may be bonds that were not looked at: the predicted ratio was that of mere
    // rounding.
    blind_ = s < prediction_.states && !(found.ratio >= keep_ * prediction_.ratio[s]);
    const bool agreed = !blind_ && agrees(s);
    if (!agreed) ++counts_.repeated;
    const bool carries = 1 / search_.plate(s) > least_stiffness && found.ratio > 0;
    if (!agreed || !carries) {
      if (s == 0) result = agreed ? BatchResult::failed : BatchResult::stale;
      break;
    }
    last_state_ = s;
    last_ratio_ = found.ratio;
    last_force_ = found.ratio * threshold_[found.bond];
    verified_.push_back(found);
    if (s >= prediction_.states || found.bond != prediction_.bond[s]) break;
  }
  counts_.verified += static_cast<std::int64_t>(verified_.size());
  rank();
  return result;
}

/// Without a prediction every bond is a candidate: leaves those that rank() keeps, and all that tie with
/// them.
void TreeBatch::thin_out() {
  const std::size_t wanted = kRankedPerFirst * first_;
  if (candidate_.size() <= wanted) return;
  ratio_.clear();
  for (const BondId e : candidate_) ratio_.push_back(search_.ratio(e, 0));
  std::ranges::nth_element(ratio_, ratio_.begin() + static_cast<std::ptrdiff_t>(wanted), std::greater{});
  const double least = std::min(ratio_[wanted], least_tied(std::ranges::max(ratio_)));
  std::erase_if(candidate_, [&](BondId e) { return search_.ratio(e, 0) < least; });
}

/// Ratios of all candidates in all states; 0 once a bond is predicted to be broken.
void TreeBatch::fill_ratios() {
  stride_ = prediction_.groups() * kLanes;
  ratio_.resize(candidate_.size() * stride_);
  for (std::size_t i = 0; i < candidate_.size(); ++i) {
    double* ratio = ratio_.data() + i * stride_;
    search_.ratios(candidate_[i], prediction_.groups(), ratio);
    for (int s = 0; s + 1 < prediction_.states; ++s) {
      if (prediction_.bond[s] == candidate_[i]) std::fill(ratio + s + 1, ratio + stride_, 0.0);
    }
  }
}

/// Whether the state is the one that was asked for: the broken bonds stretch as the right-hand side assumes.
bool TreeBatch::agrees(int state) const {
  for (int i = 0; i < prediction_.waiting + state; ++i) {
    const double told = prediction_.stretch(i, state);
    const double found = search_.stretch(columns_.bond(prediction_.column[i]), state);
    if (!(std::abs(found - told) <= kAgreement * std::abs(told))) return false;
  }
  return true;
}

VerifiedBreak TreeBatch::largest(int state) const {
  VerifiedBreak found;
  for (std::size_t i = 0; i < candidate_.size(); ++i)
    found.ratio = std::max(found.ratio, ratio_[i * stride_ + state]);
  for (std::size_t i = 0; i < candidate_.size(); ++i) {
    const bool tied = ratio_[i * stride_ + state] >= least_tied(found.ratio);
    if (tied && (found.bond < 0 || candidate_[i] < found.bond)) found.bond = candidate_[i];
  }
  return found;
}

/// Who may break soon: the best ratio that a bond reaches in a state that is certain or still to be expected.
void TreeBatch::rank() {
  if (verified_.empty()) return;
  ranked_.clear();
  for (std::size_t i = 0; i < candidate_.size(); ++i) {
    const double* ratio = ratio_.data() + i * stride_;
    double best = ratio[last_state_] / last_ratio_;
    for (int s = last_state_ + 1; s < prediction_.states; ++s)
      best = std::max(best, ratio[s] / prediction_.ratio[s]);
    if (best > 0) ranked_.emplace_back(best, candidate_[i]);
  }
  const std::size_t wanted = kRankedPerFirst * first_;
  const std::size_t kept = std::min(ranked_.size(), wanted);
  const auto end = ranked_.begin() + static_cast<std::ptrdiff_t>(kept);
  if (kept < ranked_.size()) std::ranges::nth_element(ranked_, end, std::greater{});
  std::sort(ranked_.begin(), end, std::greater{});
  if (kept == wanted) {
    keep_ = std::min(0.999, ranked_[kept - 1].first);
  } else {
    keep_ = std::max(kWidest, 1 - kWiden * (1 - keep_));
  }
  ranked_.resize(kept);
}

}  // namespace crackle
