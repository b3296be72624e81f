#include "crackle/equilibrium/tree/tree_batch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "crackle/equilibrium/trust.hpp"

namespace crackle {

namespace {

// What follows sets the speed only: whatever is predicted, a break counts when every bond has been looked at.
constexpr std::size_t kRankedPerFirst = 2;  // bonds that are ranked for each that is followed from the start
constexpr std::size_t kWaitingAtMost = kMostWaiting - kMostStates;  // a pass may add so many more
constexpr int kSpareColumns = 6 * kLanes;                           // what a pass may add

// A factor that is larger than caches usually are is read for two groups of states at a time.
constexpr std::int64_t kEntriesPerGroup = 3'000'000;
constexpr std::int64_t kSingleEntriesPerGroup = 200'000;

/// Predicted and solved displacements agree to rounding, or the state is not used.
constexpr double kAgreement = 1e-9;
constexpr double kNeverCut = 1e300;  // times any threshold of a lattice it is no force
constexpr double kAlwaysCut = 1e-300;

/// A single pass that can't tell the next bond may after the factor has taken in so many breaks: margins grow with them.
constexpr std::size_t kWorthTakingIn = 8;
/// Ratios closer than this may tie, or not: double precision's own pass tells.
constexpr double kNearTie = 4 * kTie;
/// Forces and elongations below this many times what counts as none: the same.
constexpr double kNearNothing = 100;
/// What 1/F may have grown by in a state that is looked for in single precision, and how many such states are few.
constexpr double kMostGrowth = 4;
constexpr int kFewStates = 4;
/// Where every state's residual is looked at, over where the referee decides all.
constexpr double kLookedAt = kDoubtfulStiffness / kRefereedStiffness;

int groups_for(const SeparatorTree& tree, Precision precision) {
  const bool single = precision == Precision::single;
  return tree.factor_entries > (single ? kSingleEntriesPerGroup : kEntriesPerGroup) ? kMostGroups : 1;
}

}  // namespace

TreeBatch::TreeBatch(const Network& network, const SeparatorTree& tree, const TreeBonds& bonds,
                     const TreeFactor& factor, const TreeKernels& kernels, BreakOn break_on,
                     Precision precision, TreeScratch& scratch, PhaseTimes& times)
    : network_(network),
      tree_(tree),
      factor_(factor),
      times_(times),
      columns_(tree, bonds, factor, kernels, scratch),
      search_(network, tree, bonds, factor, kernels, break_on,
              precision == Precision::single ? groups_for(tree, precision) : 0, scratch),
      predictor_(network, kernels, break_on),
      followed_(network, search_, columns_),
      candidates_(search_, kRankedPerFirst * followed_.first()),
      most_states_(groups_for(tree, precision) * kLanes),
      most_exact_states_(groups_for(tree, Precision::all_double) * kLanes) {}

void TreeBatch::reset(std::span<const double> threshold) {
  search_.set_thresholds(threshold);
  verified_.clear();
  plate_.clear();
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
  predictor_.clear(1 / factor_.stiffness());
  search_.refresh();
  waiting_.clear();
  committed_ = 0;
}

BatchResult TreeBatch::next(double least_stiffness) {
  verified_.clear();
  plate_.clear();
  if (!prepare()) return BatchResult::stale;
  if (suits_single(least_stiffness * kLookedAt)) {
    solve_single();
    const PhaseScope scope(times_, Phase::search);
    if (confirm(least_stiffness)) return BatchResult::found;
    ++counts_.undecided;
    if (waiting_.size() >= kWorthTakingIn) return BatchResult::stale;
  }
  prediction_.states = std::min(prediction_.states, most_exact_states_);
  solve();
  const PhaseScope scope(times_, Phase::search);
  return verify(least_stiffness);
}

/// Whether single precision is worth trying, in the states that differ little from the one in which the factor is
/// current: the prediction ends there. (Where one break takes half of F away, margins are as wide as forces; below
/// least_stiffness all displacements are looked at, which a pass in double has.)
bool TreeBatch::suits_single(double least_stiffness) {
  if (!search_.searches_in_single()) return false;
  int near = 0;
  while (near < prediction_.states && prediction_.plate[near] * factor_.stiffness() < kMostGrowth &&
         prediction_.plate[near] * least_stiffness < 1) {
    ++near;
  }
  if (near < std::min(prediction_.states, kFewStates)) return false;
  prediction_.states = near;
  return near > 0;
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
    const int column = columns_.find(waiting_[committed_]);
    if (column < 0 || !predictor_.commit(columns_, column)) return false;
  }
  return true;
}

void TreeBatch::solve() {
  const PhaseScope scope(times_, Phase::solve);
  exact_ = true;
  if (prediction_.states == 0 && prediction_.waiting == 0 && search_.searches_in_single()) {
    search_.run_base(candidates_.list());
  } else {
    solve_exactly();
  }
  ++counts_.passes;
  counts_.predicted += std::max(1, prediction_.states);
  counts_.candidates += static_cast<std::int64_t>(candidates_.list().size());
}

/// All states of the prediction in double.
void TreeBatch::solve_exactly() {
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
  counts_.entries += tree_.factor_entries;
}

void TreeBatch::solve_single() {
  const PhaseScope scope(times_, Phase::solve);
  exact_ = false;
  const int breaks = prediction_.waiting + prediction_.states - 1;
  const int groups = prediction_.groups();
  for (int g = 0; g < groups; ++g) {
    columns_.combine_single(std::span(prediction_.column).first(breaks), prediction_.coefficient[g].data(),
                            search_.single_states() + g * kLanes, search_.single_lanes(), fronts_[g]);
    counts_.fronts += tree_.fronts();
  }
  std::array<double, kMostStates> cut{};
  cut.fill(kNeverCut);
  for (int s = 0; s < prediction_.states; ++s) cut[s] = candidates_.keep() * prediction_.ratio[s];
  search_.run_single(std::span(fronts_).first(static_cast<std::size_t>(groups)), cut, candidates_.list());
  counts_.entries += tree_.factor_entries;
  ++counts_.passes;
  ++counts_.single;
  counts_.predicted += prediction_.states;
  counts_.candidates += static_cast<std::int64_t>(candidates_.list().size());
}

/// What the single pass confirms, with what the Gram matrix knows in double. False: not even state 0.
bool TreeBatch::confirm(double least_stiffness) {
  if (!agrees_in_single()) return false;
  candidates_.fill_single_ratios(prediction_);
  for (int s = 0; s < prediction_.states; ++s) {
    VerifiedBreak found;
    if (!(1 / prediction_.plate[s] > least_stiffness * (1 + kAgreement)) || !confirm_state(s, found)) break;
    keep(found, s, prediction_.plate[s]);
    if (found.bond != prediction_.bond[s]) break;
  }
  if (verified_.empty()) return false;
  if (!agrees_with_gram(last_.state)) {
    verified_.clear();
    plate_.clear();
    return false;
  }
  counts_.verified += static_cast<std::int64_t>(verified_.size());
  candidates_.rank(prediction_, last_.state, last_.ratio);
  return true;
}

/// The next break in a state, if it can be told: the set's own, or one of those that may come up to it.
bool TreeBatch::confirm_state(int state, VerifiedBreak& found) {
  found = {prediction_.bond[state], prediction_.ratio[state]};
  candidates_.find_contenders(state, found.ratio * (1 - kNearTie), contenders_);
  std::erase_if(contenders_, [this](BondId e) { return is_predicted_with(e); });
  if (!follow_contenders()) return false;
  double second = 0;
  for (const BondId e : contenders_) {
    VerifiedBreak other{
        e, predictor_.ratio(columns_, columns_.find(e), prediction_, state, search_.threshold(e))};
    if (!(other.ratio <= found.ratio)) std::swap(found, other);
    second = std::max(second, other.ratio);
  }
  if (second >= found.ratio * (1 - kNearTie)) return false;
  const Nothing<double> nothing(kNearNothing * prediction_.plate[state], kNearNothing);
  return nothing.is_less_than_force(found.ratio * search_.threshold(found.bond),
                                    network_.stiffness[found.bond]);
}

/// Whether the prediction has taken account of a bond: it had a column then.
bool TreeBatch::is_predicted_with(BondId e) const {
  const int column = columns_.find(e);
  return column >= 0 && column < prediction_.columns;
}

/// Gives contenders_ columns. False: there are too many of them.
bool TreeBatch::follow_contenders() {
  const auto more = std::ranges::count_if(contenders_, [this](BondId e) { return columns_.find(e) < 0; });
  if (more == 0) return true;
  if (more > kLanes || columns_.size() + kLanes > TreeColumns::kMost) return false;
  followed_.choose_also(contenders_, candidates_.ranked(), last_);
  counts_.contenders += more;
  counts_.columns += columns_.add(followed_.list());
  return true;
}

void TreeBatch::keep(const VerifiedBreak& found, int state, double plate) {
  last_ = {state, found.ratio, found.ratio * search_.threshold(found.bond), candidates_.keep() * found.ratio};
  verified_.push_back(found);
  plate_.push_back(plate);
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
    keep(found, s, search_.plate(s));
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

/// The same of a single pass's last state, which differs most, to within its margin.
bool TreeBatch::agrees_in_single() {
  const int state = prediction_.states - 1;
  for (int s = 0; s <= state; ++s) {
    if (!std::isfinite(search_.stretch_margin(s))) return false;
  }
  for (int i = 0; i < prediction_.waiting + state; ++i) {
    const double told = prediction_.stretch(i, state);
    const double found = search_.stretch(columns_.bond(prediction_.column[i]), state);
    const double allowed = search_.stretch_margin(state) + kAgreement * std::abs(told);
    const double error = std::abs(found - told);
    if (!(error <= allowed)) return false;
    if (error > counts_.used_margin * allowed) counts_.used_margin = error / allowed;
  }
  return true;
}

/// Whether the steps of the prediction, one after the other, have come to what the Gram matrix says in one.
bool TreeBatch::agrees_with_gram(int state) const {
  for (int i = 0; i < prediction_.waiting + state; ++i) {
    const double told = prediction_.stretch(i, state);
    const double found = predictor_.stretch(columns_, prediction_.column[i], prediction_, state);
    if (!(std::abs(found - told) <= kAgreement * std::abs(told))) return false;
  }
  return true;
}

bool TreeBatch::copy_state(int state, std::span<double> u) {
  if (!exact_ && columns_.size() == 0) return false;
  if (exact_) {
    search_.copy_state(state, u);
    return true;
  }
  one_.resize(tree_.positions());
  columns_.combine_one(std::span(prediction_.column).first(prediction_.waiting + state),
                       prediction_.coefficient[state / kLanes].data() + state % kLanes, one_);
  factor_.substitute_back(one_);
  std::ranges::fill(u, 0.0);
  for (Position at = 0; at < tree_.positions(); ++at) u[tree_.dof[at]] = one_[at];
  return true;
}

}  // namespace crackle
