/// Finds the critical bond in 113 bits: QuadSolver's forces, and the criterion with the error that they may have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "crackle/base/phase.hpp"
#include "crackle/equilibrium/criterion.hpp"
#include "crackle/equilibrium/quad_solver.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

/// Entries of the factor (16 bytes each) above which a network is refused: L = 125 springs, where a break takes a
/// second or two and a new factor half a minute.
inline constexpr std::size_t kMostQuadEntries = 8'000'000;

class QuadSearch {
 public:
  /// network and times must outlive it. Throws InputError for a network whose factor has more than kMostQuadEntries.
  QuadSearch(const Network& network, BreakOn break_on, PhaseTimes& times);

  /// A sample from these broken bonds on, none of them twice. intact_stiffness: 0 when not known yet, and none is broken.
  void begin(std::span<const BondId> broken, double intact_stiffness);
  void remove(BondId bond) { solver_.remove(bond); }
  void renew() { solver_.renew(); }  ///< the next search starts from a new factor

  /// The rules of Equilibrium. threshold: [M], infinite for what is broken or can't break. `unsolved`, with a complaint,
  /// where the forces are too uncertain to tell which bond it is.
  [[nodiscard]] State find_critical(std::span<const double> threshold, Critical& next);

  [[nodiscard]] double intact_stiffness() const { return intact_stiffness_; }
  /// Of the last state, as the rest of QuadSolver's answers are.
  [[nodiscard]] std::vector<double> forces() const;
  [[nodiscard]] const QuadSolver& solver() const { return solver_; }
  [[nodiscard]] const std::string& complaint() const { return complaint_; }
  /// Unknowns held in the intact network; 0 until it has been solved.
  [[nodiscard]] std::int64_t null_pivots() const { return null_pivots_; }
  /// What a factor from scratch costs, in breaks.
  [[nodiscard]] double breaks_per_factor() const { return breaks_per_factor_; }

 private:
  QuadSearch(const Network& network, BreakOn break_on, PhaseTimes& times, QuadOrder order);
  [[nodiscard]] bool is_doubtful(std::span<const double> threshold, const Critical& next);
  template <class... Numbers>
  void complain(const char* format, Numbers... numbers);

  const Network& network_;
  BreakOn break_on_;
  PhaseTimes& times_;
  double breaks_per_factor_;
  QuadSolver solver_;
  double intact_stiffness_ = 0;
  std::int64_t null_pivots_ = 0;
  std::string complaint_;
};

}  // namespace crackle
