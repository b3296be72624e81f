/// The model itself: find the critical bond, break it, repeat, until the scene's stop.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>

#include "crackle/equilibrium/equilibrium.hpp"
#include "crackle/fracture/observer.hpp"
#include "crackle/fracture/stop_rule.hpp"

namespace crackle {

/// A sample, break by break.
///
/// After every settle_every-th break (0: never) the strategy settles: a sample that was left there and resumed
/// goes on as if it had not been left, bit for bit. What the number is decides last bits of loads.
class Fracture {
 public:
  /// All arguments must outlive this.
  Fracture(Equilibrium& equilibrium, const StopRule& stop, std::span<Observer* const> observers,
           std::int64_t settle_every = 0);

  /// The intact network. `threshold`: one a bond, >= 0.
  void begin(std::int64_t index, std::span<const double> threshold);

  /// A sample left when it had settled; begun: what the observers had recorded, and the summary so far.
  void resume(const SampleRecord& begun, std::span<const double> threshold);

  /// Breaks one bond; false: the sample has ended, and none broke.
  ///
  /// Throws SolverError when the intact network carries nothing, or the strategy can't solve it; the message
  /// names sample and break. Observers have then seen a sample that begins and doesn't end.
  [[nodiscard]] bool step();

  /// The strategy has settled after the last break.
  [[nodiscard]] bool settled() const { return settled_; }
  /// Up to now.
  [[nodiscard]] SampleSummary summary() const;

 private:
  void finish(State state);

  Equilibrium& equilibrium_;
  const StopRule& stop_;
  std::span<Observer* const> observers_;
  std::int64_t settle_every_;
  SampleSummary summary_;
  bool settled_ = false;
  double earlier_ = 0;  ///< seconds until the sample was left
  std::chrono::steady_clock::time_point start_;
};

/// Breaks one sample from the intact network to its end; throws as Fracture::step does.
[[nodiscard]] SampleSummary break_sample(Equilibrium& equilibrium, std::int64_t index,
                                         std::span<const double> threshold, const StopRule& stop,
                                         std::span<Observer* const> observers);

}  // namespace crackle
