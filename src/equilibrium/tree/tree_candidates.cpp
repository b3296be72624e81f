#include "crackle/equilibrium/tree/tree_candidates.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>

#include "crackle/base/aligned.hpp"

namespace crackle {

namespace {

constexpr double kWiden = 1.5;  // how much faster candidates are collected when too few were found
constexpr double kWidest = 0.01;
constexpr double kNarrowest = 0.999;
/// Ratios in single precision are compared with a little less: they, and this, are rounded.
constexpr double kBelow = 1 - 1e-5;

}  // namespace

void TreeCandidates::reset() {
  ranked_.clear();
  keep_ = 0;
}

void TreeCandidates::thin_out() {
  if (bond_.size() <= wanted_) return;
  ratio_.clear();
  for (const BondId e : bond_) ratio_.push_back(search_.ratio(e, 0));
  std::ranges::nth_element(ratio_, ratio_.begin() + static_cast<std::ptrdiff_t>(wanted_), std::greater{});
  const double least = std::min(ratio_[wanted_], least_tied(std::ranges::max(ratio_)));
  std::erase_if(bond_, [&](BondId e) { return search_.ratio(e, 0) < least; });
}

void TreeCandidates::fill_ratios(const Prediction& prediction) {
  if (prediction.states == 0) thin_out();
  stride_ = prediction.groups() * kLanes;
  ratio_.resize(bond_.size() * stride_);
  for (std::size_t i = 0; i < bond_.size(); ++i) {
    const std::span ratio = std::span(ratio_).subspan(i * stride_, stride_);
    search_.ratios(bond_[i], prediction.groups(), ratio.data());
    forget_broken(prediction, bond_[i], ratio);
  }
}

void TreeCandidates::fill_single_ratios(const Prediction& prediction) {
  alignas(AlignedAllocator<float>::kCacheLine) std::array<float, kMostStates> least;
  least.fill(std::numeric_limits<float>::infinity());
  for (int s = 0; s < prediction.states; ++s) {
    least[s] = static_cast<float>(kBelow * prediction.ratio[s]);
  }
  stride_ = search_.single_lanes();
  ratio_.resize(bond_.size() * stride_);
  contender_.clear();
  for (std::size_t i = 0; i < bond_.size(); ++i) {
    const std::span ratio = std::span(ratio_).subspan(i * stride_, stride_);
    if (search_.single_ratios(bond_[i], least, ratio)) contender_.push_back(i);
    forget_broken(prediction, bond_[i], ratio);
  }
}

/// 0 once a bond is predicted to be broken.
void TreeCandidates::forget_broken(const Prediction& prediction, BondId e, std::span<double> ratio) {
  for (int s = 0; s + 1 < prediction.states; ++s) {
    if (prediction.bond[s] == e) std::ranges::fill(ratio.subspan(s + 1), 0.0);
  }
}

void TreeCandidates::find_contenders(int state, double ratio, std::vector<BondId>& contenders) const {
  contenders.clear();
  for (const std::size_t i : contender_) {
    // not a number: it may
    if (!(ratio_[i * stride_ + state] + search_.margin(bond_[i], state) < kBelow * ratio))
      contenders.push_back(bond_[i]);
  }
  std::ranges::sort(contenders);  // candidates come in the order of the threads
}

VerifiedBreak TreeCandidates::largest(int state) const {
  VerifiedBreak found;
  for (std::size_t i = 0; i < bond_.size(); ++i) {
    found.ratio = std::max(found.ratio, ratio_[i * stride_ + state]);
  }
  for (std::size_t i = 0; i < bond_.size(); ++i) {
    const bool tied = ratio_[i * stride_ + state] >= least_tied(found.ratio);
    if (tied && (found.bond < 0 || bond_[i] < found.bond)) found.bond = bond_[i];
  }
  return found;
}

void TreeCandidates::rank(const Prediction& prediction, int last, double last_ratio) {
  ranked_.clear();
  for (std::size_t i = 0; i < bond_.size(); ++i) {
    const double* ratio = ratio_.data() + i * stride_;
    double best = ratio[last] / last_ratio;
    for (int s = last + 1; s < prediction.states; ++s) best = std::max(best, ratio[s] / prediction.ratio[s]);
    if (best > 0) ranked_.emplace_back(best, bond_[i]);
  }
  const std::size_t kept = std::min(ranked_.size(), wanted_);
  const auto end = ranked_.begin() + static_cast<std::ptrdiff_t>(kept);
  if (kept < ranked_.size()) std::ranges::nth_element(ranked_, end, std::greater{});
  std::sort(ranked_.begin(), end, std::greater{});
  if (kept == wanted_) {
    keep_ = std::min(kNarrowest, ranked_[kept - 1].first);
  } else {
    keep_ = std::max(kWidest, 1 - kWiden * (1 - keep_));
  }
  ranked_.resize(kept);
}

}  // namespace crackle
