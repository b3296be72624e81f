#include "crackle/equilibrium.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

#include "crackle/equilibrium_dense.hpp"
#include "crackle/equilibrium_ksp.hpp"
#include "crackle/equilibrium_quad.hpp"
#include "crackle/equilibrium_tree.hpp"
#include "crackle/error.hpp"

namespace crackle {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

template <class... Numbers>
std::string describe(const char* format, Numbers... numbers) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), format, static_cast<double>(numbers)...);
  return text.data();
}

/// ratio[e] = f_e / t_e, or its magnitude; 0 for what is below `smallest` elongation. Returns the largest.
template <int width, bool magnitude>
double fill_ratios(const Network& network, std::span<const double> threshold, std::span<const double> u,
                   double smallest, std::span<double> ratio) {
  const Dof* dof = network.bond_dof.data();
  const double* value = network.bond_value.data();
  double largest = 0;
  for (std::size_t e = 0; e < ratio.size(); ++e, dof += width, value += width) {
    double stretch = 0;
    for (int i = 0; i < width; ++i) stretch += value[i] * u[dof[i]];
    const double size = magnitude ? std::abs(stretch) : stretch;
    ratio[e] = size > smallest ? network.stiffness[e] * size / threshold[e] : 0;
    largest = std::max(largest, ratio[e]);
  }
  return largest;
}

}  // namespace

void Equilibrium::reset(std::span<const double> threshold) {
  std::ranges::fill(broken_, std::uint8_t{0});
  for (BondId e = 0; e < network_.bonds(); ++e)
    threshold_[e] = network_.can_stretch(e) ? threshold[e] : kNever;
  intact_stiffness_ = 0;
  complaint_.clear();
  removed_ = 0;
  suspicious_ = false;
  do_reset();
}

void Equilibrium::remove(BondId bond) {
  broken_[bond] = 1;
  threshold_[bond] = kNever;
  ++counts_.breaks;
  ++removed_;
  do_remove(bond);
}

void Equilibrium::settle() {
  suspicious_ = false;
  do_settle();
}

void Equilibrium::resume(std::span<const double> threshold, std::span<const BondId> bonds,
                         double intact_stiffness) {
  reset(threshold);
  for (const BondId e : bonds) {
    broken_[e] = 1;
    threshold_[e] = kNever;
  }
  intact_stiffness_ = intact_stiffness;
  removed_ = std::ssize(bonds);
  do_resume(bonds);
  settle();
}

std::vector<double> Equilibrium::forces() {
  const auto u = displacements();
  std::vector<double> force(broken_.size(), 0.0);
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (broken_[e] == 0) force[e] = network_.stiffness[e] * elongation(network_, e, u);
  }
  return force;
}

State Equilibrium::find_critical(Critical& next) {
  State state = search(next);
  if (knows_its_error()) return state;
  const bool due = options_.check_every > 0 && removed_ % options_.check_every == 0;
  if (state == State::carrying && due) state = double_check(next);
  if (state != State::carrying) return state;
  const bool looks = suspicious_ || iterates() || removed_ % kTrustEvery == 0 || is_tiny(next);
  return looks ? look_for_doubt(next) : state;
}

/// The bond is critical for its threshold rather than its force, which may be nothing but rounding. (Both 0: true.)
bool Equilibrium::is_tiny(const Critical& next) const {
  const double force = threshold_[next.bond] / next.load;
  return !(force > kTinyElongation * network_.stiffness[next.bond] / next.stiffness);
}

State Equilibrium::double_check(Critical& next) {
  r_.resize(static_cast<std::size_t>(network_.unknowns));
  ++counts_.checks;
  double error = backward_error(network_, broken_, displacements(), r_);
  if (!(error <= options_.check_bound)) {
    const State state = renew() ? search(next) : State::failed;
    if (state != State::carrying) return state;
    error = backward_error(network_, broken_, displacements(), r_);
  }
  counts_.largest_residual = std::max(counts_.largest_residual, error);
  if (error <= options_.check_bound) return State::carrying;
  complaint_ =
      describe("-equilibrium_check: even from scratch the solver leaves a backward error of %.2g, above %.2g",
               error, options_.check_bound);
  return State::unsolved;
}

State Equilibrium::look_for_doubt(Critical& next) {
  if (!is_doubtful(next)) return State::carrying;
  if (iterates()) {
    ++counts_.doubtful;
    if (counts_.first_doubtful == 0) counts_.first_doubtful = removed_ + 1;
    return State::carrying;
  }
  const State state = renew() ? search(next) : State::failed;
  if (state != State::carrying || !is_doubtful(next)) return state;
  complaint_ = describe(
      "bond %.0f is not the only one that may break next: forces are uncertain by %.1g of the load. "
      "Stiffnesses too "
      "far apart for double precision, or thresholds of 0, do that",
      next.bond, kForcePerResidual * counts_.loosest_residual);
  return State::unsolved;
}

/// True when, forces being as uncertain as the residual says, another bond may have the largest ratio. What a direct
/// solver leaves by rounding is not doubted: equal ratios and bonds without force have rules of their own.
bool Equilibrium::is_doubtful(const Critical& next) {
  r_.resize(static_cast<std::size_t>(network_.unknowns));
  const auto u = displacements();
  residual(network_, broken_, u, r_);
  const double norm = std::sqrt(std::inner_product(r_.begin(), r_.end(), r_.begin(), 0.0));
  counts_.loosest_residual = std::max(counts_.loosest_residual, norm);
  suspicious_ = !(norm <= kDoubtfulResidual);
  const double uncertain = kForcePerResidual * norm;
  const double critical_force = network_.stiffness[next.bond] * std::abs(elongation(network_, next.bond, u));
  if (!(critical_force > uncertain)) return true;
  if (!suspicious_ && !iterates()) return false;
  const auto ratio = [&](BondId e, double error) {
    const double stretch = elongation(network_, e, u);
    const double size = options_.break_on == BreakOn::magnitude ? std::abs(stretch) : stretch;
    const double force = network_.stiffness[e] * size + error;
    return force > 0 ? force / threshold_[e] : 0;
  };
  const double least = ratio(next.bond, -uncertain);
  for (BondId e = 0; e < network_.bonds(); ++e) {
    if (e == next.bond) continue;
    const double most = ratio(e, uncertain);
    if (most > least || (most == least && e < next.bond)) return true;
  }
  return false;
}

State Equilibrium::scan(std::span<const double> u, Critical& next) {
  const bool magnitude = options_.break_on == BreakOn::magnitude;
  const auto fill = network_.components == 1 ? (magnitude ? fill_ratios<2, true> : fill_ratios<2, false>)
                                             : (magnitude ? fill_ratios<4, true> : fill_ratios<4, false>);
  ratio_.resize(threshold_.size());
  const double plate = u[network_.plate];
  const double largest = fill(network_, threshold_, u, kNoElongation * plate, ratio_);
  if (!(largest > 0)) return State::failed;
  const auto first =
      std::ranges::find_if(ratio_, [tied = largest * (1 - kTie)](double r) { return r >= tied; });
  next.bond = static_cast<BondId>(first - ratio_.begin());
  next.load = 1 / largest;
  next.stiffness = 1 / plate;
  return State::carrying;
}

bool Equilibrium::has_failed(double stiffness) {
  if (intact_stiffness_ == 0) {
    if (!(stiffness > kNoStiffness * network_.plate_diagonal)) return true;
    intact_stiffness_ = stiffness;
    return false;
  }
  return !(stiffness > kFailedStiffness * intact_stiffness_);
}

/// F is the least of sum_e k_e (b_e . v)^2 over all v with v[plate] = 1: any u bounds it from above.
bool Equilibrium::has_failed(std::span<const double> u) {
  const double stiffness = 1 / u[network_.plate];
  const double doubtful =
      kDoubtfulStiffness * (intact_stiffness_ > 0 ? intact_stiffness_ : network_.plate_diagonal);
  if (stiffness > doubtful) return has_failed(stiffness);
  double energy = 0;
  for (BondId e = 0; e < network_.bonds(); ++e) {
    const double stretch = broken_[e] == 0 ? elongation(network_, e, u) : 0;
    energy += network_.stiffness[e] * stretch * stretch;
  }
  return has_failed(std::min(stiffness, energy * stiffness * stiffness));
}

std::string equilibrium_names() {
  return "tree, ksp, dense or quad";
}

std::unique_ptr<Equilibrium> make_equilibrium(const Network& network, const EquilibriumOptions& options,
                                              PhaseTimes& times) {
  if (options.strategy == "tree") {
    return make_equilibrium_tree(network, options, times,
                                 {.verify = options.verify, .kernels = options.kernels});
  }
  if (options.strategy == "ksp") return make_equilibrium_ksp(network, options, times);
  if (options.strategy == "dense") return make_equilibrium_dense(network, options, times);
  if (options.strategy == "quad") return make_equilibrium_quad(network, options, times);
  throw InputError("-equilibrium", options.strategy, equilibrium_names());
}

}  // namespace crackle
