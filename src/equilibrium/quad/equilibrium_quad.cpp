#include "crackle/equilibrium/quad/equilibrium_quad.hpp"

#include <cmath>

#include "crackle/equilibrium/quad_search.hpp"

namespace crackle {

namespace {

/// Settling costs a factorization: this many times as many breaks as that is worth.
constexpr double kSettleShare = 50;

class EquilibriumQuad final : public Equilibrium {
 public:
  EquilibriumQuad(const Network& network, const EquilibriumOptions& options, PhaseTimes& times)
      : Equilibrium(network, options, times),
        search_(network, options.break_on, times),
        u_(static_cast<std::size_t>(network.unknowns)) {
    counts_.unknowns = network.unknowns;
    counts_.factor_entries = static_cast<std::int64_t>(search_.solver().entries());
  }

  [[nodiscard]] std::int64_t breaks_worth_settling() const override {
    return static_cast<std::int64_t>(std::ceil(kSettleShare * search_.breaks_per_factor()));
  }
  [[nodiscard]] EquilibriumCounts counts() const override {
    EquilibriumCounts counts = counts_;
    const QuadCounts& solver = search_.solver().counts();
    counts.factorizations = solver.factorizations;
    counts.refactors = solver.refactors;
    counts.smallest_slack = solver.smallest_slack;
    counts.null_pivots = search_.null_pivots();
    return counts;
  }

 private:
  [[nodiscard]] State search(Critical& next) override {
    const State state = search_.find_critical(threshold(), next);
    complaint_ = search_.complaint();
    set_intact_stiffness(search_.intact_stiffness());
    return state;
  }
  [[nodiscard]] std::span<const double> do_displacements() override {
    search_.solver().get_displacements(u_);
    return u_;
  }
  [[nodiscard]] std::vector<double> do_forces() override { return search_.forces(); }
  [[nodiscard]] bool knows_its_error() const override { return true; }
  bool renew() override {
    search_.renew();
    return true;
  }
  void do_reset() override { search_.begin({}, 0); }
  void do_remove(BondId bond) override { search_.remove(bond); }
  void do_settle() override { search_.renew(); }
  void do_resume(std::span<const BondId> bonds) override { search_.begin(bonds, intact_stiffness()); }

  QuadSearch search_;
  std::vector<double> u_;  ///< [n] of the last state, for who asks
};

}  // namespace

std::unique_ptr<Equilibrium> make_equilibrium_quad(const Network& network, const EquilibriumOptions& options,
                                                   PhaseTimes& times) {
  return std::make_unique<EquilibriumQuad>(network, options, times);
}

}  // namespace crackle
