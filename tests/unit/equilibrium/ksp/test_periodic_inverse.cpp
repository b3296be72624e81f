#include <gtest/gtest.h>

#include "crackle/equilibrium/ksp/periodic_inverse.hpp"
#include "crackle/network/lattices.hpp"
#include "support/dense_reference.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// x must be K^-1 b for a load on every unknown, not on the plate alone.
void expect_inverse(const Network& network, const std::string& name) {
  SCOPED_TRACE(name + ", " + std::to_string(network.lattice.nodes()) + " nodes");
  PeriodicInverse inverse(network);
  const std::vector<double> b = test::mixed_values(static_cast<std::size_t>(network.unknowns));
  std::vector<double> x(b.size());
  const std::vector<double> expected = test::DenseFactor(test::dense_matrix(network)).solve(b);
  for (const int turn : {1, 2}) {  // nothing is left over from the first
    inverse.solve(b, x);
    EXPECT_LT(test::relative_difference(x, expected), 1e-12) << "turn " << turn;
  }
}

TEST(PeriodicInverse, IsExactForTheIntactLatticeOfAnySize) {
  for (const int size : {1, 2, 3, 4, 7}) {  // rows even and odd
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      if (named.name != "uneven springs") expect_inverse(named.network, named.name);
    }
  }
}

TEST(PeriodicInverse, IsExactForAnyRowSpacingAndLayersOfStiffness) {
  const Lattice lattice = triangular_lattice(5, 0.3);
  std::vector<double> stiffness;
  for (const auto& bond : lattice.bond) stiffness.push_back(1 + 10 * lattice.position[bond[0]].y);
  for (const Grips grips : {Grips::sliding, Grips::clamped}) {
    expect_inverse(make_network(lattice, Model::spring, grips, stiffness), "layers");
  }
}

TEST(PeriodicInverse, TakesTheMeanAlongARow) {
  Network uneven = test::triangular_networks(4)[3].network;
  std::vector<double> mean = uneven.stiffness;
  const int width = 5;
  for (int row = 0; row < width; ++row) {
    const int kinds = row == width - 1 ? 1 : 3;
    for (int kind = 0; kind < kinds; ++kind) {
      double sum = 0;
      for (int i = 0; i < width; ++i) sum += mean[3 * row * width + i * kinds + kind];
      for (int i = 0; i < width; ++i) mean[3 * row * width + i * kinds + kind] = sum / width;
    }
  }
  const Network layered = make_network(uneven.lattice, Model::spring, Grips::sliding, mean);
  const std::vector<double> b = test::mixed_values(static_cast<std::size_t>(uneven.unknowns));
  std::vector<double> x(b.size());
  PeriodicInverse(uneven).solve(b, x);
  EXPECT_LT(test::relative_difference(x, test::DenseFactor(test::dense_matrix(layered)).solve(b)), 1e-12);
}

TEST(PeriodicInverse, RefusesAnotherLattice) {
  const Network chain = test::chain(3);
  test::expect_refused([&] { PeriodicInverse{chain}; }, {"-pc_type", "circulant", "-lattice triangular"});
  Lattice moved = triangular_lattice(3, 1);
  moved.position[5].x += 0.1;
  const Network other = make_network(moved, Model::spring, Grips::sliding, {});
  test::expect_refused([&] { PeriodicInverse{other}; }, {"circulant"});
}

}  // namespace
}  // namespace crackle
