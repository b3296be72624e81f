/// Runs strategies on one sample, and measures each against the reference.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "crackle/compare/compare_reference.hpp"
#include "crackle/compare/compare_strategy.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/fracture/fracture.hpp"

namespace crackle {

/// Whose breaks damage the network that a strategy solves.
enum class Along : std::uint8_t {
  reference,  ///< the reference's, whatever the strategy would break: every error is one of the same network
  own,        ///< its own: after the first difference it is another sample, and forces are not compared
};

struct CompareOptions {
  std::vector<std::string> files;       ///< of strategies
  std::vector<std::string> tolerances;  ///< -ksp_rtol of those that iterate; empty: their own
  std::int64_t every = 10;              ///< breaks between two that are measured
  int repetitions = 3;
  std::int64_t skip = 0;  ///< breaks, taken from `tree`, before the comparison begins
  Along along = Along::reference;
  ReferenceKind reference = ReferenceKind::automatic;
  std::string path = "compare.h5";
  bool overwrite = false;
  bool quiet = false;  ///< don't tell on stderr which strategy is running
};

/// What the reference did. Break numbers count from 1.
struct ReferenceRun {
  std::string name;
  std::vector<BondId> bond;                ///< [skip + B]
  std::vector<double> load;                ///< [B]
  std::vector<double> stiffness;           ///< [B]
  std::vector<std::int64_t> number;        ///< [K] breaks measured
  std::vector<double> error;               ///< [K] its own estimate, relative to the largest force
  std::vector<double> largest_force;       ///< [K] at unit plate load
  std::vector<std::vector<double>> force;  ///< [K][M]
  std::int64_t skip = 0;
  bool failed = false;  ///< it ended by failure, not by -stop
  double peak_load = 0;
  std::int64_t n_p = 0;  ///< bonds broken up to and with the one at the peak load
  std::int64_t n_f = 0;  ///< bonds broken in all
  double seconds = 0;
};

/// What a strategy did. NaN where it was not measured. Seconds of `time`, `total` and `set_up` are processor time.
struct StrategyRun {
  StrategyChoice choice;
  std::vector<double> time;              ///< [R][K] seconds when each measured break was known
  std::vector<double> total;             ///< [R] seconds of all its breaks
  std::vector<double> set_up;            ///< [R] seconds before the first
  std::vector<double> phase;             ///< [R][kPhases] seconds of both
  std::vector<std::int64_t> iterations;  ///< [K] of that break's solve
  std::vector<double>
      residual;  ///< [K] |e_plate - K u| in the Euclidean norm, from the bonds; the load's is 1
  std::vector<double> backward_error;  ///< [K]
  std::vector<double> force_error;     ///< [K] largest, relative to the largest force
  std::vector<double> load_error;      ///< [K] relative
  std::int64_t first_difference = 0;   ///< number of the first break at which it names another bond; 0: none
  std::int64_t differences = 0;        ///< how many there are, along the reference
  double peak_load = 0;
  std::int64_t n_p = 0;
  std::int64_t n_f = 0;      ///< breaks after which it saw failure (with -stop: that it made)
  std::int64_t memory = 0;   ///< bytes that it held at its end
  EquilibriumCounts counts;  ///< of the first repetition
  std::string complaint;     ///< what it said when it ended before its time; empty: nothing
};

struct CompareScene {
  const Network& network;
  ChosenStrategy equilibrium;
  StopRule stop;  ///< failure, or a number of breaks
  std::vector<double> threshold;
};

/// Breaks the sample by the reference. Throws SolverError when the intact network carries nothing.
[[nodiscard]] ReferenceRun run_reference(const CompareScene& scene, const CompareOptions& options);

/// Makes each strategy once. Throws InputError for options that nobody reads, or a strategy that can't be.
void try_strategies(const CompareScene& scene, std::span<const StrategyChoice> choices);

/// Every strategy in turn, as often as options.repetitions says; errors are measured in the first, off the clock.
[[nodiscard]] std::vector<StrategyRun> run_strategies(const CompareScene& scene,
                                                      const CompareOptions& options,
                                                      const ReferenceRun& reference,
                                                      std::span<const StrategyChoice> choices);

}  // namespace crackle
