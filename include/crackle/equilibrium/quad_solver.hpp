/// The network in equilibrium in 113 bits: L D L^T within a profile, kept current while bonds break, every answer
/// refined with residuals from the bonds until it is as good as rounding lets it be.
///
/// What an unknown without stiffness is, and what force is none, is told from the bonds, not from pivots, which
/// rounding blurs by 1e-34 of the stiffest bond: a motion is free when it stretches no bond by more than the rounding
/// of positions does, whatever the stiffnesses. Source of refinement: C. B. Moler, J. ACM 14 (1967) 316.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "crackle/base/phase.hpp"
#include "crackle/factor/profile_factor.hpp"
#include "crackle/network/network.hpp"
#include "crackle/network/quad_bonds.hpp"

namespace crackle {

struct QuadCounts {
  std::int64_t factorizations = 0;
  std::int64_t refactors = 0;    ///< those among them that a slack or an error asked for
  std::int64_t null_pivots = 0;  ///< unknowns held, in the last factor
  double smallest_slack = 1;     ///< of a downdate
};

class QuadSolver {
 public:
  enum class Outcome : std::uint8_t {
    solved,
    loose,  ///< nothing holds the plate: F = 0
    vague,  ///< complaint() says what rounding leaves open
  };

  /// network and times must outlive it. Takes 16 bytes an entry of the profile.
  QuadSolver(const Network& network, QuadOrder order, PhaseTimes& times);

  void reset();                    ///< the intact network
  void remove(BondId bond);        ///< changes the factor
  void renew() { stale_ = true; }  ///< the next solve starts from a new factor

  [[nodiscard]] Outcome solve();

  // Of the last state that was solved, at unit plate load:
  [[nodiscard]] Quad stiffness() const { return stiffness_; }  ///< F
  /// [M] 0 for what carries nothing: below `uncertain`, or below 1e-14 of the load and stretched by less than 1e-14
  /// of the plate's displacement.
  [[nodiscard]] std::span<const Quad> force() const { return force_; }
  [[nodiscard]] double largest_force() const { return largest_force_; }
  /// A force may be in error by this. The load is 1.
  [[nodiscard]] double uncertain() const { return uncertain_; }
  /// Size of u: unknowns, in the network's order.
  void get_displacements(std::span<double> u) const;

  [[nodiscard]] std::size_t entries() const { return factor_.entries(); }
  [[nodiscard]] const QuadCounts& counts() const { return counts_; }
  [[nodiscard]] const std::string& complaint() const { return complaint_; }

 private:
  enum class Motion : std::uint8_t { stiff, free, open };

  void assemble();
  [[nodiscard]] Outcome factor();
  [[nodiscard]] Quad judge(int row, Quad pivot, Quad diagonal);
  [[nodiscard]] Motion look_at(std::span<const Quad> z, double free);
  [[nodiscard]] Motion look_across(std::span<const Quad> z, Quad way) const;
  [[nodiscard]] Quad energy(std::span<const Quad> x) const;
  [[nodiscard]] std::string describe_open(int row) const;
  void fill_residual();
  [[nodiscard]] double refine();
  void note_forces(double error);
  [[nodiscard]] bool is_intact() const;
  [[nodiscard]] bool acts(BondId e) const { return broken_[e] == 0 && network_.can_stretch(e); }
  [[nodiscard]] double largest(std::span<const Quad> x) const;

  const Network& network_;
  PhaseTimes& times_;
  QuadOrder order_;
  QuadBonds bonds_;
  ProfileFactor<Quad> factor_;
  double motion_error_;    ///< of a motion found with a factor, relative to it
  double free_refined_;    ///< stretch, relative to the motion, that tells a free one; of a refined motion
  double free_;            ///< of any
  std::vector<int> idle_;  ///< rows that no bond touches
  std::vector<std::uint8_t> broken_;  ///< [M]
  /// [n] rows of free motions in the intact network: breaks of bonds that carry force make no new ones. Empty: not known
  std::vector<std::uint8_t> was_free_;
  std::vector<Quad> u_, r_;  ///< [n] by rows
  std::vector<Quad> force_;  ///< [M]
  Quad stiffness_ = 0;
  double largest_force_ = 0;
  double uncertain_ = 0;
  double fresh_error_ = 0;      ///< what refinement with the last new factor came to
  double largest_stretch_ = 0;  ///< of the motion looked at last, relative to the motion
  bool stale_ = true;
  bool changed_ = false;  ///< the factor has been downdated
  bool asked_ = false;    ///< a slack or an error asked for the next factor
  QuadCounts counts_;
  std::string complaint_;
};

}  // namespace crackle
