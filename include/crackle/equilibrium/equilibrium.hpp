/// The strategy interface: the network in equilibrium under a unit load on its plate, while bonds break.
///
/// Every strategy gives the same sequence of broken bonds.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "crackle/base/phase.hpp"
#include "crackle/equilibrium/criterion.hpp"
#include "crackle/equilibrium/trust.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

/// What a strategy did beyond its duty, summed over all samples.
struct EquilibriumCounts {
  std::int64_t breaks = 0;          ///< bonds removed
  std::int64_t factorizations = 0;  ///< numeric factorizations (preconditioners set up) from scratch
  std::int64_t refactors = 0;       ///< those among them that a slack or a residual asked for
  std::int64_t confirmations = 0;   ///< a solver gave up, and the referee told whether the network had failed
  std::int64_t refereed = 0;        ///< breaks that the referee decided; see Referee
  std::int64_t held = 0;            ///< samples that ended with bonds left that can't break
  double largest_left = 0;          ///< largest share of the intact F that was left in one of them
  NodeId soft_node = -1;  ///< the one that resists least in the intact network, where that is a doubt
  BondsAtNode soft_bonds = kNoBonds;  ///< at that node
  double soft_pivot = 0;              ///< its pivot relative to the diagonal entry
  double soft_contrast = 0;           ///< of stiffnesses, where that is the doubt
  std::int64_t iterations = 0;        ///< of the Krylov method; 0 for a direct solve
  std::int64_t doubtful = 0;          ///< breaks of an iteration whose residual left open which bond breaks
  std::int64_t first_doubtful = 0;    ///< number in its sample of the first of them; 0: none
  double loosest_residual = 0;        ///< largest residual seen in looking for doubt; the load's norm is 1
  std::int64_t null_pivots = 0;       ///< floppy unknowns pinned in the intact network
  std::int64_t unknowns = 0;          ///< size of the system
  std::int64_t factor_entries = 0;    ///< entries of the factor; 0 where the solver doesn't tell
  double smallest_slack = 1;          ///< smallest 1 - k b^T K^-1 b of a bond that left something carrying
  std::int64_t checks = 0;            ///< breaks at which `check_every` had the residual measured
  double largest_residual = 0;        ///< largest backward error measured
};

/// What the soft_ counts mean, in words; empty where there is no doubt.
[[nodiscard]] std::string describe_doubt(const EquilibriumCounts& counts);

class Ranks;
/// What every strategy is told; each has options of its own beside it.
struct EquilibriumOptions {
  BreakOn break_on = BreakOn::magnitude;
  std::int64_t check_every = 0;  ///< breaks between two looks at the residual; 0: the strategy's own choice
  double check_bound = kLargestError;  ///< backward error above which a factor is made anew
  bool many_samples = true;            ///< reset will be called again: keep what makes it cheap
  const Ranks* ranks =
      nullptr;  ///< whose group keeps the network in equilibrium together; null: this process alone
};

class HeldFactor;
class Referee;

class Equilibrium {
 public:
  Equilibrium(const Network& network, const EquilibriumOptions& options, PhaseTimes& times);
  virtual ~Equilibrium();
  Equilibrium(const Equilibrium&) = delete;
  Equilibrium& operator=(const Equilibrium&) = delete;

  /// Back to the intact network with these thresholds (size: bonds, >= 0). No memory of earlier samples.
  void reset(std::span<const double> threshold);

  /// The bond with the largest ratio of force to threshold; fills `next` when the state is `carrying`.
  ///
  /// Double precision is believed where it can be. A Referee, more accurate and slower, decides instead:
  ///  - every break of a network whose pivots double can't tell from 0 (EquilibriumCounts::soft_node);
  ///  - of any sample, from F < kRefereedStiffness of the intact one to the end. The strategy isn't told of these breaks;
  ///  - one break at a time, where the residual from the bonds leaves open which bond breaks though the factor is new.
  /// The residual is looked at every kTrustEvery breaks, and at every one where it is doubtful, the critical force
  /// tiny, F below kDoubtfulStiffness, or the solver not one of ours. A strategy that iterates has its doubts counted
  /// (EquilibriumCounts::doubtful), and goes on; one that gives up while the network carries is `unsolved`.
  /// With check_every > 0, every so many breaks the backward error is measured first; above check_bound the factor is
  /// made anew, and when that doesn't help the state is `unsolved`.
  [[nodiscard]] State find_critical(Critical& next);

  /// Removes a bond that find_critical named.
  void remove(BondId bond);

  /// From here on every number follows from thresholds and broken bonds alone, to the last bit, not from how
  /// they came to break: factors are made anew, predictions forgotten. Between remove and find_critical.
  void settle();

  /// A sample that settled after these breaks (in their order), as it was then. intact_stiffness: that sample's.
  void resume(std::span<const double> threshold, std::span<const BondId> bonds, double intact_stiffness);

  /// Breaks after which settling again costs one or two per cent of their time.
  [[nodiscard]] virtual std::int64_t breaks_worth_settling() const = 0;

  /// Displacements at unit plate load of the state that find_critical saw last (size: unknowns).
  [[nodiscard]] std::span<const double> displacements();

  /// [M] of the bonds at unit plate load in that state, 0 for a broken one. Displacements of networks whose stiffnesses
  /// are far apart may have no digit left that says what they are.
  [[nodiscard]] std::vector<double> forces();

  /// F of the intact network, known after the first find_critical since reset.
  [[nodiscard]] double intact_stiffness() const { return intact_stiffness_; }
  [[nodiscard]] const std::vector<std::uint8_t>& broken() const { return broken_; }  ///< [M] 1: broken
  [[nodiscard]] const Network& network() const { return network_; }
  [[nodiscard]] virtual EquilibriumCounts counts() const { return counts_; }
  /// One line on why the state is `unsolved`.
  [[nodiscard]] const std::string& complaint() const { return complaint_; }

 protected:
  /// find_critical in double. `failed` where it finds nothing that carries, or F below kRefereedStiffness: what that
  /// means is told by confirm_end. With a complaint_ it means that the solver gave up.
  virtual State search(Critical& next) = 0;
  [[nodiscard]] virtual std::span<const double> do_displacements() = 0;
  [[nodiscard]] virtual std::vector<double> do_forces();
  [[nodiscard]] virtual bool iterates() const { return false; }  ///< its error is the user's choice
  /// Not a factor of ours, whose slacks are watched: the residual is looked at at every break.
  [[nodiscard]] virtual bool is_foreign() const { return false; }
  /// It measures its own error, beyond double: no residual in double says anything about it.
  [[nodiscard]] virtual bool knows_its_error() const { return false; }
  void set_intact_stiffness(double stiffness) {
    intact_stiffness_ = stiffness;
  }  ///< who doesn't ask has_failed
  /// The smallest pivot of the intact network's factor over its diagonal entry, the plate's left out, pinned ones
  /// included; NaN where the solver doesn't tell. Asked once, before the first search.
  [[nodiscard]] virtual double smallest_pivot();
  /// What the strategy can lend the Referee; null: nothing.
  [[nodiscard]] virtual HeldFactor* held_factor() { return nullptr; }
  virtual bool renew() = 0;     ///< the next search starts from a new factor; false: K is singular
  virtual void do_reset() = 0;  ///< broken() and threshold() are the new sample's already
  virtual void do_remove(BondId bond) = 0;  ///< broken()[bond] is 1 already
  virtual void do_settle() = 0;
  /// Just after do_reset, broken() and threshold() tell of these bonds already; do_settle follows.
  virtual void do_resume(std::span<const BondId> /*bonds*/) {}

  /// Scans every force that u (unit plate load, size n) implies. `failed` when no ratio is above 0.
  [[nodiscard]] State scan(std::span<const double> u, Critical& next);

  /// True when F is below kRefereedStiffness of the intact one, which the first call after reset sets.
  [[nodiscard]] bool has_failed(double stiffness);

  const Network& network_;      // NOLINT(*-non-private-*): one level of strategies, all in this library
  EquilibriumOptions options_;  // NOLINT(*-non-private-*)
  PhaseTimes& times_;           // NOLINT(*-non-private-*)
  EquilibriumCounts counts_;    // NOLINT(*-non-private-*)
  std::string complaint_;       // NOLINT(*-non-private-*)

  /// [M] thresholds; +infinity for a bond that is broken or can't stretch, so that its ratio is 0.
  [[nodiscard]] std::span<const double> threshold() const { return threshold_; }

 private:
  [[nodiscard]] State look(Critical& next);
  [[nodiscard]] State double_check(Critical& next);
  [[nodiscard]] State look_for_doubt(Critical& next);
  [[nodiscard]] State confirm_end(Critical& next);
  void begin_referee();
  [[nodiscard]] State hand_over(Critical& next);
  [[nodiscard]] State consult(Critical& next);
  [[nodiscard]] State ask_referee(Critical& next);
  [[nodiscard]] bool is_soft();
  [[nodiscard]] bool has_softened(const Critical& next);
  [[nodiscard]] bool is_doubtful(const Critical& next);
  [[nodiscard]] Referee& referee();
  void scale_thresholds(std::span<const double> threshold);

  std::vector<BondId> removed_;  ///< since reset, in order
  std::vector<BondId>
      slight_;  ///< bonds with thresholds so small that a force which rounding hides may break them
  bool suspicious_ = false;      ///< the last residual was doubtful
  double last_residual_ = 0;     ///< what is_doubtful measured
  bool refereed_ = false;        ///< to the end of the sample: the strategy isn't told of breaks
  bool classified_ = false;      ///< soft_ is known
  bool soft_ = false;            ///< pivots of the intact network are too small for double
  double last_energy_ = 0;       ///< f^2 / k of the bond that was critical at the last look of has_softened,
  double last_bent_ = 0;         ///< 1/F then,
  std::size_t last_broken_ = 0;  ///< and how many were broken
  int scale_ = 0;  ///< threshold_ is the sample's times 2^-scale_: exact, and far from double's ends
  std::unique_ptr<Referee> referee_;  ///< made when first needed
  std::vector<double> r_;             ///< [n] workspace of residuals
  std::vector<std::uint8_t> broken_;
  std::vector<double> threshold_;
  std::vector<double> ratio_;  ///< [M] workspace of scan; empty until it is first called
  double intact_stiffness_ = 0;
};

}  // namespace crackle
