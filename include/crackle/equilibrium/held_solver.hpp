/// The network with its plate moved by 1: displacements beyond double, refined by a factor in double.
///
/// With the plate held, K keeps its digits to the last break: what goes to 0 at failure is F, which is here the energy
/// of the displacements, an upper bound that their error enters squared. Residuals are the bonds' own, in twice the
/// digits of double, and in 113 bits where that doesn't tell.
/// Source of refinement: C. B. Moler, J. ACM 14 (1967) 316.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "crackle/base/phase.hpp"
#include "crackle/factor/cholmod_factor.hpp"
#include "crackle/network/network.hpp"
#include "crackle/network/network_matrix.hpp"
#include "crackle/network/quad_bonds.hpp"
#include "crackle/network/twice_bonds.hpp"

namespace crackle {

/// A strategy's own factor of the network as it is now, its plate held: spares HeldSolver one from scratch.
class HeldFactor {
 public:
  HeldFactor() = default;
  virtual ~HeldFactor() = default;
  HeldFactor(const HeldFactor&) = delete;
  HeldFactor& operator=(const HeldFactor&) = delete;

  /// A break that was decided without the strategy.
  virtual void follow(BondId bond) = 0;
  /// Equilibrium at u[plate] = 1 (size: unknowns), as near as the factor goes. False: the factor is no use.
  [[nodiscard]] virtual bool move_plate(std::span<double> u) = 0;
  /// After move_plate: x = K^-1 load with the plate at 0, whatever the load there (size: unknowns each). False: it can't.
  [[nodiscard]] virtual bool solve_held(std::span<const double> /*load*/, std::span<double> /*x*/) {
    return false;
  }
  /// Unknowns pinned in it.
  [[nodiscard]] virtual std::size_t held_pins() const = 0;
};

/// Where a network hardly resists.
struct SoftSpot {
  bool found = false;
  NodeId node = -1;
  double pivot = 0;  ///< relative to the diagonal entry
};

class HeldSolver {
 public:
  enum class Outcome : std::uint8_t {
    solved,
    loose,  ///< nothing holds the plate: F = 0
    vague,  ///< refinement doesn't converge
  };

  /// network and times must outlive it.
  HeldSolver(const Network& network, PhaseTimes& times);

  /// Without the bonds for which broken[e] != 0 (size M). none: an F up to this is 0. Where K has null pivots it is vague
  /// unless find_soft_spot has found them to be free motions.
  /// own: a factor to use before one from scratch; null: none.
  [[nodiscard]] Outcome solve(std::span<const std::uint8_t> broken, double none, HeldFactor* own);
  /// The same in 113 bits.
  [[nodiscard]] Outcome solve_wide(std::span<const std::uint8_t> broken, double none);

  // Of the last state that was solved:
  [[nodiscard]] double stiffness() const { return stiffness_; }  ///< F
  /// [M] at unit plate load; 0 for what carries nothing.
  [[nodiscard]] std::span<const double> force() const { return force_; }
  /// A force may be in error by this beyond a rounding of its own. The load is 1.
  [[nodiscard]] double uncertain() const { return uncertain_; }
  void get_displacements(std::span<double> u) const;  ///< at unit plate load; size of u: unknowns

  /// Of the intact network with its plate held: the smallest pivot below `least` of its diagonal entry that belongs to
  /// a motion which stretches bonds. Free motions (loose parts) are none.
  [[nodiscard]] SoftSpot find_soft_spot(double least);

 private:
  [[nodiscard]] NetworkMatrix& matrix();
  [[nodiscard]] bool factor(std::span<const std::uint8_t> broken);
  [[nodiscard]] bool holds(std::span<const std::uint8_t> broken);
  [[nodiscard]] Outcome solve_by(HeldFactor& own, std::span<const std::uint8_t> broken, double none);
  template <class Solve>
  [[nodiscard]] Outcome refine(std::span<const std::uint8_t> broken, double none, Solve solve);
  [[nodiscard]] Outcome refine_wide(std::span<const std::uint8_t> broken, double none);
  [[nodiscard]] double largest_change(std::span<const std::uint8_t> broken) const;
  void fill_load(std::span<const std::uint8_t> broken);
  void take_forces(std::span<const std::uint8_t> broken, double error, double terms);
  void note_forces(std::span<const std::uint8_t> broken);
  [[nodiscard]] bool is_free(std::span<const double> motion) const;
  [[nodiscard]] NodeId node_of(Dof dof) const;
  [[nodiscard]] SoftSpot find_slight_direction() const;

  const Network& network_;
  PhaseTimes& times_;
  QuadBonds bonds_;
  TwiceBonds twice_;
  std::unique_ptr<NetworkMatrix> matrix_;  ///< made when a factor from scratch is first needed
  std::unique_ptr<CholmodFactor> factor_;  ///< the same
  std::vector<std::uint8_t> gone_;         ///< [M] bonds that matrix_ is without
  std::vector<double> value_;              ///< K's, the plate held
  std::vector<double> high_, low_;         ///< [n] displacements at unit plate displacement, summed
  std::vector<double> force_;              ///< [M]
  std::vector<double> load_, step_;        ///< [n]
  std::vector<Quad> v_, r_;       ///< [n] displacements and what they leave, in 113 bits; empty until needed
  std::size_t free_motions_ = 0;  ///< null pivots of the intact network that find_soft_spot has found free
  double stiffness_ = 0;
  double uncertain_ = 0;
  Quad energy_ = 0;     ///< of v_, at the last fill_load
  double largest_ = 0;  ///< force of v_, at the last fill_load
};

}  // namespace crackle
