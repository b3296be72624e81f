#include "crackle/equilibrium/tree/tree_downdate.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace crackle {

namespace {

/// Rows of a turn: with 64 columns' tiles and a few vectors they stay in a first-level cache.
constexpr int kMostRows = 128;

}  // namespace

TreeDowndate::TreeDowndate(const SeparatorTree& tree, const TreeBonds& bonds, const TreeKernels& kernels,
                           TreeScratch& scratch)
    : tree_(tree),
      bonds_(bonds),
      kernels_(kernels),
      scratch_(scratch),
      place_(tree.fronts(), -1),
      on_path_(tree.fronts(), 0),
      steps_(static_cast<std::size_t>(kColumnsTogether) * kMost),
      slack_(kMost) {
  sorted_.reserve(kMost);
  path_.reserve(tree.fronts());
  visit_.reserve(tree.fronts());
  parts_.reserve(kMost);
  top_.reserve(tree.fronts());
}

/// Parts side by side, then the top, where threads share the rows of a front.
TreeDowndate::Slack TreeDowndate::run(std::span<const BondId> bonds, const FactorStorage& factor) {
  lay_out(bonds);
  scratch_.parts().split(path_, parts_, top_);
  scratch_.team().for_each(static_cast<int>(parts_.size()), [&](int turn, int) {
    for (std::int32_t i = parts_[turn].begin; i < parts_[turn].end; ++i) visit(visit_[i], factor, false);
  });
  Slack slack;
  for (const FrontId f : top_) {
    // all that is left is the plate
    if (f + 1 == tree_.fronts()) slack.held = *std::ranges::min_element(slack_);
    visit(visit_[place_[f]], factor, true);
  }
  slack.smallest = *std::ranges::min_element(slack_);
  if (!std::isfinite(slack.smallest)) slack.smallest = 0;
  assert(std::ranges::all_of(w_, [](double w) { return w == 0; }));
  return slack;
}

void TreeDowndate::lay_out(std::span<const BondId> bonds) {
  assert(bonds.size() <= kMost);
  sorted_.assign(bonds.begin(), bonds.end());
  std::ranges::sort(sorted_, [&](BondId a, BondId b) {
    return bonds_.owner[a] != bonds_.owner[b] ? bonds_.owner[a] < bonds_.owner[b] : a < b;
  });
  assert(sorted_.empty() || bonds_.owner[sorted_.front()] >= 0);
  std::ranges::fill(slack_, 1.0);
  find_path(tree_, bonds_, sorted_, on_path_, path_);
  visit_.clear();
  std::size_t next = 0;
  for (const FrontId f : path_) {
    const Front& front = tree_.front[f];
    const LaneRange below = bonds_.owned_by(sorted_, front.first_descendant, f);
    place_[f] = static_cast<std::int32_t>(visit_.size());
    visit_.push_back({f, below, next});
    next += static_cast<std::size_t>(front.stride) * below.size();
    entries_updated_ += 2 * static_cast<std::int64_t>(front.stride) * front.pivots;
  }
  if (w_.size() < next) w_.resize(next);
}

void TreeDowndate::visit(const Visit& at, const FactorStorage& factor, bool top) {
  start_bonds(at);
  downdate(at, factor, top);
  hand_up(at);
}

/// The vectors of the bonds that meet this front first.
void TreeDowndate::start_bonds(const Visit& at) {
  const Front& front = tree_.front[at.f];
  const auto boundary = tree_.boundary(at.f);
  for (int j = at.bonds.end - 1; j >= at.bonds.begin && bonds_.owner[sorted_[j]] == at.f; --j) {
    double* const w = w_.data() + at.w + static_cast<std::size_t>(j - at.bonds.begin) * front.stride;
    const auto rows = bonds_.rows(sorted_[j]);
    const auto values = bonds_.values(sorted_[j]);
    for (int i = 0; i < bonds_.width; ++i) {
      if (values[i] == 0) continue;  // its row is none of the bond's
      const std::ptrdiff_t row =
          rows[i] < front.first + front.pivots
              ? rows[i] - front.first
              : front.pivots + (std::ranges::lower_bound(boundary, rows[i]) - boundary.begin());
      w[row] += values[i];
    }
  }
}

void TreeDowndate::downdate(const Visit& at, const FactorStorage& factor, bool top) {
  const Front& front = tree_.front[at.f];
  // a copy: neighbours in slack_ are other threads'
  std::array<double, kMost> slack{};
  std::copy(slack_.begin() + at.bonds.begin, slack_.begin() + at.bonds.end, slack.begin());
  if (top && front.entries() * at.bonds.size() >= kLeastShared) {
    downdate_together(at, factor, slack.data());
  } else {
    kernels_.downdate(block_of(tree_, at.f, factor.entries.data()), factor.entries.data() + front.block,
                      factor.diagonal.data() + front.first, factor.inverse.data() + front.first,
                      w_.data() + at.w, at.bonds.size(), slack.data());
  }
  std::copy_n(slack.begin(), at.bonds.size(), slack_.begin() + at.bonds.begin);
}

/// The same as the kernel `downdate`, to the bit: some columns, then all rows below them at once, and so on. For one
/// thread, too, since what it works on stays in its cache.
void TreeDowndate::downdate_together(const Visit& at, const FactorStorage& factor, double* slack) {
  const Front& front = tree_.front[at.f];
  const FrontBlock block = block_of(tree_, at.f, factor.entries.data());
  double* const entries = factor.entries.data() + front.block;
  double* const w = w_.data() + at.w;
  const int count = at.bonds.size();
  for (int begin = 0; begin < front.pivots; begin += kColumnsTogether) {
    const int end = std::min(begin + kColumnsTogether, front.pivots);
    const int below = std::min(whole_rows(end), front.stride);
    kernels_.downdate_columns(block, entries, factor.diagonal.data() + front.first,
                              factor.inverse.data() + front.first, w, count, slack, begin, end, below,
                              steps_.data());
    const int share = std::min(kMostRows, share_of_rows(front.stride - below, scratch_.team().threads()));
    const int turns = (front.stride - below + share - 1) / share;
    scratch_.team().for_each(turns, [&](int turn, int) {
      const int first = below + turn * share;
      kernels_.downdate_rows(block, entries, w, count, begin, end, first,
                             std::min(first + share, front.stride), steps_.data());
    });
  }
}

/// What is left of the vectors goes to the parent, in whose columns nobody else writes; zeros stay.
void TreeDowndate::hand_up(const Visit& at) {
  const Front& front = tree_.front[at.f];
  double* w = w_.data() + at.w;
  if (front.parent >= 0) {
    const Visit& parent = visit_[place_[front.parent]];
    const std::int32_t stride = tree_.front[front.parent].stride;
    double* to =
        w_.data() + parent.w + static_cast<std::size_t>(at.bonds.begin - parent.bonds.begin) * stride;
    const std::int32_t* const row = tree_.parent_row.data() + front.rows;
    for (int j = 0; j < at.bonds.size(); ++j, to += stride) {
      const double* const left = w + static_cast<std::size_t>(j) * front.stride + front.pivots;
      for (int i = 0; i < front.boundary; ++i) to[row[i]] = left[i];
    }
  }
  std::fill_n(w, static_cast<std::size_t>(front.stride) * at.bonds.size(), 0.0);
}

}  // namespace crackle
