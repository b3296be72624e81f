#include "crackle/equilibrium/tree/tree_batch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace crackle {

namespace {

// What follows sets the speed only: whatever is predicted, a break counts when every bond has been looked at.
constexpr std::size_t kRankedPerFirst = 2;  // bonds that are ranked for each that is followed from the start
constexpr std::size_t kWaitingAtMost = kMostWaiting - kMostStates;  // a pass may add so many more
constexpr int kSpareColumns = 6 * kLanes;                           // what a pass may add

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
                     TreeScratch& scratch, PhaseTimes& times)
    : tree_(tree),
      times_(times),
      columns_(tree, bonds, factor, kernels, scratch),
      search_(network, tree, bonds, factor, kernels, break_on, groups_for(tree)),
      predictor_(network, kernels, break_on),
      followed_(network, search_, columns_),
      candidates_(search_, kRankedPerFirst * followed_.first()),
      most_states_(groups_for(tree) * kLanes) {}

void TreeBatch::reset(std::span<const double> threshold) {
  search_.set_thresholds(threshold);
  verified_.clear();
  candidates_.reset();
  blind_ = false;
  last_ = {};
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
  followed_.clear();
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
    followed_.choose(std::span(waiting_).subspan(committed_), candidates_.ranked(), last_);
  }
  add_columns();
  {
    const PhaseScope scope(times_, Phase::search);
    if (!commit()) return false;
    predictor_.predict(columns_, search_.thresholds(), blind_ ? 0 : most_states_, prediction_);
    if (std::exchange(blind_, false)) return true;
    followed_.extend(prediction_, candidates_.ranked(), last_);
  }
  if (followed_.list().empty()) return true;
  add_columns();
  const PhaseScope scope(times_, Phase::search);
  predictor_.predict(columns_, search_.thresholds(), most_states_, prediction_);
  return true;
}

void TreeBatch::add_columns() {
  const PhaseScope scope(times_, Phase::solve);
  counts_.columns += columns_.add(followed_.list());
}

bool TreeBatch::commit() {
  for (; committed_ < waiting_.size(); ++committed_) {
    int column = 0;
    while (column < columns_.size() && columns_.bond(column) != waiting_[committed_]) ++column;
    if (column == columns_.size() || !predictor_.commit(columns_, column)) return false;
  }
  return true;
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
  for (int s = 0; s < prediction_.states; ++s)
    cut[s] = std::min(kNeverCut, candidates_.keep() * prediction_.ratio[s]);
  search_.run(std::span(fronts_).first(groups), cut.data(), candidates_.list());
  ++counts_.passes;
  counts_.predicted += std::max(1, prediction_.states);
  counts_.candidates += static_cast<std::int64_t>(candidates_.list().size());
  counts_.entries += tree_.factor_entries;
}

BatchResult TreeBatch::verify(double least_stiffness) {
  candidates_.fill_ratios(prediction_);
  BatchResult result = BatchResult::found;
  for (int s = 0; s < std::max(1, prediction_.states); ++s) {
    const VerifiedBreak found = candidates_.largest(s);
    // Below the cut there may be bonds that were not looked at: the predicted ratio was that of mere
    // rounding.
    blind_ = s < prediction_.states && !(found.ratio >= candidates_.keep() * prediction_.ratio[s]);
    const bool agreed = !blind_ && agrees(s);
    if (!agreed) ++counts_.repeated;
    const bool carries = 1 / search_.plate(s) > least_stiffness && found.ratio > 0;
    if (!agreed || !carries) {
      if (s == 0) result = agreed ? BatchResult::failed : BatchResult::stale;
      break;
    }
    last_ = {s, found.ratio, found.ratio * search_.threshold(found.bond)};
    verified_.push_back(found);
    if (s >= prediction_.states || found.bond != prediction_.bond[s]) break;
  }
  counts_.verified += static_cast<std::int64_t>(verified_.size());
  if (!verified_.empty()) candidates_.rank(prediction_, last_.state, last_.ratio);
  return result;
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

}  // namespace crackle
