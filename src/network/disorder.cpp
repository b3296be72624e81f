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
constexpr double kInclusionRadius = 1.0 / 6;   // in heights of the lattice
constexpr double kBandHalf = 0.1;

/// Two independent numbers, uniform on [0, 1).
std::array<double, 2> draw(std::uint64_t seed, std::int64_t sample, std::uint64_t bond) {
  const r123::Philox2x64 philox;
  const auto words = philox({bond, static_cast<std::uint64_t>(sample)}, {seed});
  return {static_cast<double>(words[0] >> 11) * 0x1p-53, static_cast<double>(words[1] >> 11) * 0x1p-53};
}

/// Whether both ends of a bond are where `inside` says.
template <class Inside>
bool both_ends(const Lattice& lattice, std::size_t bond, Inside inside) {
  return std::ranges::all_of(lattice.bond[bond], [&](NodeId node) { return inside(lattice.position[node]); });
}

double stiffness_of(const StiffnessOptions& options, const Lattice& lattice, std::size_t bond, double r) {
  const double height = lattice.position.back().y;
  const Vector2 centre{lattice.period_x / 2, height / 2};
  switch (options.kind) {
    case StiffnessKind::uniform:
      return 1;
    case StiffnessKind::random:
      return std::pow(options.contrast, -r);
    case StiffnessKind::inclusion:
      return both_ends(lattice, bond,
                       [&](Vector2 p) {
                         return std::hypot(p.x - centre.x, p.y - centre.y) <= kInclusionRadius * height;
                       })
                 ? options.contrast
                 : 1;
    case StiffnessKind::band:
      return both_ends(lattice, bond,
                       [&](Vector2 p) { return std::abs(p.y - centre.y) <= kBandHalf * height; })
                 ? 1 / options.contrast
                 : 1;
  }
  return 1;
}

/// Names the smallest of the sample's numbers, which says how large D may be.
[[noreturn]] void refuse_exponent(const DisorderOptions& options, std::int64_t sample, std::size_t bonds) {
  double least = 1;
  std::size_t where = 0;
  for (std::size_t bond = 0; bond < bonds; ++bond) {
    const double r = draw(options.seed, sample, bond)[0];
    if (r > 0 && r < least) {
      least = r;
      where = bond;
    }
  }
  std::array<char, 160> allowed{};
  std::snprintf(allowed.data(), allowed.size(),
                "a number up to %.4g for sample %lld, whose bond %zu has r = %.4g: r^D must be from %g",
                std::log(kLeastThreshold) / std::log(least), static_cast<long long>(sample), where, least,
                kLeastThreshold);
  std::array<char, 32> value{};
  std::snprintf(value.data(), value.size(), "%.10g", options.exponent);
  throw InputError("-disorder_exponent", value.data(), allowed.data());
}

}  // namespace

void draw_uniform_thresholds(std::uint64_t seed, std::int64_t sample, std::span<double> threshold) {
  for (std::size_t bond = 0; bond < threshold.size(); ++bond) threshold[bond] = draw(seed, sample, bond)[0];
}

void draw_thresholds(const DisorderOptions& options, std::int64_t sample, std::span<double> threshold) {
  for (std::size_t bond = 0; bond < threshold.size(); ++bond) {
    const auto [r, luck] = draw(options.seed, sample, bond);
    double& t = threshold[bond];
    t = r;
    if (options.thresholds == Thresholds::power) t = std::pow(r, options.exponent);
    if (options.thresholds == Thresholds::constant) t = 1;
    if (luck < options.zero_share) {
      t = 0;
    } else if (t < kLeastThreshold && r > 0) {
      refuse_exponent(options, sample, threshold.size());
    }
  }
}

std::vector<double> draw_stiffness(const StiffnessOptions& options, const Lattice& lattice) {
  if (options.kind == StiffnessKind::uniform && options.dilution == 0) return {};
  std::vector<double> stiffness(lattice.bond.size());
  for (std::size_t bond = 0; bond < stiffness.size(); ++bond) {
    const auto [r, luck] = draw(options.seed, kStiffnessSample, bond);
    stiffness[bond] = luck < options.dilution ? 0 : stiffness_of(options, lattice, bond, r);
  }
  return stiffness;
}

}  // namespace crackle
