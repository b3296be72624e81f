/// The network with its plate moved by 1: displacements in 113 bits, refined by a factor in double.
///
/// With the plate held, K keeps its digits to the last break: what goes to 0 at failure is F, which is here the energy
/// of the displacements, an upper bound that their error enters squared. Residuals are the bonds' own, in 113 bits.
/// Source of refinement: C. B. Moler, J. ACM 14 (1967) 316.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "crackle/cholmod_factor.hpp"
#include "crackle/network.hpp"
#include "crackle/network_matrix.hpp"
#include "crackle/phase.hpp"
#include "crackle/quad_bonds.hpp"

namespace crackle {

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
  [[nodiscard]] Outcome solve(std::span<const std::uint8_t> broken, double none);

  // Of the last state that was solved:
  [[nodiscard]] double stiffness() const { return static_cast<double>(stiffness_); }  ///< F
  /// [M] at unit plate load; 0 for what carries nothing.
  [[nodiscard]] std::span<const Quad> force() const { return force_; }
  void get_displacements(std::span<double> u) const;  ///< at unit plate load; size of u: unknowns

  /// Of the intact network with its plate held: the smallest pivot below `least` of its diagonal entry that belongs to
  /// a motion which stretches bonds. Free motions (loose parts) are none.
  [[nodiscard]] SoftSpot find_soft_spot(double least);

 private:
  [[nodiscard]] bool factor(std::span<const std::uint8_t> broken);
  [[nodiscard]] Outcome refine(std::span<const std::uint8_t> broken, double none);
  void fill_load(std::span<const std::uint8_t> broken);
  void note_forces(std::span<const std::uint8_t> broken);
  [[nodiscard]] bool is_free(std::span<const double> motion) const;
  [[nodiscard]] double energy(std::span<const double> motion) const;
  [[nodiscard]] NodeId node_of(Dof dof) const;
  [[nodiscard]] SoftSpot find_slight_direction() const;

  const Network& network_;
  PhaseTimes& times_;
  NetworkMatrix matrix_;
  QuadBonds bonds_;
  std::unique_ptr<CholmodFactor> factor_;
  std::vector<std::uint8_t> gone_;  ///< [M] bonds that matrix_ is without
  std::vector<double> value_;       ///< K's, the plate held
  std::vector<Quad> v_;             ///< [n]
  std::vector<Quad> r_;             ///< [n]
  std::vector<Quad> force_;         ///< [M]
  std::vector<double> load_, step_;
  std::size_t free_motions_ = 0;  ///< null pivots of the intact network that find_soft_spot has found free
  Quad stiffness_ = 0;
  Quad energy_ = 0;     ///< of v_, at the last fill_load
  double largest_ = 0;  ///< force of v_, at the last fill_load
};

}  // namespace crackle
