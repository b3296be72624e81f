#include <gtest/gtest.h>

#include "crackle/equilibrium/equilibrium.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "support/break_record.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// A strategy whose displacements the test gives: what is left is the interface's own part.
class Given final : public Equilibrium {
 public:
  explicit Given(const Network& network, EquilibriumOptions options)
      : Equilibrium(network, options, none_), u_(static_cast<std::size_t>(network.unknowns), 1.0) {}
  explicit Given(const Network& network, BreakOn break_on = BreakOn::magnitude)
      : Equilibrium(network, {.break_on = break_on}, none_),
        u_(static_cast<std::size_t>(network.unknowns), 1.0) {}

  [[nodiscard]] std::span<const double> do_displacements() override { return u_; }
  State look(Critical& next) { return scan(u_, next); }  ///< find_critical without its distrust
  using Equilibrium::has_failed;

  std::vector<double> u_;
  bool iterating = false;      ///< what `iterates` says
  double u_after_renewal = 0;  ///< 0: the new factor gives what the old one gave
  int renewals = 0;
  int resets = 0;
  std::vector<BondId> removed;

 private:
  State search(Critical& next) override {
    (void)has_failed(1 / u_.back());  // notes F of the intact network
    return scan(u_, next);
  }
  [[nodiscard]] bool iterates() const override { return iterating; }
  bool renew() override {
    ++renewals;
    if (u_after_renewal != 0) u_[0] = u_after_renewal;
    return true;
  }
  void do_reset() override { ++resets; }
  void do_remove(BondId bond) override { removed.push_back(bond); }
  void do_settle() override {}
  [[nodiscard]] std::int64_t breaks_worth_settling() const override { return 1; }
  PhaseTimes none_;
};

BondId critical_bond(Given& equilibrium) {
  Critical next{.bond = -1};
  EXPECT_EQ(equilibrium.look(next), State::carrying);
  return next.bond;
}

TEST(Equilibrium, ScanFindsTheLargestRatioAndOfTiesTheLowestBond) {
  {
    const Network network = test::bundle(3, {1, 2, 8});
    Given equilibrium(network);
    equilibrium.u_ = {0.25};
    equilibrium.reset(std::vector{0.5, 0.25, 2.0});
    Critical next;
    ASSERT_EQ(equilibrium.look(next), State::carrying);
    EXPECT_EQ(next.bond, 1) << "ratios at unit load are 1/2, 2 and 1";
    EXPECT_EQ(next.load, 0.5);
    EXPECT_EQ(next.stiffness, 4);
  }
  {
    const Network network = test::bundle(4);
    Given equilibrium(network);
    equilibrium.reset(std::vector{2.0, 1.0, 1.0, 1.0});
    EXPECT_EQ(critical_bond(equilibrium), 1) << "equal";
    equilibrium.reset(std::vector{2.0, 1.0, 1 - 0.5 * kTie, 1.0});
    EXPECT_EQ(critical_bond(equilibrium), 1) << "equal but for rounding";
    equilibrium.reset(std::vector{2.0, 1.0, 1 - 2 * kTie, 1.0});
    EXPECT_EQ(critical_bond(equilibrium), 2) << "truly larger";
    equilibrium.reset(std::vector{2.0, 0.0, 1.0, 0.0});
    EXPECT_EQ(critical_bond(equilibrium), 1) << "no threshold at all";
  }
}

/// Three fuses side by side: u = 1/3, 1/2, 1 as they break.
TEST(Equilibrium, CheckMeasuresEveryNthBreakRenewsAndThenComplains) {
  const Network network = test::bundle(3);
  Critical next;
  Given checked(network, {.check_every = 2});
  checked.reset(std::vector{0.1, 0.2, 0.3});
  checked.u_ = {1.0 / 3};
  EXPECT_EQ(checked.find_critical(next), State::carrying);
  EXPECT_EQ(checked.counts().checks, 1);
  checked.remove(0);
  checked.u_ = {0.4};  // wrong, and nobody looks
  EXPECT_EQ(checked.find_critical(next), State::carrying);
  EXPECT_EQ(checked.counts().checks, 1);
  checked.remove(1);
  checked.u_after_renewal = 1;
  EXPECT_EQ(checked.find_critical(next), State::carrying) << "put right";
  EXPECT_EQ(checked.renewals, 1);
  EXPECT_EQ(next.load, 0.3);
  EXPECT_LT(checked.counts().largest_residual, 1e-15);

  Given hopeless(network, {.check_every = 1, .check_bound = 1e-3});
  hopeless.reset(std::vector{0.1, 0.2, 0.3});
  hopeless.u_ = {0.3};
  EXPECT_EQ(hopeless.find_critical(next), State::unsolved);
  EXPECT_EQ(hopeless.renewals, 1);
  EXPECT_NE(hopeless.complaint().find("-equilibrium_check"), std::string::npos);
  EXPECT_NE(hopeless.complaint().find("0.001"), std::string::npos) << hopeless.complaint();
}

/// Two fuses side by side, u = 1/2: a residual of d makes forces uncertain by 10 d. Ratios are 0.5 / 1 and 0.5 / 1.01.
TEST(Equilibrium, DoubtAsksForANewFactorThenForTheRefereeAndIsCountedOfAnIteration) {
  const Network network = test::bundle(2);
  const std::vector<double> threshold{1.01, 1.0};
  Critical next;
  const auto start = [&](Given& equilibrium, double u) {
    equilibrium.reset(threshold);
    equilibrium.u_ = {u};
    return equilibrium.find_critical(next);
  };
  Given certain(network, EquilibriumOptions{});
  EXPECT_EQ(start(certain, 0.5 + 1e-12), State::carrying) << "as good as a direct solver is";
  EXPECT_EQ(certain.renewals, 0);
  Given loose(network, EquilibriumOptions{});
  EXPECT_EQ(start(loose, 0.5 + 1e-5), State::carrying)
      << "1 % apart, 0.02 % uncertain; but loads are off by as much";
  EXPECT_EQ(loose.renewals, 1);
  EXPECT_EQ(loose.counts().refereed, 1);
  EXPECT_NEAR(next.load, 2, 1e-15);
  Given mended(network, EquilibriumOptions{});
  mended.u_after_renewal = 0.5;
  EXPECT_EQ(start(mended, 0.501), State::carrying);
  EXPECT_EQ(mended.renewals, 1);
  Given hopeless(network, EquilibriumOptions{});
  EXPECT_EQ(start(hopeless, 0.501), State::carrying);
  EXPECT_EQ(hopeless.renewals, 1);
  EXPECT_EQ(hopeless.counts().refereed, 1);
  EXPECT_EQ(next.bond, 1);
  EXPECT_NEAR(next.load, 2, 1e-15);
  EXPECT_EQ(hopeless.counts().doubtful, 0);
  Given iteration(network, EquilibriumOptions{});
  iteration.iterating = true;
  EXPECT_EQ(start(iteration, 0.501), State::carrying);
  EXPECT_EQ(iteration.renewals, 0);
  EXPECT_EQ(iteration.counts().doubtful, 1);
  EXPECT_EQ(iteration.counts().first_doubtful, 1);
  EXPECT_NEAR(iteration.counts().loosest_residual, 0.002, 1e-12);
  iteration.remove(1);
  iteration.u_ = {1 + 1e-3};
  EXPECT_EQ(iteration.find_critical(next), State::carrying);
  EXPECT_EQ(iteration.counts().doubtful, 1) << "only one bond is left";
}

/// A bond of threshold 0 is critical with whatever force: rounding must not break it.
TEST(Equilibrium, ABondThatIsCriticalForItsThresholdAloneIsLookedAt) {
  const Network network = test::fuses_between(3, {{0, 1}, {0, 1}, {1, 2}});
  Given equilibrium(network, EquilibriumOptions{});
  equilibrium.reset(std::vector{0.0, 1.0, 1.0});
  equilibrium.u_ = {0.5, 1.5};
  Critical next;
  EXPECT_EQ(equilibrium.find_critical(next), State::carrying) << "it carries a half";
  EXPECT_EQ(next.bond, 0);
  equilibrium.remove(1);
  equilibrium.u_ = {1e-10, 1.0};  // what looks like no force, with a residual of 1
  EXPECT_EQ(equilibrium.find_critical(next), State::carrying) << "the referee's";
  EXPECT_EQ(next.bond, 0);
  EXPECT_NEAR(next.stiffness, 0.5, 1e-15);
}

/// Ratios of thresholds far from 1 leave double's range; their order and the loads need not.
TEST(Equilibrium, ThresholdsOfAnySizeOrderAsThoseOfSizeOne) {
  const Network network = test::bundle(3);
  for (const double scale : {1e-309, 1e-200, 1.0, 1e200, 1e307}) {
    for (const char* strategy : {"tree", "dense"}) {
      PhaseTimes times;
      const auto equilibrium = make_equilibrium(network, {.strategy = strategy}, times);
      const SampleRecord record =
          test::break_record(*equilibrium, std::vector{0.5 * scale, 0.2 * scale, 0.3 * scale});
      EXPECT_EQ(record.bond, (std::vector<BondId>{1, 2, 0})) << strategy << " " << scale;
      EXPECT_NEAR(record.load[0] / (0.6 * scale), 1, 1e-12) << strategy << " " << scale;
      EXPECT_NEAR(record.load[2] / (0.5 * scale), 1, 1e-12) << strategy << " " << scale;
    }
  }
  Given negative(network);
  negative.reset(std::vector{0.5, -0.0, 0.3});
  EXPECT_EQ(critical_bond(negative), 1) << "-0 is 0";
}

/// Bonds that can't break end a sample that carries still.
TEST(Equilibrium, ASampleThatCanBreakNoMoreIsHeld) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const Network network = test::bundle(3);
  for (const char* strategy : {"tree", "dense", "ksp", "quad"}) {
    PhaseTimes times;
    const auto equilibrium = make_equilibrium(network, {.strategy = strategy}, times);
    equilibrium->reset(std::vector{kNever, 0.3, kNever});
    Critical next;
    ASSERT_EQ(equilibrium->find_critical(next), State::carrying) << strategy;
    EXPECT_EQ(next.bond, 1) << strategy;
    equilibrium->remove(1);
    EXPECT_EQ(equilibrium->find_critical(next), State::held) << strategy;
    EXPECT_EQ(equilibrium->counts().held, 1) << strategy;
    EXPECT_NEAR(equilibrium->counts().largest_left, 2.0 / 3, 1e-15) << strategy;
  }
}

TEST(Equilibrium, TensionLeavesWhatIsPressedAndFailsWithoutAny) {
  {
    const Network network = test::fuses_between(2, {{1, 0}, {0, 1}, {0, 1}});
    const std::vector<double> threshold{0.1, 0.9, 0.5};
    Given magnitude(network, BreakOn::magnitude);
    magnitude.reset(threshold);
    EXPECT_EQ(critical_bond(magnitude), 0);
    Given tension(network, BreakOn::tension);
    tension.reset(threshold);
    EXPECT_EQ(critical_bond(tension), 2);
    tension.remove(1);
    tension.remove(2);
    Critical next;
    EXPECT_EQ(tension.look(next), State::failed) << "only pressed bonds are left";
  }
  {
    const Network network = test::chain(2);
    Given equilibrium(network);
    equilibrium.reset(std::vector{0.0, 0.5});
    Critical next;
    equilibrium.u_ = {0, 0};
    EXPECT_EQ(equilibrium.look(next), State::failed);
    equilibrium.u_ = {0.5 * kNoElongation, 1};
    equilibrium.reset(std::vector{1e-300, 1.0});
    EXPECT_EQ(critical_bond(equilibrium), 1) << "an elongation that is rounding carries nothing";
  }
}

TEST(Equilibrium, NeverNamesABondThatIsBrokenOrCannotStretch) {
  {
    const Network network = test::bundle(5);
    Given equilibrium(network);
    equilibrium.reset(std::vector{0.3, 0.0, 0.5, 0.2, 0.4});
    for (const BondId expected : {1, 3, 0, 4, 2}) {
      const BondId bond = critical_bond(equilibrium);
      EXPECT_EQ(bond, expected);
      equilibrium.remove(bond);
      EXPECT_EQ(equilibrium.broken()[bond], 1);
    }
    Critical next;
    EXPECT_EQ(equilibrium.look(next), State::failed);
    EXPECT_EQ(equilibrium.removed, (std::vector<BondId>{1, 3, 0, 4, 2}));
    EXPECT_EQ(equilibrium.counts().breaks, 5);
  }
  {
    const Lattice lattice = make_lattice(0, {{0, 0}, {1, 0}, {0, 1}}, {Grip::bottom, Grip::bottom, Grip::top},
                                         {{0, 1}, {0, 2}, {1, 2}});
    const Network network = make_network(lattice, Model::fuse, Grips::sliding, {1, 0, 1});
    Given equilibrium(network);
    equilibrium.reset(std::vector{0.0, 0.0, 0.7});
    EXPECT_EQ(critical_bond(equilibrium), 2) << "0 lies in the bus bar, 1 has no stiffness";
  }
}

TEST(Equilibrium, ResetForgetsAndFailureIsAShareOfTheIntactStiffness) {
  {
    const Network network = test::bundle(2);
    Given equilibrium(network);
    equilibrium.reset(std::vector{0.1, 0.2});
    EXPECT_FALSE(equilibrium.has_failed(2));
    EXPECT_EQ(equilibrium.intact_stiffness(), 2);
    equilibrium.remove(0);
    equilibrium.reset(std::vector{0.3, 0.4});
    EXPECT_EQ(equilibrium.broken(), (std::vector<std::uint8_t>{0, 0}));
    EXPECT_EQ(equilibrium.intact_stiffness(), 0);
    EXPECT_EQ(critical_bond(equilibrium), 0);
    EXPECT_EQ(equilibrium.resets, 2);
  }
  {
    const Network network = test::bundle(1);
    Given equilibrium(network);
    equilibrium.reset(std::vector{0.1});
    EXPECT_FALSE(equilibrium.has_failed(50));
    EXPECT_FALSE(equilibrium.has_failed(51e-6));
    EXPECT_TRUE(equilibrium.has_failed(49e-6));
    EXPECT_TRUE(equilibrium.has_failed(std::numeric_limits<double>::quiet_NaN()));
    EXPECT_EQ(equilibrium.intact_stiffness(), 50);
    equilibrium.reset(std::vector{0.1});
    EXPECT_TRUE(equilibrium.has_failed(0)) << "an intact network that carries nothing";
  }
}

}  // namespace
}  // namespace crackle
