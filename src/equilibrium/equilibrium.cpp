#include "crackle/equilibrium/equilibrium.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "crackle/equilibrium/held_solver.hpp"
#include "crackle/equilibrium/referee.hpp"

namespace crackle {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// A threshold below this part of the largest finite one is slight.
constexpr double kSlightThreshold = 1e-4;
/// Thresholds whose largest is within these powers of two are left as they are.
constexpr int kMostExponent = 400;

}  // namespace

Equilibrium::Equilibrium(const Network& network, const EquilibriumOptions& options, PhaseTimes& times)
    : network_(network),
      options_(options),
      times_(times),
      broken_(network.bonds()),
      threshold_(network.bonds()) {}

Equilibrium::~Equilibrium() = default;

/// Ratios only order, and loads are scaled back: no ratio needs to leave double's range. -0 becomes 0.
void Equilibrium::scale_thresholds(std::span<const double> threshold) {
  double largest = 0;
  for (const double t : threshold) largest = t < kNever ? std::max(largest, t) : largest;
  scale_ = largest > 0 ? std::ilogb(largest) : 0;
  if (std::abs(scale_) < kMostExponent) scale_ = 0;
  const double small = kSlightThreshold * std::ldexp(largest, -scale_);
  slight_.clear();
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (!network_.can_stretch(e)) {
      threshold_[e] = kNever;
    } else {
      threshold_[e] = (scale_ == 0 ? threshold[e] : std::ldexp(threshold[e], -scale_)) + 0.0;
    }
    if (threshold_[e] < small) slight_.push_back(e);
  }
}

void Equilibrium::reset(std::span<const double> threshold) {
  assert(threshold.size() == threshold_.size());
  assert(std::ranges::all_of(threshold, [](double t) { return t >= 0; }));
  std::ranges::fill(broken_, std::uint8_t{0});
  scale_thresholds(threshold);
  intact_stiffness_ = 0;
  complaint_.clear();
  removed_.clear();
  suspicious_ = false;
  refereed_ = false;
  do_reset();
}

void Equilibrium::remove(BondId bond) {
  assert(bond >= 0 && bond < network_.bonds() && broken_[bond] == 0);
  broken_[bond] = 1;
  threshold_[bond] = kNever;
  ++counts_.breaks;
  removed_.push_back(bond);
  if (refereed_) {
    referee().remove(bond);
    if (HeldFactor* own = held_factor()) own->follow(bond);
  } else {
    do_remove(bond);
  }
}

void Equilibrium::settle() {
  suspicious_ = false;
  if (refereed_) {
    refereed_ = false;
    do_reset();
    do_resume(removed_);
  }
  do_settle();
}

void Equilibrium::resume(std::span<const double> threshold, std::span<const BondId> bonds,
                         double intact_stiffness) {
  reset(threshold);
  for (const BondId e : bonds) {
    assert(broken_[e] == 0);
    broken_[e] = 1;
    threshold_[e] = kNever;
  }
  intact_stiffness_ = intact_stiffness;
  removed_.assign(bonds.begin(), bonds.end());
  do_resume(bonds);
  settle();
}

std::vector<double> Equilibrium::forces() {
  return refereed_ ? referee().forces() : do_forces();
}

std::vector<double> Equilibrium::do_forces() {
  const auto u = do_displacements();
  std::vector<double> force(broken_.size(), 0.0);
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (broken_[e] == 0) force[e] = network_.stiffness[e] * elongation(network_, e, u);
  }
  return force;
}

State Equilibrium::find_critical(Critical& next) {
  const State state = refereed_ ? ask_referee(next) : look(next);
  if (refereed_) {
    counts_.refereed += state == State::carrying ? 1 : 0;
    complaint_ = referee().complaint();
    intact_stiffness_ = referee().intact_stiffness();
  }
  if (state == State::held) {
    ++counts_.held;
    counts_.largest_left = std::max(counts_.largest_left, next.stiffness / intact_stiffness_);
  }
  // one and the same number, however a strategy comes to it
  if (state == State::carrying && removed_.empty()) next.stiffness = intact_stiffness_;
  if (state == State::carrying && scale_ != 0) next.load = std::ldexp(next.load, scale_);
  return state;
}

std::span<const double> Equilibrium::displacements() {
  return refereed_ ? referee().displacements() : do_displacements();
}

State Equilibrium::scan(std::span<const double> u, Critical& next) {
  ratio_.resize(threshold_.size());
  const bool carries = scan_ratios(network_, threshold_, u, options_.break_on, ratio_, next);
  return carries ? State::carrying : State::failed;
}

bool Equilibrium::has_failed(double stiffness) {
  const bool first = intact_stiffness_ == 0;
  const double whole = first ? network_.plate_diagonal : intact_stiffness_;
  if (!(stiffness > kRefereedStiffness * whole)) return true;
  if (first) intact_stiffness_ = stiffness;
  return false;
}

double Equilibrium::smallest_pivot() {
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace crackle
