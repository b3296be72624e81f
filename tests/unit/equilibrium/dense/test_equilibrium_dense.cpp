#include <gtest/gtest.h>

#include "crackle/equilibrium/dense/equilibrium_dense.hpp"
#include "support/break_record.hpp"
#include "support/dense_reference.hpp"
#include "support/expect_refused.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

TEST(EquilibriumDense, IsTheLongDoubleSolution) {
  {
    PhaseTimes times;
    for (const int size : {1, 2, 3, 6}) {
      for (const test::NamedNetwork& named : test::triangular_networks(size)) {
        if (named.name == "uneven springs") continue;
        SCOPED_TRACE(named.name + " " + std::to_string(size));
        const auto equilibrium = make_equilibrium_dense(named.network, {}, times);
        equilibrium->reset(test::uniform_thresholds(named.network, 0));
        Critical next;
        ASSERT_EQ(equilibrium->find_critical(next), State::carrying);
        EXPECT_NEAR(equilibrium->intact_stiffness(), test::intact_stiffness(size, named.network.model),
                    1e-13);
      }
    }
  }
  {
    PhaseTimes times;
    for (const test::NamedNetwork& named : test::triangular_networks(3)) {
      SCOPED_TRACE(named.name);
      const auto equilibrium = make_equilibrium_dense(named.network, {}, times);
      equilibrium->reset(test::uniform_thresholds(named.network, 0));
      Critical next;
      for (int number = 0; number < 8; ++number) {
        ASSERT_EQ(equilibrium->find_critical(next), State::carrying);
        const auto expected = test::dense_displacements(named.network, equilibrium->broken());
        EXPECT_LT(test::relative_difference(equilibrium->displacements(), expected), 1e-12);
        equilibrium->remove(next.bond);
      }
      EXPECT_EQ(equilibrium->counts().breaks, 8);
      EXPECT_EQ(equilibrium->counts().unknowns, named.network.unknowns);
    }
  }
}

TEST(EquilibriumDense, PinsFloppyUnknownsAndTellsALoosePlate) {
  {
    PhaseTimes times;
    const Network network = test::inclined_chain(Grips::clamped);
    const auto equilibrium = make_equilibrium_dense(network, {}, times);
    equilibrium->reset(std::vector{0.3, 0.2});
    Critical next;
    ASSERT_EQ(equilibrium->find_critical(next), State::carrying);
    EXPECT_EQ(next.bond, 1);
    EXPECT_NEAR(next.stiffness, 0.4, 1e-14);
    EXPECT_NEAR(next.load, 0.2 * 2 / std::sqrt(5.0), 1e-14);
    EXPECT_EQ(equilibrium->counts().null_pivots, 1);
    equilibrium->remove(1);
    EXPECT_EQ(equilibrium->find_critical(next), State::failed);
  }
  {
    PhaseTimes times;
    const Network network = test::inclined_chain(Grips::sliding);
    const auto equilibrium = make_equilibrium_dense(network, {}, times);
    equilibrium->reset(std::vector{0.3, 0.2});
    Critical next;
    EXPECT_EQ(equilibrium->find_critical(next), State::failed);
  }
}

TEST(EquilibriumDense, HasNoMemoryOfEarlierSamples) {
  PhaseTimes times;
  const Network network = test::triangular_networks(4)[1].network;
  const auto equilibrium = make_equilibrium_dense(network, {}, times);
  const SampleRecord first = test::break_record(*equilibrium, test::uniform_thresholds(network, 0));
  (void)test::break_record(*equilibrium, test::uniform_thresholds(network, 1));
  const SampleRecord again = test::break_record(*equilibrium, test::uniform_thresholds(network, 0));
  EXPECT_EQ(again.bond, first.bond);
  EXPECT_EQ(again.load, first.load);
  EXPECT_EQ(again.stiffness, first.stiffness);
}

TEST(EquilibriumDense, RefusesWhatIsTooLarge) {
  PhaseTimes times;
  const Network network = make_network(triangular_lattice(100, 1), Model::spring, Grips::sliding, {});
  ASSERT_GT(network.unknowns, kMostDenseUnknowns);
  test::expect_refused([&] { (void)make_equilibrium_dense(network, {}, times); },
                       {"-equilibrium dense", std::to_string(network.unknowns), "20000"});
}

}  // namespace
}  // namespace crackle
