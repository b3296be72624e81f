/// Breaking thresholds from (seed, sample, bond) alone: any sample can be drawn anywhere, in any order.
///
/// Source: J. K. Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC'11 (Philox2x64-10).
#pragma once

#include <cstdint>
#include <span>

namespace crackle {

struct DisorderOptions {
  bool from_file = false;  ///< thresholds of the network file, the same for every sample; else uniform
  std::uint64_t seed = 1;
};

/// Independent thresholds, uniform on [0, 1), in multiples of 2^-53. Writes all of `threshold` (size: bonds).
///
/// Philox2x64-10 with key `seed` and counter (bond, sample); the upper 53 bits of the first output word.
void draw_uniform_thresholds(std::uint64_t seed, std::int64_t sample, std::span<double> threshold);

}  // namespace crackle
