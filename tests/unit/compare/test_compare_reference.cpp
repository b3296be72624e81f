#include <gtest/gtest.h>

#include <cmath>

#include "crackle/compare/compare_reference.hpp"
#include "support/break_record.hpp"
#include "support/dense_reference.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// Forces at unit plate load by a dense factor in long double, b_e from the geometry alone.
std::vector<long double> dense_forces(const Network& network, std::span<const std::uint8_t> broken) {
  const auto n = static_cast<std::size_t>(network.unknowns);
  const test::DenseMatrix K = test::dense_matrix(network, broken);
  const test::DenseFactor factor(K);
  std::vector<double> load(n, 0.0);
  load[n - 1] = 1;
  std::vector<long double> u(n, 0.0L);
  for (int step = 0; step < 4; ++step) {  // `solve` rounds to double: refine
    std::vector<double> r(n);
    for (std::size_t i = 0; i < n; ++i) {
      long double sum = load[i];
      for (std::size_t j = 0; j < n; ++j) sum -= K(i, j) * u[j];
      r[i] = static_cast<double>(sum);
    }
    const std::vector<double> change = factor.solve(r);
    for (std::size_t i = 0; i < n; ++i) u[i] += change[i];
  }
  std::vector<long double> force(network.lattice.bond.size(), 0.0L);
  const int c = network.components;
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (broken[e] != 0) continue;
    const auto axis = test::bond_axis(network, e);
    for (int i = 0; i < 2 * c; ++i) {
      const Dof dof = network.dof[network.lattice.bond[e][i / c] * c + i % c];
      if (dof != Network::kFixed) force[e] += (i < c ? -1 : 1) * network.stiffness[e] * axis[i % c] * u[dof];
    }
  }
  return force;
}

double force_difference(const ReferenceState& state, const std::vector<long double>& expected) {
  double worst = 0;
  for (std::size_t e = 0; e < expected.size(); ++e) {
    worst = std::max(worst, static_cast<double>(std::abs(state.force[e] - expected[e])));
  }
  return worst / state.largest_force;
}

/// At every 20th break up to L = 16: both ways agree with dense long double to 1e-14, and say so themselves.
void expect_agreement(const Network& network) {
  Reference quad(network, BreakOn::magnitude, ReferenceKind::quad);
  Reference refined(network, BreakOn::magnitude, ReferenceKind::refined);
  quad.reset(test::uniform_thresholds(network, 0));
  refined.reset(test::uniform_thresholds(network, 0));
  std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
  for (int k = 0; k < 41; ++k) {
    const ReferenceState& exact = quad.solve();
    const ReferenceState& state = refined.solve();
    if (exact.state != State::carrying || exact.critical.stiffness < 0.05) break;
    if (k % 20 == 0) {
      const std::vector<long double> expected = dense_forces(network, broken);
      for (const ReferenceState* one : {&exact, &state}) {
        EXPECT_LT(force_difference(*one, expected), 1e-14) << "break " << k;
        EXPECT_LT(one->error, 1e-14) << "break " << k;
        EXPECT_GT(one->error, 0) << "break " << k;
      }
    }
    const BondId bond = exact.critical.bond;
    broken[bond] = 1;
    quad.remove(bond);
    refined.remove(bond);
  }
}

TEST(Reference, AgreesWithDenseLongDoubleAndKnowsItsError) {
  for (const int size : {4, 9}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      SCOPED_TRACE(named.name + " " + std::to_string(size));
      expect_agreement(named.network);
    }
  }
  expect_agreement(test::triangular_networks(16)[1].network);
}

/// The estimate of `refined` is honest: quad, far more accurate, finds no larger error.
TEST(Reference, RefinedIsOffByNoMoreThanItSays) {
  const Network network = test::triangular_networks(6)[3].network;
  Reference quad(network, BreakOn::magnitude, ReferenceKind::quad);
  Reference refined(network, BreakOn::magnitude, ReferenceKind::refined);
  const auto threshold = test::uniform_thresholds(network, 1);
  quad.reset(threshold);
  refined.reset(threshold);
  int breaks = 0;
  for (;; ++breaks) {
    const ReferenceState& exact = quad.solve();
    const ReferenceState& state = refined.solve();
    ASSERT_EQ(exact.state, state.state) << breaks;
    if (exact.state != State::carrying) break;
    ASSERT_EQ(exact.critical.bond, state.critical.bond) << breaks;
    double worst = 0;
    for (BondId e = 0; e < network.bonds(); ++e)
      worst = std::max(worst, std::abs(exact.force[e] - state.force[e]));
    EXPECT_LE(worst, (state.error + 3e-16) * exact.largest_force) << breaks;  // each force is rounded once
    quad.remove(exact.critical.bond);
    refined.remove(state.critical.bond);
  }
  EXPECT_GT(breaks, 15);
}

TEST(Reference, BreaksTheBondsThatDenseBreaksSampleAfterSample) {
  for (const BreakOn break_on : {BreakOn::magnitude, BreakOn::tension}) {
    for (const test::NamedNetwork& named : test::triangular_networks(5)) {
      for (const ReferenceKind kind : {ReferenceKind::quad, ReferenceKind::refined}) {
        Reference reference(named.network, break_on, kind);
        for (const std::int64_t sample : {0, 1}) {
          SCOPED_TRACE(named.name + reference.name());
          const auto threshold = test::uniform_thresholds(named.network, sample);
          const SampleRecord dense = test::break_record(
              named.network, {.strategy = "dense", .common = {.break_on = break_on}}, threshold);
          reference.reset(threshold);
          for (std::size_t k = 0; k < dense.bond.size(); ++k) {
            const ReferenceState& state = reference.solve();
            ASSERT_EQ(state.state, State::carrying);
            ASSERT_EQ(state.critical.bond, dense.bond[k]) << k;
            EXPECT_NEAR(state.critical.load / dense.load[k], 1, 1e-10) << k;
            reference.remove(dense.bond[k]);
          }
          EXPECT_EQ(reference.solve().state, State::failed);
        }
      }
    }
  }
}

TEST(Reference, PinsFloppyUnknowns) {
  const Network network = test::inclined_chain(Grips::clamped);
  for (const ReferenceKind kind : {ReferenceKind::quad, ReferenceKind::refined}) {
    Reference reference(network, BreakOn::magnitude, kind);
    reference.reset(std::vector{0.3, 0.2});
    const ReferenceState& state = reference.solve();
    ASSERT_EQ(state.state, State::carrying);
    EXPECT_NEAR(state.critical.stiffness, 0.4, 1e-14);
    EXPECT_EQ(state.critical.bond, 1);
  }
}

}  // namespace
}  // namespace crackle
