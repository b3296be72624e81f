#include "crackle/network/twice_bonds.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace crackle {

namespace {

struct Twice {
  double high = 0;
  double low = 0;
};

struct Loads {
  double* high;
  double* rest;
};

struct Operands {
  const Network& network;
  const std::uint8_t* broken;
  const double* b_high;
  const double* b_low;
  const double* v_high;
  const double* v_low;
};

// In a loop that is compiled for two instruction sets, all that it calls has to be in it.
#define CRACKLE_INLINE [[gnu::always_inline]] inline

CRACKLE_INLINE Twice add(double a, double b) {
  const double sum = a + b;
  const double part = sum - a;
  return {sum, (a - (sum - part)) + (b - part)};
}

/// Exact, where neither underflows.
template <bool fused>
CRACKLE_INLINE Twice multiply(double a, double b) {
  const double product = a * b;
  if constexpr (fused) return {product, __builtin_fma(a, b, -product)};
  constexpr double kSplit = 0x1p27 + 1;
  const double c = kSplit * a;
  const double a_high = c - (c - a);
  const double a_low = a - a_high;
  const double d = kSplit * b;
  const double b_high = d - (d - b);
  const double b_low = b - b_high;
  return {product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)};
}

template <bool fused, int width>
CRACKLE_INLINE TwiceSums fill_bonds(const Operands& of, Loads load, std::span<double> force) {
  TwiceSums sums;
  Twice energy;
  const Dof* row = of.network.bond_dof.data();
  std::size_t at = 0;
  for (std::size_t e = 0; e < force.size(); ++e, at += width, row += width) {
    force[e] = 0;
    if (of.broken[e] != 0) continue;
    Twice sum;
    double terms = 0;
    for (int i = 0; i < width; ++i) {
      const double b = of.b_high[at + i];
      const double v = of.v_high[row[i]];
      const Twice product = multiply<fused>(b, v);
      const Twice next = add(sum.high, product.high);
      terms += std::abs(product.high);
      sum = {next.high, sum.low + (next.low + (product.low + (b * of.v_low[row[i]] + of.b_low[at + i] * v)))};
    }
    const double k = of.network.stiffness[e];
    const Twice stretch = add(sum.high, sum.low);
    const Twice rounded = multiply<fused>(k, stretch.high);
    const Twice f = add(rounded.high, rounded.low + k * stretch.low);
    force[e] = f.high;
    const Twice next = add(energy.high, f.high * stretch.high);
    energy = {next.high, energy.low + next.low};
    sums.largest = std::max(sums.largest, std::abs(f.high));
    sums.terms = std::max(sums.terms, k * terms);
    for (int i = 0; i < width; ++i) {
      const double b = of.b_high[at + i];
      const Twice product = multiply<fused>(b, f.high);
      const Twice left = add(load.high[row[i]], -product.high);
      load.high[row[i]] = left.high;
      load.rest[row[i]] += left.low - (product.low + (b * f.low + of.b_low[at + i] * f.high));
    }
  }
  sums.energy = energy.high + energy.low;
  return sums;
}

template <bool fused>
CRACKLE_INLINE TwiceSums fill_all(const Operands& of, Loads load, std::span<double> force) {
  return of.network.components == 1 ? fill_bonds<fused, 2>(of, load, force)
                                    : fill_bonds<fused, 4>(of, load, force);
}

#ifdef FP_FAST_FMA
#define CRACKLE_FUSED
constexpr bool kFused = true;
#elif defined(__x86_64__)
#define CRACKLE_FUSED [[gnu::target("fma")]]
const bool kFused = __builtin_cpu_supports("fma") != 0;
#else
#define CRACKLE_FUSED
constexpr bool kFused = false;
#endif

CRACKLE_FUSED TwiceSums fill_fused(const Operands& of, Loads load, std::span<double> force) {
  return fill_all<true>(of, load, force);
}
TwiceSums fill_plain(const Operands& of, Loads load, std::span<double> force) {
  return fill_all<false>(of, load, force);
}

}  // namespace

bool TwiceBonds::can_fuse() {
  return kFused;
}

TwiceBonds::TwiceBonds(const Network& network, const QuadBonds& bonds, bool fused)
    : network_(network),
      fused_(fused),
      high_(bonds.value.size()),
      low_(bonds.value.size()),
      rest_(static_cast<std::size_t>(network.unknowns)) {
  for (std::size_t i = 0; i < high_.size(); ++i) {
    high_[i] = static_cast<double>(bonds.value[i]);
    low_[i] = static_cast<double>(bonds.value[i] - Quad(high_[i]));
  }
}

TwiceSums TwiceBonds::fill(std::span<const std::uint8_t> broken, std::span<const double> high,
                           std::span<const double> low, std::span<double> load, std::span<double> force) {
  std::ranges::fill(load, 0.0);
  std::ranges::fill(rest_, 0.0);
  const Operands of{network_, broken.data(), high_.data(), low_.data(), high.data(), low.data()};
  const Loads loads{load.data(), rest_.data()};
  const TwiceSums sums = fused_ ? fill_fused(of, loads, force) : fill_plain(of, loads, force);
  std::ranges::transform(load, rest_, load.begin(), [](double a, double b) { return a + b; });
  return sums;
}

}  // namespace crackle
