#include "crackle/equilibrium/quad/equilibrium_quad.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/base/memory.hpp"
#include "crackle/equilibrium/criterion.hpp"
#include "crackle/equilibrium/quad_solver.hpp"

namespace crackle {

namespace {

/// Forces in error by less than this fraction of the load decide as in exact arithmetic, but for what carries nothing.
constexpr double kCertain = 1e-14;
/// Settling costs a factorization: this many times as many breaks as that is worth.
constexpr double kSettleShare = 50;

class EquilibriumQuad final : public Equilibrium {
 public:
  EquilibriumQuad(const Network& network, const EquilibriumOptions& options, PhaseTimes& times,
                  QuadOrder order)
      : Equilibrium(network, options, times),
        breaks_worth_settling_(worth_settling(order)),
        solver_(network, std::move(order), times),
        u_(static_cast<std::size_t>(network.unknowns)) {
    counts_.unknowns = network.unknowns;
    counts_.factor_entries = static_cast<std::int64_t>(solver_.entries());
  }

  [[nodiscard]] std::span<const double> do_displacements() override {
    solver_.get_displacements(u_);
    return u_;
  }
  [[nodiscard]] std::vector<double> do_forces() override {
    std::vector<double> force(solver_.force().size());
    std::ranges::transform(solver_.force(), force.begin(), [](Quad f) { return static_cast<double>(f); });
    return force;
  }
  [[nodiscard]] std::int64_t breaks_worth_settling() const override { return breaks_worth_settling_; }
  [[nodiscard]] EquilibriumCounts counts() const override {
    EquilibriumCounts counts = counts_;
    counts.factorizations = solver_.counts().factorizations;
    counts.refactors = solver_.counts().refactors;
    counts.smallest_slack = solver_.counts().smallest_slack;
    return counts;
  }

 private:
  /// A break takes about four passes over the entries.
  static std::int64_t worth_settling(const QuadOrder& order) {
    const double passes = profile_work(order.first) / static_cast<double>(profile_entries(order.first));
    return static_cast<std::int64_t>(std::ceil(kSettleShare * std::max(1.0, passes / 4)));
  }

  [[nodiscard]] bool knows_its_error() const override { return true; }
  bool renew() override {
    solver_.renew();
    return true;
  }
  void do_reset() override {
    solver_.reset();
    counts_.null_pivots = 0;
  }
  void do_remove(BondId bond) override { solver_.remove(bond); }
  void do_settle() override { solver_.renew(); }
  void do_resume(std::span<const BondId> bonds) override {
    for (const BondId bond : bonds) solver_.remove(bond);  // no factor yet: nothing to change
  }

  [[nodiscard]] State search(Critical& next) override {
    const QuadSolver::Outcome outcome = solver_.solve();
    if (outcome == QuadSolver::Outcome::loose) return State::failed;
    if (outcome == QuadSolver::Outcome::vague) {
      complaint_ = solver_.complaint();
      return State::unsolved;
    }
    const PhaseScope scope(times_, Phase::search);
    const auto stiffness = static_cast<double>(solver_.stiffness());
    if (intact_stiffness() == 0) {
      set_intact_stiffness(stiffness);
      counts_.null_pivots = solver_.counts().null_pivots;
    }
    if (!(stiffness > kFailedStiffness * intact_stiffness())) return State::failed;
    next.stiffness = stiffness;
    if (!(solver_.uncertain() < solver_.largest_force())) {
      complain("forces are uncertain by %.1g of the load even in 113 bits: stiffnesses are too far apart",
               solver_.uncertain());
      return State::unsolved;
    }
    if (!find_largest_ratio(solver_.force(), threshold(), options_.break_on, next)) return State::held;
    return is_doubtful(next) ? State::unsolved : State::carrying;
  }

  /// Another bond may have the largest ratio, forces being as uncertain as they are. Equal ones are decided by number.
  bool is_doubtful(const Critical& next) {
    const Quad error = solver_.uncertain();
    const auto force = solver_.force();
    const auto bound = [&](BondId e, Quad change) {
      const Quad size = options_.break_on == BreakOn::magnitude ? magnitude(force[e]) : force[e];
      return break_ratio(size + change, threshold()[e], BreakOn::tension);
    };
    const Quad tied = 1 - Quad(kTie);
    const Quad least = bound(next.bond, -error);
    Quad largest = 0;
    for (BondId e = 0; e < network_.bonds(); ++e) largest = std::max(largest, bound(e, -error));
    for (BondId e = 0; e < network_.bonds(); ++e) {
      const bool nothing = force[e] == 0 && error < kCertain;
      if (e == next.bond || nothing) continue;
      const Quad most = bound(e, error);
      const bool rivals = e < next.bond ? most >= tied * largest : tied * most > least;
      if (most > 0 && rivals) {
        complain("bonds %.0f and %.0f may both be the next: forces are uncertain by %.1g of the load",
                 static_cast<double>(next.bond), static_cast<double>(e), solver_.uncertain());
        return true;
      }
    }
    return false;
  }

  template <class... Numbers>
  void complain(const char* format, Numbers... numbers) {
    std::array<char, 200> text{};
    std::snprintf(text.data(), text.size(), format, numbers...);
    complaint_ = text.data();
  }

  std::int64_t breaks_worth_settling_;
  QuadSolver solver_;
  std::vector<double> u_;  ///< [n] of the last state, for who asks
};

}  // namespace

std::unique_ptr<Equilibrium> make_equilibrium_quad(const Network& network, const EquilibriumOptions& options,
                                                   PhaseTimes& times) {
  QuadOrder order = find_quad_order(network);
  const std::size_t entries = profile_entries(order.first);
  if (entries > kMostQuadEntries) {
    throw InputError("-equilibrium quad on a network of " + std::to_string(network.unknowns) +
                         " unknowns, whose factor has entries",
                     std::to_string(entries), "at most " + std::to_string(kMostQuadEntries) + " of 16 bytes");
  }
  demand_memory("-equilibrium quad of " + std::to_string(network.unknowns) + " unknowns",
                static_cast<double>(sizeof(Quad) * entries));
  return std::make_unique<EquilibriumQuad>(network, options, times, std::move(order));
}

}  // namespace crackle
