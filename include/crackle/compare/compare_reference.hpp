/// Forces, loads and breaks in more than double precision: what strategies are compared with.
///
/// Two ways. `quad`: a QuadSolver with a new factor after every break; for small networks. `refined`: a CHOLMOD factor kept current, and iterative refinement of displacements kept in long
/// double with residuals from the bonds in long double; source: C. B. Moler, J. ACM 14 (1967) 316. Both say how
/// accurate they are, by the last correction.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "crackle/equilibrium/equilibrium.hpp"

namespace crackle {

enum class ReferenceKind : std::uint8_t {
  automatic,  ///< quad where a factorization takes less than kMostQuadWork
  quad,
  refined,
};

/// Multiplications of a factorization in quadruple precision (about 0.1 microseconds each) that `automatic` allows.
inline constexpr double kMostQuadWork = 3e6;

/// What the reference knows of one state of the network.
struct ReferenceState {
  State state = State::carrying;
  Critical critical;          ///< when carrying
  std::vector<double> force;  ///< [M] at unit plate load, each rounded once; 0 for a broken bond
  double largest_force = 0;   ///< of their magnitudes
  double error = 0;           ///< estimate of max |error of a force| / largest_force
};

class Reference {
 public:
  /// The network must outlive it.
  Reference(const Network& network, BreakOn break_on, ReferenceKind kind);
  ~Reference();
  Reference(const Reference&) = delete;
  Reference& operator=(const Reference&) = delete;

  /// Back to the intact network with these thresholds.
  void reset(std::span<const double> threshold);
  /// The rules of Equilibrium (ties, failure, what carries nothing), on more accurate forces. Valid until the next
  /// call. Throws SolverError where `quad` can't tell what holds.
  const ReferenceState& solve();
  void remove(BondId bond);

  /// What a file calls it: "quad: ..." or "refined: ...".
  [[nodiscard]] std::string name() const;

 private:
  struct Solved;
  struct QuadState;
  struct RefinedSolver;

  void solve_quad();
  void solve_refined();

  const Network& network_;
  BreakOn break_on_;
  std::unique_ptr<QuadState> quad_;  ///< one of these two
  std::unique_ptr<RefinedSolver> refined_;
  std::unique_ptr<Solved> solved_;  ///< what `refined` finds
  std::vector<std::uint8_t> broken_;
  std::vector<double> threshold_;  ///< [M] infinity for what can't break
  double intact_stiffness_ = 0;
  ReferenceState state_;
};

}  // namespace crackle
