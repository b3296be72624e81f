/// Breaks one sample and keeps what happened.
#pragma once

#include <vector>

#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/fracture/fracture.hpp"
#include "crackle/network/disorder.hpp"
#include "crackle/record/part_breaks.hpp"

namespace crackle::test {

inline std::vector<double> uniform_thresholds(const Network& network, std::int64_t sample) {
  std::vector<double> threshold(network.lattice.bond.size());
  draw_uniform_thresholds(1, sample, threshold);
  return threshold;
}

inline SampleRecord break_record(Equilibrium& equilibrium, std::span<const double> threshold,
                                 const StopRule& stop = {}) {
  SampleRecord record;
  ObserveBreaks breaks(record);
  const std::vector<Observer*> observers{&breaks};
  record.summary = break_sample(equilibrium, 0, threshold, stop, observers);
  return record;
}

inline SampleRecord break_record(const Network& network, const ChosenStrategy& options,
                                 std::span<const double> threshold, const StopRule& stop = {}) {
  PhaseTimes times;
  const auto equilibrium = make_equilibrium(network, options, times);
  return break_record(*equilibrium, threshold, stop);
}

}  // namespace crackle::test
