/// A factor that has been downdated through a whole large sample is still as good as a fresh one.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/break_record.hpp"
#include "verification.hpp"

namespace crackle::verification {

namespace {

constexpr double kBackwardError = 1e-14;  ///< measured: 3e-16 after 4673 downdates
/// Force error of the downdated factor over that of a fresh one: both lose what K's condition takes.
constexpr double kLoss = 10;
constexpr double kTreeForceError = 1e-10;  ///< measured: 1e-12 at every 500th break, over the largest force

/// Largest difference of a force, over the largest force.
double force_error(const Network& network, const std::vector<std::uint8_t>& broken,
                   const std::vector<double>& u, const std::vector<double>& reference) {
  double difference = 0;
  double largest = 0;
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (broken[e] != 0) continue;
    const double force = elongation(network, e, reference);
    difference = std::max(difference, std::abs(force - elongation(network, e, u)));
    largest = std::max(largest, std::abs(force));
  }
  return difference / largest;
}

TEST(LongChain, ForcesAfterAllDowndatesOfSize128) {
  const Network network = triangular({Model::spring, Grips::sliding, BreakOn::magnitude, 128});
  PhaseTimes times;
  const auto equilibrium = start(kUpdown, network, BreakOn::magnitude, times);
  equilibrium->reset(test::uniform_thresholds(network, 0));
  std::vector<double> u;
  std::vector<std::uint8_t> broken;
  Critical next;
  while (equilibrium->find_critical(next) == State::carrying) {
    u.assign(equilibrium->displacements().begin(), equilibrium->displacements().end());
    broken = equilibrium->broken();
    equilibrium->remove(next.bond);
  }
  ASSERT_GT(equilibrium->counts().breaks, 4000);
  EXPECT_EQ(equilibrium->counts().factorizations, 1);
  std::vector<double> workspace(u.size());
  const double residual = backward_error(network, broken, u, workspace);
  const std::vector<double> reference = solve_afresh(network, broken, 5);
  const double error = force_error(network, broken, u, reference);
  const double fresh_error = force_error(network, broken, solve_afresh(network, broken), reference);
  std::printf("breaks %lld, backward error %.2g, force error %.2g (fresh factor %.2g), F/F0 %.2g\n",
              static_cast<long long>(equilibrium->counts().breaks), residual, error, fresh_error,
              next.stiffness / equilibrium->intact_stiffness());
  EXPECT_LT(residual, kBackwardError);
  EXPECT_LT(error, kLoss * fresh_error);
}

TEST(LongChain, TreeAtEvery500thBreakOfSize128) {
  const Network network = triangular({Model::spring, Grips::sliding, BreakOn::magnitude, 128});
  PhaseTimes times;
  const auto equilibrium = start(kTree, network, BreakOn::magnitude, times);
  equilibrium->reset(test::uniform_thresholds(network, 0));
  std::vector<double> workspace(static_cast<std::size_t>(network.unknowns));
  Critical next;
  int checked = 0;
  for (int k = 0; equilibrium->find_critical(next) == State::carrying; ++k) {
    if (k % 500 == 0) {
      const std::vector<double> u(equilibrium->displacements().begin(), equilibrium->displacements().end());
      const double residual = backward_error(network, equilibrium->broken(), u, workspace);
      const double error =
          force_error(network, equilibrium->broken(), u, solve_afresh(network, equilibrium->broken(), 5));
      std::printf("break %d: backward error %.2g, force error %.2g\n", k, residual, error);
      EXPECT_LT(residual, kBackwardError);
      EXPECT_LT(error, kTreeForceError);
      ++checked;
    }
    equilibrium->remove(next.bond);
  }
  EXPECT_GE(checked, 9);
  EXPECT_EQ(equilibrium->counts().refactors, 0);
}

}  // namespace

}  // namespace crackle::verification
