#include "crackle/network/disorder.hpp"

#include <Random123/philox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "crackle/base/error.hpp"

namespace crackle {

namespace {

constexpr std::int64_t kStiffnessSample = -1;  // no sample has that number

/// Two independent numbers, uniform on [0, 1).
std::array<double, 2> draw(std::uint64_t seed, std::int64_t sample, std::uint64_t bond) {
  const r123::Philox2x64 philox;
  const auto words = philox({bond, static_cast<std::uint64_t>(sample)}, {seed});
  return {static_cast<double>(words[0] >> 11) * 0x1p-53, static_cast<double>(words[1] >> 11) * 0x1p-53};
}

bool in_range(double threshold) {
  return threshold >= kLeastThreshold && threshold <= kLargestThreshold;
}

/// The exponent nearest to the one given with which the law keeps these numbers in range: 1 does.
double last_exponent_in_range(const DisorderOptions& options, double r) {
  double good = 1;
  double bad = options.exponent;
  for (int step = 0; step < 60; ++step) {
    const double middle = std::sqrt(good * bad);
    (in_range(options.law->threshold(r, middle)) ? good : bad) = middle;
  }
  return good;
}

/// Names the bond of the sample that allows least.
[[noreturn]] void refuse_exponent(const DisorderOptions& options, std::int64_t sample, std::size_t bonds) {
  const bool too_large = options.exponent > 1;
  double allowed = options.exponent;
  std::size_t where = 0;
  double where_r = 0;
  for (std::size_t bond = 0; bond < bonds; ++bond) {
    const double r = draw(options.seed, sample, bond)[0];
    if (r == 0 || in_range(options.law->threshold(r, options.exponent))) continue;
    const double last = last_exponent_in_range(options, r);
    if (too_large ? last >= allowed : last <= allowed) continue;
    allowed = last;
    where = bond;
    where_r = r;
  }
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "a number %s %.4g for sample %lld, whose bond %zu has r = %.4g: %s must be from %g to %g",
                too_large ? "up to" : "from", allowed, static_cast<long long>(sample), where, where_r,
                options.law->meaning, kLeastThreshold, kLargestThreshold);
  std::array<char, 32> value{};
  std::snprintf(value.data(), value.size(), "%.10g", options.exponent);
  throw InputError("-disorder_exponent", value.data(), text.data());
}

}  // namespace

void draw_uniform_thresholds(std::uint64_t seed, std::int64_t sample, std::span<double> threshold) {
  for (std::size_t bond = 0; bond < threshold.size(); ++bond) threshold[bond] = draw(seed, sample, bond)[0];
}

void draw_thresholds(const DisorderOptions& options, std::int64_t sample, std::span<double> threshold) {
  for (std::size_t bond = 0; bond < threshold.size(); ++bond) {
    const auto [r, luck] = draw(options.seed, sample, bond);
    double& t = threshold[bond];
    t = luck < options.zero_share ? 0 : options.law->threshold(r, options.exponent);
    if (luck >= options.zero_share && r > 0 && !in_range(t)) {
      refuse_exponent(options, sample, threshold.size());
    }
  }
}

std::vector<double> draw_stiffness(const StiffnessOptions& options, const Lattice& lattice) {
  if (!options.law->contrasts && options.dilution == 0) return {};
  std::vector<double> stiffness(lattice.bond.size());
  for (std::size_t bond = 0; bond < stiffness.size(); ++bond) {
    const auto [r, luck] = draw(options.seed, kStiffnessSample, bond);
    stiffness[bond] =
        luck < options.dilution ? 0 : options.law->stiffness(lattice, bond, options.contrast, r);
  }
  return stiffness;
}

}  // namespace crackle
