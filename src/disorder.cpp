#include "crackle/disorder.hpp"

#include <Random123/philox.h>

namespace crackle {

void draw_uniform_thresholds(std::uint64_t seed, std::int64_t sample, std::span<double> threshold) {
  const r123::Philox2x64 philox;
  for (std::size_t bond = 0; bond < threshold.size(); ++bond) {
    const auto word = philox({bond, static_cast<std::uint64_t>(sample)}, {seed})[0];
    threshold[bond] = static_cast<double>(word >> 11) * 0x1p-53;
  }
}

}  // namespace crackle
