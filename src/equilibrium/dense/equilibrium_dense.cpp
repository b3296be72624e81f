#include "crackle/equilibrium/dense/equilibrium_dense.hpp"

// the second needs the first
// clang-format off
#include <petscsys.h>
#include <petscblaslapack.h>
// clang-format on

#include <algorithm>
#include <cmath>
#include <string>

#include "crackle/base/error.hpp"
#include "crackle/base/memory.hpp"
#include "crackle/factor/null_pivot.hpp"

namespace crackle {

namespace {

/// Refinement ends when it changes the plate's displacement by less than this fraction, or after so many steps.
constexpr double kRefined = 1e-14;
constexpr int kMostRefinements = 10;
/// Nothing is carried from break to break but pins: as often as may be wanted.
constexpr std::int64_t kBreaksWorthSettling = 100;

class EquilibriumDense final : public Equilibrium {
 public:
  EquilibriumDense(const Network& network, const EquilibriumOptions& options, PhaseTimes& times)
      : Equilibrium(network, options, times),
        n_(static_cast<std::size_t>(network.unknowns)),
        u_(n_),
        K_(n_ * n_) {
    counts_.unknowns = network.unknowns;
    counts_.factor_entries = static_cast<std::int64_t>(n_ * (n_ + 1) / 2);
  }

  [[nodiscard]] std::int64_t breaks_worth_settling() const override { return kBreaksWorthSettling; }

 private:
  [[nodiscard]] std::span<const double> do_displacements() override { return u_; }

  [[nodiscard]] State search(Critical& next) override {
    const bool carries = factor();
    // a bond that carries force holds no motion alone: breaks make no new null pivot
    if (most_null_pivots_ < 0) most_null_pivots_ = std::ssize(pinned_);
    if (!carries || std::ssize(pinned_) > most_null_pivots_) return State::failed;
    solve();
    const PhaseScope scope(times_, Phase::search);
    if (has_failed(1 / u_.back())) return State::failed;
    return scan(u_, next);
  }

  bool renew() override { return true; }  // every factor is new
  void do_reset() override {
    pinned_.clear();
    counts_.null_pivots = 0;
  }
  void do_remove(BondId /*bond*/) override {}
  void do_settle() override { do_reset(); }

  /// The lower triangle of K by columns, pinned unknowns with twice their diagonal.
  void assemble() {
    const PhaseScope scope(times_, Phase::assembly);
    std::ranges::fill(K_, 0.0);
    for (const Dof slot : network_.idle) K_[slot * (n_ + 1)] = 1;
    for (BondId e = 0; e < network_.bonds(); ++e) {
      if (broken()[e] != 0) continue;
      const auto dofs = network_.bond_dofs(e);
      const auto values = network_.bond_values(e);
      for (std::size_t i = 0; i < dofs.size(); ++i) {
        for (std::size_t j = 0; j < dofs.size(); ++j) {
          if (dofs[i] >= dofs[j]) K_[dofs[j] * n_ + dofs[i]] += network_.stiffness[e] * values[i] * values[j];
        }
      }
    }
    for (const Dof dof : pinned_) {
      double& entry = K_[dof * (n_ + 1)];
      entry += entry > 0 ? entry : 1;  // 0: no bond is left there
    }
  }

  /// K = L L^T, pinning one null pivot after another; false when the plate's pivot is the null one.
  bool factor() {
    while (true) {
      assemble();
      for (std::size_t i = 0; i < n_; ++i) u_[i] = K_[i * (n_ + 1)];
      const PhaseScope scope(times_, Phase::factor);
      const auto n = static_cast<PetscBLASInt>(n_);
      PetscBLASInt info = 0;
      ++counts_.factorizations;
      LAPACKpotrf_("L", &n, K_.data(), &n, &info);
      const std::size_t end = info > 0 ? static_cast<std::size_t>(info) - 1 : n_;
      std::size_t null = 0;
      // L^2 is the pivot of L D L^T
      while (null < end && K_[null * (n_ + 1)] * K_[null * (n_ + 1)] > kNullPivot * u_[null]) ++null;
      if (null == n_) return true;
      if (null == n_ - 1) return info == 0;
      pinned_.push_back(static_cast<Dof>(null));
      ++counts_.null_pivots;
    }
  }

  /// With refinement: near failure, and with stiffnesses over decades, a factor's own answer may have no digit
  /// right, and F must be told from 0.
  void solve() {
    const PhaseScope scope(times_, Phase::solve);
    std::ranges::fill(u_, 0.0);
    for (int step = 0; step <= kMostRefinements; ++step) {
      fill_residual();
      const auto n = static_cast<PetscBLASInt>(n_);
      const PetscBLASInt one = 1;
      PetscBLASInt info = 0;
      LAPACKpotrs_("L", &n, &one, K_.data(), &n, correction_.data(), &n, &info);
      for (std::size_t i = 0; i < n_; ++i) u_[i] += correction_[i];
      if (std::abs(correction_.back()) <= kRefined * std::abs(u_.back())) return;
    }
  }

  /// correction_ = e_plate - K u from the bonds, in long double.
  void fill_residual() {
    residual_.assign(n_, 0.0L);
    residual_.back() = 1;
    for (BondId e = 0; e < network_.bonds(); ++e) {
      if (broken()[e] != 0) continue;
      const auto dofs = network_.bond_dofs(e);
      const auto values = network_.bond_values(e);
      long double force = 0;
      for (std::size_t i = 0; i < dofs.size(); ++i)
        force += static_cast<long double>(values[i]) * u_[dofs[i]];
      force *= network_.stiffness[e];
      for (std::size_t i = 0; i < dofs.size(); ++i) residual_[dofs[i]] -= values[i] * force;
    }
    correction_.assign(residual_.begin(), residual_.end());
  }

  std::size_t n_;
  std::vector<double> u_;              ///< [n]
  std::vector<double> correction_;     ///< [n] of one refinement
  std::vector<long double> residual_;  ///< [n]
  std::vector<double> K_;              ///< [n * n] by columns; its factor after `factor`
  std::vector<Dof> pinned_;
  std::ptrdiff_t most_null_pivots_ = -1;  ///< of the network as it was first seen
};

}  // namespace

std::unique_ptr<Equilibrium> make_equilibrium_dense(const Network& network, const EquilibriumOptions& options,
                                                    PhaseTimes& times) {
  if (network.unknowns > kMostDenseUnknowns) {
    throw InputError("-equilibrium dense on a network of unknowns", std::to_string(network.unknowns),
                     "at most " + std::to_string(kMostDenseUnknowns) + " unknowns");
  }
  const double n = network.unknowns;
  demand_memory("-equilibrium dense of " + std::to_string(network.unknowns) + " unknowns",
                sizeof(double) * n * n);
  return std::make_unique<EquilibriumDense>(network, options, times);
}

}  // namespace crackle
