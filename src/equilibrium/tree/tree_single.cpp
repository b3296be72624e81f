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

/// A ratio that no bond reaches; times the largest limit it is still in range.
constexpr double kNeverReached = 1e24;

/// The base of a sum is raised by more than its own rounding, and the sum's: a stretch is not found too small by them.
constexpr double kRaised = 16 * kRounding;
/// Rounding of g . d' itself, over the sum of |g_i| |d'|_max; and of a base that the difference outweighs.
constexpr double kSumError = 6 * kRounding + kRaised;

/// Bonds that are looked at in one go, so that their unknowns are still in the first-level cache.
constexpr std::int32_t kBondsTogether = 256;
/// Bonds whose base is found by one thread in one go.
constexpr std::int32_t kBasesTogether = 16'384;

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
                       const TreeKernels& kernels, bool magnitude, int lanes, TreeScratch& scratch)
    : tree_(tree),
      bonds_(bonds),
      factor_(factor),
      kernels_(kernels),
      scratch_(scratch),
      block_(tree.fronts()),
      weight_(tree.fronts()),
      path_weight_(tree.fronts()),
      u0_(tree.positions()),
      base_(bonds.by_owner.size()),
      base_single_(bonds.by_owner.size()),
      value_(bonds.value.begin(), bonds.value.end()),
      limit_(bonds.by_owner.size()),
      x_(static_cast<std::size_t>(tree.positions()) * lanes),
      given_(tree.fronts(), 0),
      member_(scratch.team().threads()),
      share_(scratch.parts().part.size() + 1),
      lanes_(lanes),
      magnitude_(magnitude) {
  assert(lanes == kLanes || lanes == kMostStates);
  std::int32_t tallest = 0;
  std::int32_t widest = 0;
  for (const Front& front : tree.front) {
    tallest = std::max(tallest, front.stride);
    widest = std::max(widest, front.pivots);
  }
  entries_.resize(lay_out(tree, block_));
  for (Member& member : member_) {
    member.column.resize(tallest);
    member.sum.resize(widest);
    member.found.resize(kBondsTogether + 1);
  }
  measure_values();
}

void TreeSingle::measure_values() {
  const std::vector<double>& value = bonds_.value;
  values_in_range_ = std::ranges::all_of(value, is_moderate);
  for (std::size_t i = 0; i < value.size(); i += bonds_.width) {
    double sum = 0;
    for (int j = 0; j < bonds_.width; ++j) sum += std::abs(value[i + j]);
    largest_value_ = std::max(largest_value_, sum);
  }
}

double TreeSingle::bytes(const SeparatorTree& tree) {
  return static_cast<double>(sizeof(float)) *
         (static_cast<double>(tree.block_entries) + static_cast<double>(tree.positions()) * kMostStates);
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

SingleBlock TreeSingle::block(FrontId f) const {
  const Front& front = tree_.front[f];
  return {entries_.data() + block_[f], tree_.row.data() + front.rows, height_of(front), front.pivots,
          front.boundary};
}

void TreeSingle::refresh() {
  std::ranges::fill(u0_, 0.0);
  u0_.back() = *factor_.inverse_pivots(tree_.fronts() - 1);
  const TreeParts& parts = scratch_.parts();
  for (std::size_t i = parts.top.size(); i-- > 0;) settle(parts.top[i], member_.front());
  scratch_.team().for_each(static_cast<int>(parts.part.size()), [&](int turn, int member) {
    for (FrontId f = parts.part[turn].root; f >= parts.part[turn].first; --f) settle(f, member_[member]);
  });
  seen_ = factor_.changes();
  // ... and, generously, the rounding of this sum and of D
  error_per_size_ =
      std::sqrt(*std::ranges::max_element(path_weight_)) * (1 + 1e-6) + kSumError * largest_value_;
  const auto bonds = static_cast<std::int32_t>(base_.size());
  scratch_.team().for_each((bonds + kBasesTogether - 1) / kBasesTogether, [&](int turn, int) {
    find_base(turn * kBasesTogether, std::min(bonds, (turn + 1) * kBasesTogether));
  });
}

/// u0 of a front's pivots, and what of its block has changed.
void TreeSingle::settle(FrontId f, Member& member) {
  const Front& front = tree_.front[f];
  const bool changed = factor_.changed_at(f) > seen_;
  kernels_.settle(factor_.block(f), u0_.data() + front.first, u0_.data(), member.column.data(),
                  changed ? entries_.data() + block_[f] : nullptr, member.sum.data());
  if (changed) {
    const double* inverse = factor_.inverse_pivots(f);
    double weight = 0;
    for (int c = 0; c < front.pivots; ++c) {
      if (inverse[c] == 0) continue;  // pinned: D is 0
      const double gamma = (longest_chain(front.pivots + front.boundary - c) + 3) * kRounding;
      const double error = 2 * gamma * (0.5 + member.sum[c]);
      weight += error * error / inverse[c];
    }
    weight_[f] = weight;
  }
  path_weight_[f] = weight_[f] + (front.parent < 0 ? 0 : path_weight_[front.parent]);
}

void TreeSingle::find_base(std::int32_t begin, std::int32_t end) {
  const std::size_t first = static_cast<std::size_t>(begin) * bonds_.width;
  const Position* row = bonds_.row.data() + first;
  const double* value = bonds_.value.data() + first;
  for (std::int32_t place = begin; place < end; ++place, row += bonds_.width, value += bonds_.width) {
    double stretch = 0;
    for (int i = 0; i < bonds_.width; ++i) stretch += value[i] * u0_[row[i]];
    base_[place] = stretch;
    // Away from 0; where only tension counts, upwards.
    const double raise = magnitude_ ? stretch : std::abs(stretch);
    base_single_[place] = static_cast<float>(stretch + kRaised * raise);
  }
}

/// Fronts at the top share their lanes among threads; then subtrees side by side.
void TreeSingle::run(std::span<const std::vector<FrontId>> fronts, std::span<const double> cut,
                     std::vector<BondId>& candidates) {
  assert(fronts.size() * kLanes <= static_cast<std::size_t>(lanes_));
  guess_.fill(kGuess * *std::max_element(guess_.begin(), guess_.begin() + lanes_));
  for (Share& share : share_) {
    share.most.fill(0);
    share.candidates.clear();
  }
  for (int s = 0; s < lanes_; ++s) cut_[s] = static_cast<float>(std::min(cut[s], kNeverReached));
  note_given(fronts);
  const TreeParts& parts = scratch_.parts();
  if (parts.part.empty()) {
    solve_subtree(0, tree_.fronts() - 1, member_.front(), share_.back());
  } else {
    for (std::size_t i = parts.top.size(); i-- > 0;) solve_together(parts.top[i]);
    scratch_.team().for_each(static_cast<int>(parts.part.size()), [&](int turn, int member) {
      solve_subtree(parts.part[turn].first, parts.part[turn].root, member_[member], share_[turn]);
    });
  }
  gather(candidates);
}

void TreeSingle::note_given(std::span<const std::vector<FrontId>> fronts) {
  std::ranges::fill(given_, std::uint8_t{0});
  for (std::size_t g = 0; g < fronts.size(); ++g) {
    for (const FrontId f : fronts[g]) given_[f] = static_cast<std::uint8_t>(given_[f] | 1U << g);
  }
}

/// Right-hand sides that nobody has given are zero.
void TreeSingle::clear_others(FrontId f) {
  const Front& front = tree_.front[f];
  float* pivots = x_.data() + static_cast<std::size_t>(front.first) * lanes_;
  for (int g = 0; g * kLanes < lanes_; ++g) {
    if ((given_[f] >> g & 1U) != 0) continue;
    for (int i = 0; i < front.pivots; ++i) std::fill_n(pivots + i * lanes_ + g * kLanes, kLanes, 0.0F);
  }
}

void TreeSingle::solve_front(FrontId f, Share& share) {
  clear_others(f);
  kernels_.backward_single(block(f), x_.data() + static_cast<std::size_t>(tree_.front[f].first) * lanes_,
                           x_.data(), lanes_, 0, lanes_, share.most.data());
}

/// A front at the top: a group of lanes for each of two threads, if there are two.
void TreeSingle::solve_together(FrontId f) {
  Share& share = share_.back();
  if (lanes_ == kLanes || !scratch_.shares(tree_.front[f].entries() * lanes_)) {
    solve_front(f, share);
  } else {
    clear_others(f);
    scratch_.team().for_each(lanes_ / kLanes, [&](int group, int) {
      kernels_.backward_single(block(f), x_.data() + static_cast<std::size_t>(tree_.front[f].first) * lanes_,
                               x_.data(), lanes_, group * kLanes, (group + 1) * kLanes, share.most.data());
    });
  }
  find_in(f, f, member_.front(), share);
}

void TreeSingle::solve_subtree(FrontId first, FrontId last, Member& member, Share& share) {
  for (FrontId f = last; f >= first; --f) {  // last: of those whose bonds have not been looked at
    solve_front(f, share);
    if (f > first && bonds_.start[last + 1] - bonds_.start[f] < kBondsTogether) continue;
    find_in(f, last, member, share);
    last = f - 1;
  }
}

/// Looks at the bonds of fronts first .. last.
void TreeSingle::find_in(FrontId first, FrontId last, Member& member, Share& share) const {
  const auto find = magnitude_ ? kernels_.find_single_magnitude : kernels_.find_single_tension;
  for (std::int32_t begin = bonds_.start[first]; begin < bonds_.start[last + 1]; begin += kBondsTogether) {
    const std::size_t entry = static_cast<std::size_t>(begin) * bonds_.width;
    const SingleBonds together{bonds_.row.data() + entry,
                               value_.data() + entry,
                               base_single_.data() + begin,
                               limit_.data() + begin,
                               std::min(bonds_.start[last + 1] - begin, kBondsTogether),
                               bonds_.width};
    const int hits = find(together, x_.data(), lanes_, cut_.data(), guess_.data(), member.found.data());
    for (int i = 0; i < hits; ++i) share.candidates.push_back(bonds_.by_owner[begin + member.found[i]]);
  }
}

/// Of all parts. Where the margins were guessed too narrow, every bond is looked at again.
void TreeSingle::gather(std::vector<BondId>& candidates) {
  if (!guessed_well()) {
    for (Share& share : share_) share.candidates.clear();
    find_in(0, tree_.fronts() - 1, member_.front(), share_.back());
  }
  candidates.clear();
  for (const Share& share : share_)
    candidates.insert(candidates.end(), share.candidates.begin(), share.candidates.end());
}

/// The margins, now that the differences are known. Whether bonds were looked for with no less; guess_ becomes what they
/// need.
bool TreeSingle::guessed_well() {
  bool well = true;
  for (int s = 0; s < lanes_; ++s) {
    float most = 0;
    for (const Share& share : share_)
      most = share.most[s] > most || std::isnan(share.most[s]) ? share.most[s] : most;  // which then stays
    margin_[s] = error_per_size_ * most;
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
