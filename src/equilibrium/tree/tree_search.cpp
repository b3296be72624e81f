#include "crackle/equilibrium/tree/tree_search.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace crackle {

namespace {

/// States that need more memory (bytes) than a core's own cache holds are asked for ahead of their use.
constexpr std::size_t kOwnCache = std::size_t{2} << 20;

}  // namespace

TreeSearch::TreeSearch(const Network& network, const SeparatorTree& tree, const TreeBonds& bonds,
                       const TreeFactor& factor, const TreeKernels& kernels, BreakOn break_on,
                       int single_groups, TreeScratch& scratch)
    : network_(network),
      tree_(tree),
      bonds_(bonds),
      factor_(factor),
      kernels_(kernels),
      magnitude_(break_on == BreakOn::magnitude),
      far_(static_cast<std::size_t>(tree.positions()) * kLanes * sizeof(double) > kOwnCache),
      limit_(bonds.by_owner.size()) {
  if (single_groups > 0) {
    single_ = std::make_unique<TreeSingle>(tree, bonds, factor, kernels, magnitude_, single_groups * kLanes,
                                           scratch);
  }
  std::int32_t most = 0;
  for (FrontId f = 0; f < tree.fronts(); ++f) most = std::max(most, bonds.start[f + 1] - bonds.start[f]);
  found_.resize(static_cast<std::size_t>(most) + 1);
}

void TreeSearch::set_thresholds(std::span<const double> threshold) {
  assert(threshold.size() == bonds_.place.size());
  threshold_.assign(threshold.begin(), threshold.end());
  for (std::size_t i = 0; i < limit_.size(); ++i) {
    const BondId e = bonds_.by_owner[i];
    limit_[i] = threshold[e] / std::sqrt(network_.stiffness[e]);
  }
  if (single_) single_->set_limits(limit_);
}

void TreeSearch::set_broken(BondId e) {
  assert(std::isfinite(threshold_[e]) && bonds_.place[e] >= 0);
  threshold_[e] = std::numeric_limits<double>::infinity();
  limit_[bonds_.place[e]] = threshold_[e];
  if (single_) single_->set_broken(bonds_.place[e]);
}

double* TreeSearch::states(int group) {
  x_[group].resize(static_cast<std::size_t>(tree_.positions()) * kLanes);
  return x_[group].data();
}

void TreeSearch::refresh() {
  stale_ = true;
  // what was out of range may have broken
  if (single_ && !single_->in_range()) single_->set_limits(limit_);
}

void TreeSearch::update_single() {
  if (std::exchange(stale_, false)) single_->refresh();
}

void TreeSearch::run(std::span<const std::vector<FrontId>> fronts, const double* cut,
                     std::vector<BondId>& candidates) {
  assert(fronts.size() <= kMostGroups && !x_[fronts.size() - 1].empty());
  assert(std::ranges::all_of(fronts, [](const auto& each) { return std::ranges::is_sorted(each); }));
  pass_ = Pass::exact;
  candidates.clear();
  std::array<std::size_t, kMostGroups> left{};
  for (std::size_t g = 0; g < fronts.size(); ++g) left[g] = fronts[g].size();
  for (FrontId f = tree_.fronts() - 1; f >= 0; --f) {
    const Front& front = tree_.front[f];
    const std::size_t before = candidates.size();
    for (std::size_t g = 0; g < fronts.size(); ++g) {
      double* pivots = x_[g].data() + static_cast<std::size_t>(front.first) * kLanes;
      if (left[g] > 0 && fronts[g][left[g] - 1] == f) {
        --left[g];
      } else {
        std::fill_n(pivots, front.pivots * kLanes, 0.0);
      }
      if (far_ && f > 0) ask_for(f - 1, x_[g].data());
      kernels_.backward(factor_.block(f), pivots, x_[g].data());
      find_in(f, static_cast<int>(g), cut, candidates);
    }
    if (fronts.size() == 1) continue;
    const auto mine = candidates.begin() + static_cast<std::ptrdiff_t>(before);
    std::sort(mine, candidates.end());
    candidates.erase(std::unique(mine, candidates.end()), candidates.end());
  }
  for (int s = 0; s < static_cast<int>(fronts.size()) * kLanes; ++s) least_[s] = nothing(s).elongation();
}

void TreeSearch::find_in(FrontId f, int group, const double* cut, std::vector<BondId>& candidates) {
  const std::size_t begin = bonds_.start[f];
  const BondBlock block{bonds_.row.data() + begin * bonds_.width, bonds_.value.data() + begin * bonds_.width,
                        limit_.data() + begin, bonds_.start[f + 1] - bonds_.start[f], bonds_.width};
  const auto find = magnitude_ ? kernels_.find_magnitude : kernels_.find_tension;
  const int hits = find(block, x_[group].data(), cut + group * kLanes, found_.data());
  for (int i = 0; i < hits; ++i) candidates.push_back(bonds_.by_owner[begin + found_[i]]);
}

void TreeSearch::run_single(std::span<const std::vector<FrontId>> fronts, std::span<const double> cut,
                            std::vector<BondId>& candidates) {
  update_single();
  pass_ = Pass::single;
  single_->run(fronts, cut, candidates);
}

void TreeSearch::run_base(std::vector<BondId>& candidates) {
  update_single();
  pass_ = Pass::base;
  candidates = bonds_.by_owner;
}

void TreeSearch::ask_for(FrontId f, const double* x) const {
  constexpr int kAhead = 8;  // doubles in a cache line
  const Front& front = tree_.front[f];
  const double* pivots = x + static_cast<std::size_t>(front.first) * kLanes;
  for (int i = 0; i < front.pivots * kLanes; i += kAhead) __builtin_prefetch(pivots + i);
  for (const Position at : tree_.boundary(f)) {
    for (int i = 0; i < kLanes; i += kAhead)
      __builtin_prefetch(x + static_cast<std::size_t>(at) * kLanes + i);
  }
}

void TreeSearch::copy_state(int state, std::span<double> u) const {
  std::ranges::fill(u, 0.0);
  for (Position position = 0; position < tree_.positions(); ++position)
    u[tree_.dof[position]] = at(position, state);
}

double TreeSearch::ratio(BondId e, int state) const {
  if (pass_ == Pass::single) {
    const double stretch = single_->stretch(bonds_.place[e], state);
    return (magnitude_ ? std::abs(stretch) : std::max(stretch, 0.0)) / limit_[bonds_.place[e]];
  }
  const double t = threshold_[e];
  const auto rows = bonds_.rows(e);
  const auto values = network_.bond_values(e);
  double elongation = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) elongation += values[i] * at(rows[i], state);
  const double size = magnitude_ ? std::abs(elongation) : elongation;
  const double force = network_.stiffness[e] * size;
  return nothing(state).is_less_than(size, force) ? force / t : 0;
}

void TreeSearch::ratios(BondId e, int groups, double* ratio) const {
  if (pass_ == Pass::base) {
    std::fill_n(ratio, groups * kLanes, 0.0);
    ratio[0] = this->ratio(e, 0);
    return;
  }
  const BondForce bond{bonds_.rows(e).data(),
                       network_.bond_values(e).data(),
                       network_.stiffness[e],
                       threshold_[e],
                       nothing(0).force(),
                       bonds_.width,
                       magnitude_};
  for (int g = 0; g < groups; ++g) {
    kernels_.ratios(bond, x_[g].data(), least_.data() + g * kLanes, ratio + g * kLanes);
  }
}

double TreeSearch::margin(BondId e, int state) const {
  return stretch_margin(state) / limit_[bonds_.place[e]];
}

double TreeSearch::stretch(BondId e, int state) const {
  if (pass_ == Pass::single) return single_->stretch(bonds_.place[e], state);
  const auto rows = bonds_.rows(e);
  const auto values = bonds_.values(e);
  double sum = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) sum += values[i] * at(rows[i], state);
  return sum;
}

}  // namespace crackle
