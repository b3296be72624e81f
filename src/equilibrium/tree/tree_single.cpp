#include "crackle/equilibrium/tree/tree_single.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace crackle {

namespace {

constexpr double kRounding = 0x1p-24;  // half of a float's last place

/// Between these, products of a few numbers neither overflow nor lose digits to underflow in single precision.
constexpr double kLeast = 1e-12;
constexpr double kLargest = 1e12;

/// The base of a sum is raised by more than its own rounding, and the sum's: a stretch is not found too small by them.
constexpr double kRaised = 16 * kRounding;
/// Rounding of g . d' itself, over the sum of |g_i| |d'|_max; and of a base that the difference outweighs.
constexpr double kSumError = 6 * kRounding + kRaised;

/// States that need more memory (bytes) than a core's own cache holds are asked for ahead of their use.
constexpr std::size_t kOwnCache = std::size_t{1} << 20;

/// Bonds that are looked at in one go, so that their unknowns are still in the first-level cache.
constexpr std::int32_t kBondsTogether = 256;

/// A margin is guessed before the differences that it is made of are known: so much above the last pass's.
constexpr float kGuess = 2;

bool is_moderate(double value) {
  return value == 0 || !std::isfinite(value) || (std::abs(value) > kLeast && std::abs(value) < kLargest);
}

float rounded_up(double value) {
  return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

std::ptrdiff_t height_of(const Front& front) {
  return (front.pivots + front.boundary + kStrip - 1) / kStrip * kStrip;
}

/// Additions that a product takes part in at most, in a row of so many products: those of its part of the sum, of the
/// parts, and of the triangle that comes last.
int longest_chain(int products) {
  return std::min(products + 2, kSingleSum + products / kSingleSum + 3 + kMostSingleRows);
}

/// Where each front's block starts; returns what all of them take.
std::size_t lay_out(const SeparatorTree& tree, std::span<std::size_t> block) {
  std::size_t next = 0;
  for (FrontId f = 0; f < tree.fronts(); ++f) {
    const Front& front = tree.front[f];
    block[f] = next;
    next += SingleBlock::start(height_of(front), (front.pivots + kStrip - 1) / kStrip);
  }
  return next;
}

}  // namespace

TreeSingle::TreeSingle(const SeparatorTree& tree, const TreeBonds& bonds, const TreeFactor& factor,
                       const TreeKernels& kernels, bool magnitude, int lanes)
    : tree_(tree),
      bonds_(bonds),
      factor_(factor),
      kernels_(kernels),
      magnitude_(magnitude),
      lanes_(lanes),
      far_(static_cast<std::size_t>(tree.positions()) * lanes * sizeof(float) > kOwnCache),
      block_(tree.fronts()),
      weight_(tree.fronts()),
      path_weight_(tree.fronts()),
      u0_(tree.positions()),
      base_(bonds.by_owner.size()),
      base_single_(bonds.by_owner.size()),
      value_(bonds.value.begin(), bonds.value.end()),
      limit_(bonds.by_owner.size()),
      x_(static_cast<std::size_t>(tree.positions()) * lanes) {
  assert(lanes == kLanes || lanes == kMostStates);
  std::int32_t tallest = 0;
  std::int32_t widest = 0;
  for (FrontId f = 0; f < tree.fronts(); ++f) {
    tallest = std::max(tallest, tree.front[f].stride);
    widest = std::max(widest, tree.front[f].pivots);
  }
  entries_.resize(lay_out(tree, block_));
  column_.resize(tallest);
  sum_.resize(widest);
  found_.resize(kBondsTogether + 1);
  for (std::size_t i = 0; i < bonds.value.size(); i += bonds.width) {
    double sum = 0;
    for (int j = 0; j < bonds.width; ++j) {
      sum += std::abs(bonds.value[i + j]);
      values_in_range_ = values_in_range_ && is_moderate(bonds.value[i + j]);
    }
    largest_value_ = std::max(largest_value_, sum);
  }
}

double TreeSingle::bytes(const SeparatorTree& tree, int lanes) {
  return static_cast<double>(sizeof(float)) *
         (static_cast<double>(tree.block_entries) + static_cast<double>(tree.positions()) * lanes);
}

void TreeSingle::set_limits(std::span<const double> limit) {
  assert(limit.size() == limit_.size());
  guess_.fill(0);  // what is listed, and so what follows, doesn't depend on the samples before
  in_range_ = values_in_range_ &&
              std::ranges::all_of(limit, [](double each) { return each > 0 && is_moderate(each); });
  std::ranges::transform(limit, limit_.begin(), [](double each) { return static_cast<float>(each); });
}

void TreeSingle::set_broken(std::int32_t place) {
  limit_[place] = std::numeric_limits<float>::infinity();
}

void TreeSingle::refresh() {
  std::ranges::fill(u0_, 0.0);
  u0_.back() = *factor_.inverse_pivots(tree_.fronts() - 1);
  double most = 0;  // on a path
  for (FrontId f = tree_.fronts() - 1; f >= 0; --f) {
    settle(f);
    const FrontId parent = tree_.front[f].parent;
    path_weight_[f] = weight_[f] + (parent < 0 ? 0 : path_weight_[parent]);
    most = std::max(most, path_weight_[f]);
  }
  seen_ = factor_.changes();
  // ... and, generously, the rounding of this sum and of D
  error_per_size_ = std::sqrt(most) * (1 + 1e-6) + kSumError * largest_value_;
  find_base();
}

/// u0 of a front's pivots, and what of its block has changed.
void TreeSingle::settle(FrontId f) {
  const Front& front = tree_.front[f];
  const bool changed = factor_.changed_at(f) > seen_;
  kernels_.settle(factor_.block(f), u0_.data() + front.first, u0_.data(), column_.data(),
                  changed ? entries_.data() + block_[f] : nullptr, sum_.data());
  if (!changed) return;
  const double* inverse = factor_.inverse_pivots(f);
  double weight = 0;
  for (int c = 0; c < front.pivots; ++c) {
    if (inverse[c] == 0) continue;  // pinned: D is 0
    const double gamma = (longest_chain(front.pivots + front.boundary - c) + 3) * kRounding;
    const double error = 2 * gamma * (0.5 + sum_[c]);
    weight += error * error / inverse[c];
  }
  weight_[f] = weight;
}

void TreeSingle::find_base() {
  const Position* row = bonds_.row.data();
  const double* value = bonds_.value.data();
  for (std::size_t place = 0; place < base_.size(); ++place, row += bonds_.width, value += bonds_.width) {
    double stretch = 0;
    for (int i = 0; i < bonds_.width; ++i) stretch += value[i] * u0_[row[i]];
    base_[place] = stretch;
    // Away from 0; where only tension counts, upwards.
    const double raise = magnitude_ ? stretch : std::abs(stretch);
    base_single_[place] = static_cast<float>(stretch + kRaised * raise);
  }
}

void TreeSingle::run(std::span<const std::vector<FrontId>> fronts, std::span<const double> cut,
                     std::vector<BondId>& candidates) {
  assert(fronts.size() * kLanes <= static_cast<std::size_t>(lanes_));
  candidates.clear();
  guess_.fill(kGuess * *std::max_element(guess_.begin(), guess_.begin() + lanes_));
  most_.fill(0);
  for (int s = 0; s < lanes_; ++s) cut_[s] = static_cast<float>(cut[s]);
  std::array<std::size_t, kMostGroups> left{};
  for (std::size_t g = 0; g < fronts.size(); ++g) left[g] = fronts[g].size();
  FrontId last = tree_.fronts() - 1;  // of those whose bonds have not been looked at
  for (FrontId f = last; f >= 0; --f) {
    solve_front(f, fronts, left);
    if (f > 0 && bonds_.start[last + 1] - bonds_.start[f] < kBondsTogether) continue;
    find_in(f, last, candidates);
    last = f - 1;
  }
  if (!guessed_well()) {
    candidates.clear();
    find_in(0, tree_.fronts() - 1, candidates);
  }
}

void TreeSingle::solve_front(FrontId f, std::span<const std::vector<FrontId>> fronts,
                             std::span<std::size_t> left) {
  const Front& front = tree_.front[f];
  float* pivots = x_.data() + static_cast<std::size_t>(front.first) * lanes_;
  for (int g = 0; g * kLanes < lanes_; ++g) {
    if (g < std::ssize(fronts) && left[g] > 0 && fronts[g][left[g] - 1] == f) {
      --left[g];
    } else {
      for (int i = 0; i < front.pivots; ++i) std::fill_n(pivots + i * lanes_ + g * kLanes, kLanes, 0.0F);
    }
  }
  kernels_.backward_single({entries_.data() + block_[f], tree_.row.data() + front.rows, height_of(front),
                            front.pivots, front.boundary},
                           pivots, x_.data(), lanes_, most_.data());
}

/// Looks at the bonds of fronts first .. last.
void TreeSingle::find_in(FrontId first, FrontId last, std::vector<BondId>& candidates) {
  const auto find = magnitude_ ? kernels_.find_single_magnitude : kernels_.find_single_tension;
  for (std::int32_t begin = bonds_.start[first]; begin < bonds_.start[last + 1]; begin += kBondsTogether) {
    const std::size_t entry = static_cast<std::size_t>(begin) * bonds_.width;
    const SingleBonds block{bonds_.row.data() + entry,
                            value_.data() + entry,
                            base_single_.data() + begin,
                            limit_.data() + begin,
                            std::min(bonds_.start[last + 1] - begin, kBondsTogether),
                            bonds_.width};
    const int hits = find(block, x_.data(), lanes_, cut_.data(), guess_.data(), found_.data());
    for (int i = 0; i < hits; ++i) candidates.push_back(bonds_.by_owner[begin + found_[i]]);
  }
}

/// The margins, now that the differences are known. Whether bonds were looked for with no less; guess_ becomes what they
/// need.
bool TreeSingle::guessed_well() {
  bool well = true;
  for (int s = 0; s < lanes_; ++s) {
    margin_[s] = error_per_size_ * most_[s];
    const float needed = rounded_up(margin_[s]);
    well = well && needed <= guess_[s];  // what is not a number was not guessed
    guess_[s] = needed;
  }
  return well;
}

bool TreeSingle::ratios(std::int32_t place, std::span<const float> least, std::span<double> ratio) const {
  const std::size_t entry = static_cast<std::size_t>(place) * bonds_.width;
  const SingleForce bond{bonds_.row.data() + entry, value_.data() + entry, base_single_[place],
                         1 / limit_[place],         bonds_.width,          magnitude_};
  return kernels_.ratios_single(bond, x_.data(), lanes_, guess_.data(), least.data(), ratio.data());
}

double TreeSingle::stretch(std::int32_t place, int state) const {
  double sum = base_[place];
  for (int i = 0; i < bonds_.width; ++i) {
    const std::size_t at = static_cast<std::size_t>(place) * bonds_.width + i;
    sum += bonds_.value[at] * x_[static_cast<std::size_t>(bonds_.row[at]) * lanes_ + state];
  }
  return sum;
}

}  // namespace crackle
