/// The strategy interface: the network in equilibrium under a unit load on its plate, while bonds break.
///
/// Every strategy gives the same sequence of broken bonds.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "crackle/network.hpp"
#include "crackle/phase.hpp"

namespace crackle {

enum class BreakOn : std::uint8_t { magnitude, tension };  ///< the ratio is |f|/t, or f/t

/// What a look at the network finds.
enum class State : std::uint8_t {
  carrying,  ///< there is a critical bond
  failed,    ///< the plate's stiffness is below kFailedStiffness of the intact one: nothing carries
  unsolved,  ///< the solver gave no answer to trust, and said why in Equilibrium::complaint
};

/// The bond that breaks next.
struct Critical {
  BondId bond = 0;
  double load = 0;       ///< P = F / max ratio at unit displacement: the plate force at which it breaks
  double stiffness = 0;  ///< F just before it breaks; load / stiffness is the plate's displacement
};

/// What a strategy did beyond its duty, summed over all samples.
struct EquilibriumCounts {
  std::int64_t breaks = 0;          ///< bonds removed
  std::int64_t factorizations = 0;  ///< numeric factorizations (preconditioners set up) from scratch
  std::int64_t refactors = 0;       ///< those among them that a slack or a residual asked for
  std::int64_t confirmations =
      0;                        ///< a solver gave up, and a direct factor told whether the network had failed
  std::int64_t iterations = 0;  ///< of the Krylov method; 0 for a direct solve
  std::int64_t doubtful = 0;    ///< breaks of an iteration whose residual left open which bond breaks
  std::int64_t first_doubtful = 0;  ///< number in its sample of the first of them; 0: none
  double loosest_residual = 0;      ///< largest residual seen in looking for doubt; the load's norm is 1
  std::int64_t null_pivots = 0;     ///< floppy unknowns pinned in the intact network
  std::int64_t unknowns = 0;        ///< size of the system
  std::int64_t factor_entries = 0;  ///< entries of the factor; 0 where the solver doesn't tell
  double smallest_slack = 1;        ///< smallest 1 - k b^T K^-1 b of a bond that left something carrying
  std::int64_t checks = 0;          ///< breaks at which `check_every` had the residual measured
  double largest_residual = 0;      ///< largest backward error measured
};

class Ranks;
struct TreeKernels;
/// Backward error that is not believed: a direct solver leaves 1e-16 to 1e-14.
inline constexpr double kLargestError = 1e-12;

struct EquilibriumOptions {
  std::string strategy = "tree";  ///< name in `-equilibrium`
  BreakOn break_on = BreakOn::magnitude;
  int refactor_every = 1;        ///< ksp: breaks that a preconditioner made from scratch serves
  std::int64_t check_every = 0;  ///< breaks between two looks at the residual; 0: the strategy's own choice
  double check_bound = kLargestError;    ///< backward error above which a factor is made anew
  bool verify = false;                   ///< tree: compare every break with a full solve by a fresh factor
  const TreeKernels* kernels = nullptr;  ///< tree: one of tree_kernels(); null: the fastest
  bool many_samples = true;              ///< reset will be called again: keep what makes it cheap
  const Ranks* ranks =
      nullptr;  ///< whose group keeps the network in equilibrium together; null: this process alone
};

/// F below this fraction of the intact network's F is failure.
inline constexpr double kFailedStiffness = 1e-8;
/// F below this fraction of the intact network's is checked by the energy before it is believed.
inline constexpr double kDoubtfulStiffness = 1e-4;
/// F of the intact network below this fraction of the plate's diagonal entry is rounding: nothing carries.
inline constexpr double kNoStiffness = 1e-12;
/// Ratios that differ by less than this fraction are equal: of those bonds the lowest BondId breaks.
inline constexpr double kTie = 1e-11;
/// An elongation below this multiple of the plate's displacement is rounding: the bond carries nothing.
inline constexpr double kNoElongation = 1e-14;

/// A residual e_plate - K u above this (the load's norm is 1) may leave open which bond breaks: it is then looked at
/// in every state. Forces are in error by about as much, whatever the stiffnesses: the forces that balance a load are
/// bounded by it (G. W. Stewart, Linear Algebra Appl. 112 (1989) 189, on scaled projections).
inline constexpr double kDoubtfulResidual = 1e-9;
/// A force is taken to be in error by at most this multiple of the residual; 2 is the most that was seen.
inline constexpr double kForcePerResidual = 10;
/// A critical bond whose elongation is below this multiple of the plate's displacement has the residual looked at.
inline constexpr double kTinyElongation = 1e-6;
/// Breaks between two looks at the residual, while it is not doubtful.
inline constexpr std::int64_t kTrustEvery = 128;

class Equilibrium {
 public:
  Equilibrium(const Network& network, const EquilibriumOptions& options, PhaseTimes& times)
      : network_(network),
        options_(options),
        times_(times),
        broken_(network.bonds()),
        threshold_(network.bonds()) {}
  virtual ~Equilibrium() = default;
  Equilibrium(const Equilibrium&) = delete;
  Equilibrium& operator=(const Equilibrium&) = delete;

  /// Back to the intact network with these thresholds (size: bonds, >= 0). No memory of earlier samples.
  void reset(std::span<const double> threshold);

  /// The bond with the largest ratio of force to threshold; fills `next` when the state is `carrying`.
  ///
  /// Every kTrustEvery breaks, and at every one where the residual is doubtful or the critical force tiny, the residual is measured from the
  /// bonds. When it leaves open which bond breaks, a direct strategy makes a new factor, and when that doesn't help
  /// the state is `unsolved`; one that iterates counts it (EquilibriumCounts::doubtful), and goes on.
  /// With check_every > 0, every so many breaks the residual is measured from the bonds first; above
  /// check_bound the factor is made anew, and when that doesn't help the state is `unsolved`.
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
  [[nodiscard]] virtual std::span<const double> displacements() = 0;

  /// [M] of the bonds at unit plate load in that state, 0 for a broken one. Displacements of networks whose stiffnesses
  /// are far apart may have no digit left that says what they are.
  [[nodiscard]] virtual std::vector<double> forces();

  /// F of the intact network, known after the first find_critical since reset.
  [[nodiscard]] double intact_stiffness() const { return intact_stiffness_; }
  [[nodiscard]] const std::vector<std::uint8_t>& broken() const { return broken_; }  ///< [M] 1: broken
  [[nodiscard]] const Network& network() const { return network_; }
  [[nodiscard]] virtual EquilibriumCounts counts() const { return counts_; }
  /// One line on why the state is `unsolved`.
  [[nodiscard]] const std::string& complaint() const { return complaint_; }

 protected:
  virtual State search(Critical& next) = 0;                      ///< find_critical without the check
  [[nodiscard]] virtual bool iterates() const { return false; }  ///< its error is the user's choice
  /// It measures its own error, beyond double: no residual in double says anything about it.
  [[nodiscard]] virtual bool knows_its_error() const { return false; }
  void set_intact_stiffness(double stiffness) {
    intact_stiffness_ = stiffness;
  }                             ///< who doesn't ask has_failed
  virtual bool renew() = 0;     ///< the next search starts from a new factor; false: K is singular
  virtual void do_reset() = 0;  ///< broken() and threshold() are the new sample's already
  virtual void do_remove(BondId bond) = 0;  ///< broken()[bond] is 1 already
  virtual void do_settle() = 0;
  /// Just after do_reset, broken() and threshold() tell of these bonds already; do_settle follows.
  virtual void do_resume(std::span<const BondId> /*bonds*/) {}

  /// Scans every force that u (unit plate load, size n) implies. `failed` when no ratio is above 0.
  [[nodiscard]] State scan(std::span<const double> u, Critical& next);

  /// True when F means failure; sets the intact stiffness at the first call after reset.
  [[nodiscard]] bool has_failed(double stiffness);

  /// The same, where F = 1/u[plate] is so small that rounding may have made it of 0: there the energy of u, an
  /// upper bound of F u[plate]^2 that hardly rounds, has to agree. Size of u: n, at unit plate load.
  [[nodiscard]] bool has_failed(std::span<const double> u);

  const Network& network_;      // NOLINT(*-non-private-*): one level of strategies, all in this library
  EquilibriumOptions options_;  // NOLINT(*-non-private-*)
  PhaseTimes& times_;           // NOLINT(*-non-private-*)
  EquilibriumCounts counts_;    // NOLINT(*-non-private-*)
  std::string complaint_;       // NOLINT(*-non-private-*)

  /// [M] thresholds; +infinity for a bond that is broken or can't stretch, so that its ratio is 0.
  [[nodiscard]] std::span<const double> threshold() const { return threshold_; }

 private:
  [[nodiscard]] State double_check(Critical& next);
  [[nodiscard]] State look_for_doubt(Critical& next);
  [[nodiscard]] bool is_tiny(const Critical& next) const;
  [[nodiscard]] bool is_doubtful(const Critical& next);

  std::int64_t removed_ = 0;  ///< since reset
  bool suspicious_ = false;   ///< the last residual was doubtful
  std::vector<double> r_;     ///< [n] workspace of residuals
  std::vector<std::uint8_t> broken_;
  std::vector<double> threshold_;
  std::vector<double> ratio_;  ///< [M] workspace of scan; empty until it is first called
  double intact_stiffness_ = 0;
};

/// Names that `-equilibrium` takes, for messages: "tree, ksp, dense or quad".
[[nodiscard]] std::string equilibrium_names();

/// The strategy of that name. Throws InputError for an unknown one.
/// PETSc-based strategies read their solver's options from the PETSc options database.
[[nodiscard]] std::unique_ptr<Equilibrium> make_equilibrium(const Network& network,
                                                            const EquilibriumOptions& options,
                                                            PhaseTimes& times);

}  // namespace crackle
