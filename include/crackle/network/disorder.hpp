/// Breaking thresholds and stiffnesses from (seed, sample, bond) alone: any sample can be drawn anywhere, in any
/// order.
///
/// Source: J. K. Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC'11 (Philox2x64-10).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/network/lattice.hpp"
#include "crackle/network/laws.hpp"

namespace crackle {

/// Between these no ratio of force to threshold, load or displacement leaves the range of doubles while a network carries
/// 1e-40 of what it did. A threshold may also be 0 (breaks under any force) or infinite (never breaks), a stiffness 0.
inline constexpr double kLeastStiffness = 1e-100;
inline constexpr double kLargestStiffness = 1e100;
inline constexpr double kLeastThreshold = 1e-290;
inline constexpr double kLargestThreshold = 1e150;

struct DisorderOptions {
  bool from_file = false;  ///< thresholds of the network file; else drawn
  const ThresholdLaw* law = &threshold_laws().front();
  double exponent = 1;    ///< > 0, of a law that has one
  double zero_share = 0;  ///< probability that a threshold is 0 instead
  std::uint64_t seed = 1;
};

/// Of a generated lattice.
struct StiffnessOptions {
  const StiffnessLaw* law = &stiffness_laws().front();
  double contrast = 1;  ///< of the stiffest bond to the softest, >= 1
  double dilution = 0;  ///< probability that a bond is missing (stiffness 0), below 1
  std::uint64_t seed = 1;
};

/// Independent thresholds, uniform on [0, 1), in multiples of 2^-53. Writes all of `threshold` (size: bonds).
///
/// Philox2x64-10 with key `seed` and counter (bond, sample); the upper 53 bits of the first output word.
void draw_uniform_thresholds(std::uint64_t seed, std::int64_t sample, std::span<double> threshold);

/// The same numbers under the law of `options`; the second output word decides who is 0. Throws InputError, naming
/// -disorder_exponent, bond and sample, for an r > 0 whose threshold is not from kLeastThreshold to kLargestThreshold: bonds
/// would break by number.
void draw_thresholds(const DisorderOptions& options, std::int64_t sample, std::span<double> threshold);

/// [M] stiffnesses of one network for all samples: counter (bond, -1). Empty when every one is 1.
[[nodiscard]] std::vector<double> draw_stiffness(const StiffnessOptions& options, const Lattice& lattice);

}  // namespace crackle
