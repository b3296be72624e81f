#include "crackle/equilibrium/tree/tree_response.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

#include "crackle/equilibrium/tree/tree_predictor.hpp"

namespace crackle {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Bonds of a network that is followed so: a break costs bonds times breaks, a factor's grows with the bonds' root.
constexpr BondId kMostBonds = 900;
/// Columns that a sample has room for, as a part of the bonds.
constexpr int kBondsPerColumn = 2;
/// Breaks that are followed before the state is summed afresh.
constexpr std::size_t kMostAhead = 16;

/// G0 is made by a factor in double. What a larger defect says of its entries' error is too much for ties.
constexpr double kMostDefect = 1e-13;
/// Errors are taken to be so many times what was measured: of one state for those before it, of columns for their sum.
constexpr double kSafety = 3;
/// F is known so well, or the state isn't used.
constexpr double kAgreement = 1e-10;
/// The same of the stretch of the bond that breaks.
constexpr double kKnown = 1e-9;
/// sqrt(k) / threshold is at most this and at least its inverse: products of two are in double's range.
constexpr double kMostPerStretch = 1e100;
/// A larger trace says that some motion is hardly held, where pivots have to be looked at.
constexpr double kMostTrace = 1e6;

/// Breaks that a sample may have before a factor goes on.
int room_for(const Network& network) {
  return network.stretchable / kBondsPerColumn + 2 * static_cast<int>(kMostAhead);
}

}  // namespace

bool TreeResponse::is_worthwhile(const Network& network) {
  return network.stretchable > 0 && network.stretchable <= kMostBonds;
}

TreeResponse::TreeResponse(const Network& network, IntactResponse intact, const TreeKernels& kernels,
                           BreakOn break_on)
    : network_(network),
      kernels_(kernels),
      magnitude_(break_on == BreakOn::magnitude),
      intact_(std::move(intact)),
      columns_(kernels, intact_.gram.data(), network.stretchable, intact_.size, room_for(network)),
      stretch_(intact_.size),
      before_(intact_.size),
      per_stretch_(intact_.size),
      broken_(intact_.size),
      work_(std::max(intact_.size, intact_.unknowns)) {
  const auto room = static_cast<std::size_t>(room_for(network));
  for (auto* each : {&factor_, &weight_}) each->resize(room);
  for (auto* each : {&row_, &response_}) each->resize(room);
  followed_.reserve(kMostAhead);
  verified_.reserve(kMostAhead);
}

bool TreeResponse::is_sound() const {
  return intact_.defect <= kMostDefect;
}

bool TreeResponse::reset(std::span<const double> threshold) {
  bool fits = true;
  for (std::size_t e = 0; e < intact_.bond.size(); ++e) {
    const double root = intact_.root[e];
    const double t = threshold[intact_.bond[e]];
    per_stretch_[e] = root / t;
    fits =
        fits && (t == kNever || (per_stretch_[e] > 1 / kMostPerStretch && per_stretch_[e] < kMostPerStretch));
  }
  std::ranges::fill(broken_, 0.0);
  std::ranges::copy(intact_.stretch, stretch_.begin());
  columns_.clear();
  plate_ = intact_.bent;
  trace_ = 0;
  carried_ = 0;
  lost_ = false;
  loose_ = false;
  verified_.clear();
  return fits;
}

ResponseBonds TreeResponse::state() {
  return {stretch_.data(), per_stretch_.data(), broken_.data()};
}

ResponseResult TreeResponse::next(double least_stiffness) {
  verified_.clear();
  if (lost_) return is_failed_by_last(least_stiffness) ? ResponseResult::failed : ResponseResult::lost;
  if (!(1 / plate_ > least_stiffness)) return ResponseResult::failed;
  followed_.clear();
  first_ = columns_.count();
  std::ranges::copy(stretch_, before_.begin());
  double largest =
      kernels_.products(per_stretch_.data(), stretch_.data(), intact_.size, magnitude_, work_.data());
  while (followed_.size() < kMostAhead && choose(largest, least_stiffness)) {
    compute_column(followed_.back());
    if (lost_) break;
    largest = apply();
  }
  verify();
  return verified_.empty() ? ResponseResult::lost : ResponseResult::found;
}

/// 1/F' = 1/F + s^2 / slack of the break that leaves little.
bool TreeResponse::is_failed_by_last(double least_stiffness) const {
  if (!loose_) return false;
  const double slack = columns_.slack(columns_.count());
  if (!(slack > 0)) return true;
  const double s = stretch_[columns_.number(columns_.count())];
  const double bent = plate_ + s * s / slack;
  return !(1 / bent > least_stiffness);
}

/// The bond that breaks in the state followed last; false: none that is sure.
bool TreeResponse::choose(double largest, double least_stiffness) {
  if (!(1 / plate_ > least_stiffness)) return false;
  lost_ = !(largest > 0 && largest < kNever) || trace_ > kMostTrace;
  if (lost_) return false;
  const double tied = least_tied(largest);
  const ResponseChoice choice = kernels_.response.choose(state(), intact_.size, largest, tied, magnitude_);
  const int j = choice.first;
  const double root = intact_.root[j];
  const Nothing<double> nothing(plate_, 1);
  lost_ = !nothing.is_less_than_force(root * std::abs(stretch_[j]), root * root);
  if (lost_) return false;
  double margin = std::min(choice.margin, kKnown * std::abs(stretch_[j]));
  if (choice.equal > 1) margin = std::min(margin, margin_of_equals(largest, tied));
  followed_.push_back({j, largest, margin, plate_, trace_, carried_, 0});
  return true;
}

/// All bonds whose ratio is the largest, to the last bit, have to stay tied.
double TreeResponse::margin_of_equals(double largest, double tied) const {
  double steepest = 0;
  for (std::size_t e = 0; e < intact_.bond.size(); ++e) {
    const double ratio = per_stretch_[e] * (magnitude_ ? std::abs(stretch_[e]) : stretch_[e]);
    if (ratio == largest) steepest = std::max(steepest, per_stretch_[e]);
  }
  return (largest - tied) / (2 * steepest);
}

/// Of the bond that breaks, and its slack; lost_: the state after the break is not for this.
void TreeResponse::compute_column(Followed& last) {
  last.slack = columns_.compute(last.number, state());
  loose_ = !(last.slack >= kLeastPredictedSlack);
  factor_[columns_.count()] = loose_ ? 0 : stretch_[last.number] / last.slack;
  lost_ = loose_ || columns_.full();
}

/// The break happens. Returns the largest ratio after it.
double TreeResponse::apply() {
  const int at = columns_.count();
  const int j = columns_.number(at);
  per_stretch_[j] = 0;
  broken_[j] = 1;
  plate_ += stretch_[j] * factor_[at];
  const ResponseChange change = kernels_.response.apply(columns_.get(), factor_[at], state(), magnitude_);
  trace_ += change.column / columns_.slack(at) + (1 - columns_.slack(at));
  carried_ = std::sqrt(change.stretch);
  row_[at] = intact_.column(j);
  columns_.keep();
  return change.largest;
}

/// The state followed last is summed afresh, which tells how far those up to it can be off.
void TreeResponse::verify() {
  if (followed_.empty()) return;
  double square = 0;
  double bent = intact_.bent;
  for (int h = 0; h < columns_.count(); ++h) {
    const double c = stretch_[columns_.number(h)];
    weight_[h] = c;
    square += c * c;
    bent += c * intact_.stretch[columns_.number(h)];
  }
  const double change = kernels_.response.recompute(row_.data(), weight_.data(), columns_.count(),
                                                    intact_.stretch.data(), stretch_.data(), intact_.size);
  carried_ = std::sqrt(square);
  bool known = std::abs(bent - plate_) <= kAgreement * bent;
  plate_ = bent;
  for (const Followed& followed : followed_) {
    const double of_gram = intact_.defect * (1 + followed.carried);
    const double left = kSafety * (std::sqrt(change) + of_gram);
    const double error = left * (1 + std::sqrt(followed.trace));
    known = known && error <= followed.margin && left * followed.carried <= kAgreement * followed.plate;
    if (!known) {
      lost_ = true;
      loose_ = false;
      return;
    }
    verified_.push_back(
        {intact_.bond[followed.number], 1 / followed.ratio, 1 / followed.plate, followed.slack});
  }
}

/// u = start and the sum of K0^-1 g of those that have broken times weight_.
void TreeResponse::combine(int breaks, const double* start, std::span<double> u) {
  for (int h = 0; h < breaks; ++h) response_[h] = intact_.motion(columns_.number(h));
  (void)kernels_.response.recompute(response_.data(), weight_.data(), breaks, start, work_.data(),
                                    intact_.unknowns);
  std::copy_n(work_.begin(), u.size(), u.begin());
}

void TreeResponse::get_displacements(int state, std::span<double> u) {
  const int breaks = first_ + state;
  for (int i = 0; i < breaks; ++i) {
    const int number = columns_.number(i);
    weight_[i] = before_[number];
    for (int h = first_; h < breaks; ++h) weight_[i] += factor_[h] * columns_.entry(h, number);
  }
  combine(breaks, intact_.at_rest.data(), u);
}

/// u = K^-1 g of that bond: pulled apart, it moves all that it holds.
bool TreeResponse::get_free_motion(std::span<double> u) {
  if (!loose_) return false;
  const int breaks = columns_.count();
  for (int h = 0; h < breaks; ++h) weight_[h] = columns_.entry(breaks, columns_.number(h));
  combine(breaks, intact_.motion(columns_.number(breaks)), u);
  const double plate = u[network_.plate];
  for (double& value : u) value /= plate;
  return std::abs(plate) > 0;
}

}  // namespace crackle
