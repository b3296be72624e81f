#include "crackle/equilibrium/criterion.hpp"

#include <cassert>

namespace crackle {

namespace {

/// ratio[e] = f_e / t_e, or its magnitude; 0 for what is nothing. Returns the largest.
template <int width, bool magnitude>
double fill_ratios(const Network& network, std::span<const double> threshold, std::span<const double> u,
                   const Nothing<double>& nothing, std::span<double> ratio) {
  const Dof* dof = network.bond_dof.data();
  const double* value = network.bond_value.data();
  double largest = 0;
  for (std::size_t e = 0; e < ratio.size(); ++e, dof += width, value += width) {
    double stretch = 0;
    for (int i = 0; i < width; ++i) stretch += value[i] * u[dof[i]];
    const double size = magnitude ? std::abs(stretch) : stretch;
    const double force = network.stiffness[e] * size;
    ratio[e] = nothing.is_less_than(size, force) ? force / threshold[e] : 0;
    largest = std::max(largest, ratio[e]);
  }
  return largest;
}

}  // namespace

bool scan_ratios(const Network& network, std::span<const double> threshold, std::span<const double> u,
                 BreakOn break_on, std::span<double> ratio, Critical& next) {
  assert(threshold.size() == network.lattice.bond.size() && ratio.size() == threshold.size());
  assert(std::ssize(u) == network.unknowns);
  const bool magnitude = break_on == BreakOn::magnitude;
  const auto fill = network.components == 1 ? (magnitude ? fill_ratios<2, true> : fill_ratios<2, false>)
                                            : (magnitude ? fill_ratios<4, true> : fill_ratios<4, false>);
  const double plate = u[network.plate];
  const double largest = fill(network, threshold, u, Nothing<double>(plate, 1), ratio);
  if (!(largest > 0)) return false;
  const auto first =
      std::ranges::find_if(ratio, [tied = least_tied(largest)](double r) { return r >= tied; });
  next.bond = static_cast<BondId>(first - ratio.begin());
  next.load = 1 / largest;
  next.stiffness = 1 / plate;
  return true;
}

}  // namespace crackle
