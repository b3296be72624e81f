/// What the loops of kernels are given, and how far what they return is from what a plain loop does.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "crackle/base/aligned.hpp"
#include "crackle/network/disorder.hpp"

namespace crackle::test {

inline constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// Uniform in -scale / 2 .. scale / 2.
inline AlignedVector values(std::size_t size, std::uint64_t seed, double scale = 1) {
  AlignedVector made(size);
  draw_uniform_thresholds(seed, 0, made);
  for (double& value : made) value = scale * (value - 0.5);
  return made;
}

/// The largest of any entry; NaN counts as infinity.
inline double difference(const AlignedVector& a, const AlignedVector& b) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::isnan(a[i]) ? kInfinity : std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

}  // namespace crackle::test
