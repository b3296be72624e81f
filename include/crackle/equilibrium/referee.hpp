/// Decides the next break where double precision can't: slower, and as accurate as the network's own data.
///
/// First by refinement with a factor in double (HeldSolver), in twice the digits of double, then in 113 bits; where that
/// doesn't converge, by a factor in 113 bits (QuadSearch), to the end of the sample. What it says follows from
/// thresholds and broken bonds, to the rounding of one double, whichever factor it has been lent.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "crackle/equilibrium/criterion.hpp"
#include "crackle/equilibrium/held_solver.hpp"
#include "crackle/equilibrium/quad_search.hpp"

namespace crackle {

class Referee {
 public:
  /// network and times must outlive it.
  Referee(const Network& network, BreakOn break_on, PhaseTimes& times);

  /// Of the intact network; see HeldSolver.
  [[nodiscard]] SoftSpot find_soft_spot(double least) { return held_.find_soft_spot(least); }

  /// A sample as it is: threshold [M], infinite for what is broken or can't break, stays the caller's. bonds: the broken
  /// ones. intact_stiffness: 0 when not known yet, and none is broken.
  void begin(std::span<const double> threshold, std::span<const BondId> bonds, double intact_stiffness);
  void remove(BondId bond);
  /// The rules of Equilibrium. `unsolved` with a complaint. own: a factor of the strategy's; null: none.
  [[nodiscard]] State decide(Critical& next, HeldFactor* own);

  // Of the state decided last:
  [[nodiscard]] double intact_stiffness() const { return intact_stiffness_; }
  [[nodiscard]] std::span<const double> displacements();  ///< at unit plate load
  [[nodiscard]] std::vector<double> forces() const;       ///< the same
  [[nodiscard]] const std::string& complaint() const { return complaint_; }

 private:
  [[nodiscard]] State decide_wide(Critical& next);
  [[nodiscard]] State judge(Critical& next);
  [[nodiscard]] bool is_sure(const Critical& next) const;

  const Network& network_;
  BreakOn break_on_;
  PhaseTimes& times_;
  HeldSolver held_;
  std::unique_ptr<QuadSearch> quad_;  ///< once held_ has not converged
  bool in_quad_ = false;              ///< quad_ follows this sample
  std::span<const double> threshold_;
  std::vector<BondId> removed_;
  std::vector<std::uint8_t> broken_;
  std::vector<double> u_;
  double intact_stiffness_ = 0;
  std::string complaint_;
};

}  // namespace crackle
