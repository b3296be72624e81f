#include "crackle/network/laws.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace crackle {

namespace {

double uniform(double r, double /*exponent*/) {
  return r;
}
double power(double r, double exponent) {
  return std::pow(r, exponent);
}
/// P(T > t) = exp(-t^m).
double weibull(double r, double modulus) {
  return std::pow(-std::log1p(-r), 1 / modulus);
}
double constant(double /*r*/, double /*exponent*/) {
  return 1;
}

constexpr std::array kThresholdLaws = {
    ThresholdLaw{"uniform", "t = r, uniform on [0, 1)", nullptr, uniform},
    ThresholdLaw{"power", "t = r^D", "D", power},
    ThresholdLaw{"constant", "t = 1: every choice is a tie, or decided by the forces alone", nullptr,
                 constant},
    ThresholdLaw{"weibull", "t = (-ln(1 - r))^(1/m), of scale 1", "modulus m", weibull},
};

constexpr double kInclusionRadius = 1.0 / 6;  // in heights of the lattice
constexpr double kBandHalf = 0.1;

/// Whether both ends of a bond are where `inside` says.
template <class Inside>
bool both_ends(const Lattice& lattice, std::size_t bond, Inside inside) {
  return std::ranges::all_of(lattice.bond[bond], [&](NodeId node) { return inside(lattice.position[node]); });
}

double one(const Lattice& /*lattice*/, std::size_t /*bond*/, double /*contrast*/, double /*r*/) {
  return 1;
}
double random(const Lattice& /*lattice*/, std::size_t /*bond*/, double contrast, double r) {
  return std::pow(contrast, -r);
}
double inclusion(const Lattice& lattice, std::size_t bond, double contrast, double /*r*/) {
  const double height = lattice.position.back().y;
  const Vector2 centre{lattice.period_x / 2, height / 2};
  const auto inside = [&](Vector2 p) {
    return std::hypot(p.x - centre.x, p.y - centre.y) <= kInclusionRadius * height;
  };
  return both_ends(lattice, bond, inside) ? contrast : 1;
}
double band(const Lattice& lattice, std::size_t bond, double contrast, double /*r*/) {
  const double height = lattice.position.back().y;
  const auto inside = [&](Vector2 p) { return std::abs(p.y - height / 2) <= kBandHalf * height; };
  return both_ends(lattice, bond, inside) ? 1 / contrast : 1;
}

constexpr std::array kStiffnessLaws = {
    StiffnessLaw{"uniform", "1", false, one},
    StiffnessLaw{"random", "log-uniform from 1/c to 1", true, random},
    StiffnessLaw{"inclusion", "c in a disc in the middle, a sixth of the height in radius", true, inclusion},
    StiffnessLaw{"band", "1/c in the middle fifth of the height", true, band},
};

}  // namespace

std::span<const ThresholdLaw> threshold_laws() {
  return kThresholdLaws;
}

std::span<const StiffnessLaw> stiffness_laws() {
  return kStiffnessLaws;
}

}  // namespace crackle
