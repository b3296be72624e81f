#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "crackle/network/disorder.hpp"
#include "crackle/network/twice_bonds.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

QuadBonds bonds_of(const Network& network) {
  QuadOrder order;
  order.row.resize(static_cast<std::size_t>(network.unknowns));
  std::iota(order.row.begin(), order.row.end(), 0);
  return make_quad_bonds(network, order);
}

/// Displacements whose differences are what is left of them after ten digits have gone, with more digits than double's.
struct Displacements {
  std::vector<double> high, low;

  explicit Displacements(const Network& network)
      : high(static_cast<std::size_t>(network.unknowns)), low(high.size()) {
    draw_uniform_thresholds(5, 0, high);
    draw_uniform_thresholds(5, 1, low);
    for (double& x : high) x = 1 + 1e-10 * x;
    for (double& x : low) x *= 1e-17;
  }
  [[nodiscard]] std::vector<Quad> wide() const {
    std::vector<Quad> v(high.begin(), high.end());
    for (std::size_t i = 0; i < v.size(); ++i) v[i] += low[i];
    return v;
  }
};

struct Filled {
  std::vector<double> load, force;
  TwiceSums sums;

  Filled(const Network& network, std::span<const std::uint8_t> broken, const Displacements& v, bool fused)
      : load(static_cast<std::size_t>(network.unknowns)), force(network.bonds()) {
    TwiceBonds twice(network, bonds_of(network), fused);
    sums = twice.fill(broken, v.high, v.low, load, force);
  }
};

std::vector<std::uint8_t> some_broken(const Network& network) {
  std::vector<std::uint8_t> broken(network.bonds(), 0);
  for (std::size_t e = 0; e < broken.size(); e += 7) broken[e] = 1;
  return broken;
}

TEST(TwiceBonds, SumsAsIn113BitsWhatDoubleWouldLose) {
  for (const test::NamedNetwork& named : test::triangular_networks(6)) {
    for (const bool fused : {false, TwiceBonds::can_fuse()}) {
      SCOPED_TRACE(named.name + (fused ? " fused" : " plain"));
      const Network& network = named.network;
      const std::vector<std::uint8_t> broken = some_broken(network);
      const Displacements v(network);
      const Filled filled(network, broken, v, fused);
      const QuadBonds bonds = bonds_of(network);
      const std::vector<Quad> wide = v.wide();
      std::vector<Quad> load(wide.size(), Quad(0));
      Quad energy = 0;
      const double rounding = 16 * TwiceBonds::kRounding * filled.sums.terms;
      for (BondId e = 0; e < network.bonds(); ++e) {
        const Quad force = broken[e] != 0 ? Quad(0) : network.stiffness[e] * bonds.stretch(e, wide);
        EXPECT_NEAR(static_cast<double>((filled.force[e] - force)), 0,
                    rounding + 2e-16 * std::abs(filled.force[e]));
        energy += force * force / network.stiffness[e];
        for (int i = 0; i < bonds.width; ++i) load[bonds.rows(e)[i]] -= bonds.values(e)[i] * force;
      }
      EXPECT_NEAR(filled.sums.energy / static_cast<double>(energy), 1, 1e-14);
      for (std::size_t i = 0; i < load.size(); ++i) {
        EXPECT_NEAR(static_cast<double>(filled.load[i] - load[i]), 0,
                    rounding + 2e-16 * std::abs(filled.load[i]));
      }
    }
  }
}

TEST(TwiceBonds, HasTheSameBitsWithAndWithoutFusedMultiplyAdd) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    const std::vector<std::uint8_t> broken = some_broken(named.network);
    const Displacements v(named.network);
    const Filled plain(named.network, broken, v, false);
    const Filled best(named.network, broken, v, TwiceBonds::can_fuse());
    EXPECT_EQ(plain.load, best.load);
    EXPECT_EQ(plain.force, best.force);
    EXPECT_EQ(plain.sums.energy, best.sums.energy);
  }
}

}  // namespace
}  // namespace crackle
