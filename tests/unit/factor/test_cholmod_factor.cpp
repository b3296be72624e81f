#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "crackle/factor/cholmod_factor.hpp"
#include "support/dense_reference.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// K by rows. The pattern is that of the bonds, whatever is broken and whatever cancels in their sum.
class Rows {
 public:
  explicit Rows(const Network& network) : network_(network), none_(network.lattice.bond.size(), 0) {
    std::vector<std::set<int>> pattern(static_cast<std::size_t>(network.unknowns));
    for (Dof dof = 0; dof < network.unknowns; ++dof) pattern[dof].insert(dof);
    for (BondId e = 0; e < network.bonds(); ++e) {
      if (!network.can_stretch(e)) continue;
      const RankOne w = test::bond_change(network, e);
      for (int i = 0; i < w.size; ++i) pattern[w.row[i]].insert(w.row.begin(), w.row.begin() + w.size);
    }
    for (const std::set<int>& row : pattern) {
      column_.insert(column_.end(), row.begin(), row.end());
      start_.push_back(static_cast<int>(column_.size()));
    }
    fill(none_);
  }

  void fill(std::span<const std::uint8_t> broken) {
    const test::DenseMatrix K = test::dense_matrix(network_, broken);
    value_.clear();
    for (std::size_t row = 0; row < K.n; ++row) {
      for (int i = start_[row]; i < start_[row + 1]; ++i) {
        value_.push_back(static_cast<double>(K(row, static_cast<std::size_t>(column_[i]))));
      }
    }
  }

  [[nodiscard]] SymmetricRows view() const {
    return {network_.unknowns, start_.data(), column_.data(), value_.data()};
  }

 private:
  const Network& network_;
  std::vector<std::uint8_t> none_;
  std::vector<int> start_{0};
  std::vector<int> column_;
  std::vector<double> value_;
};

std::vector<double> plate_load(const Network& network) {
  std::vector<double> load(static_cast<std::size_t>(network.unknowns), 0.0);
  load.back() = 1;
  return load;
}

std::vector<double> solve(CholmodFactor& factor, std::span<const double> load) {
  std::vector<double> x(load.size());
  factor.solve(load, x);
  return x;
}

std::vector<double> any_load(const Network& network) {
  return test::mixed_values(static_cast<std::size_t>(network.unknowns));
}

TEST(CholmodFactor, SolvesAndHasThePlatesStiffnessAsLastPivot) {
  {
    for (const int size : {1, 2, 5}) {
      for (const test::NamedNetwork& named : test::triangular_networks(size)) {
        SCOPED_TRACE(named.name + " " + std::to_string(size));
        const Network& network = named.network;
        const Rows rows(network);
        CholmodFactor factor(rows.view(), network.components);
        ASSERT_TRUE(factor.factor(rows.view()));
        EXPECT_TRUE(factor.pinned().empty());
        const test::DenseFactor dense(test::dense_matrix(network));
        for (const auto& load : {plate_load(network), any_load(network)}) {
          EXPECT_LT(test::relative_difference(solve(factor, load), dense.solve(load)), 1e-13);
        }
      }
    }
  }
  {
    for (const test::NamedNetwork& named : test::triangular_networks(4)) {
      SCOPED_TRACE(named.name);
      const Network& network = named.network;
      const Rows rows(network);
      CholmodFactor factor(rows.view(), network.components);
      ASSERT_TRUE(factor.factor(rows.view()));
      if (named.name != "uneven springs") {
        EXPECT_NEAR(factor.last_pivot(), test::intact_stiffness(4, network.model), 1e-13);
      }
      std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
      for (const BondId e : test::safe_removals(network, 5)) {
        broken[e] = 1;
        (void)factor.downdate(std::vector{test::bond_change(network, e)});
        const double stiffness = 1 / test::dense_displacements(network, broken)[network.plate];
        EXPECT_NEAR(factor.last_pivot(), stiffness, 1e-12);
      }
    }
  }
}

TEST(CholmodFactor, DowndatesEqualAFreshFactorAfterEveryBreak) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    SCOPED_TRACE(named.name);
    const Network& network = named.network;
    Rows rows(network);
    CholmodFactor downdated(rows.view(), network.components);
    CholmodFactor fresh(rows.view(), network.components);
    ASSERT_TRUE(downdated.factor(rows.view()));
    std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
    for (const BondId e : test::safe_removals(network, 15)) {
      broken[e] = 1;
      EXPECT_GT(downdated.downdate(std::vector{test::bond_change(network, e)}), 0.04);
      rows.fill(broken);
      ASSERT_TRUE(fresh.factor(rows.view()));
      for (const auto& load : {plate_load(network), any_load(network)}) {
        ASSERT_LT(test::relative_difference(solve(downdated, load), solve(fresh, load)), 1e-12) << e;
      }
      EXPECT_EQ(downdated.entries(), fresh.entries());
    }
  }
}

/// More bonds than one CHOLMOD call takes (64) as well: each loses a third of its stiffness.
TEST(CholmodFactor, ManyBondsAtOnceAreManyOneByOne) {
  for (const std::size_t count : {2, 7, 64, 65, 150}) {
    for (const test::NamedNetwork& named : test::triangular_networks(8)) {
      SCOPED_TRACE(named.name + " " + std::to_string(count));
      const Network& network = named.network;
      const Rows rows(network);
      CholmodFactor together(rows.view(), network.components);
      CholmodFactor singly(rows.view(), network.components);
      ASSERT_TRUE(together.factor(rows.view()) && singly.factor(rows.view()));
      std::vector<RankOne> changes;
      double slack = 1;
      for (BondId e = 0; changes.size() < count; ++e) {
        if (!network.can_stretch(e)) continue;
        changes.push_back(test::bond_change(network, e, 1.0 / 3));
        slack *= singly.downdate(std::vector{changes.back()});
      }
      EXPECT_NEAR(together.downdate(changes) / slack, 1, 1e-12);
      const auto load = any_load(network);
      EXPECT_LT(test::relative_difference(solve(together, load), solve(singly, load)), 1e-12);
    }
  }
}

TEST(CholmodFactor, SlackIsARatioOfDeterminants) {
  {
    for (const test::NamedNetwork& named : test::triangular_networks(3)) {
      SCOPED_TRACE(named.name);
      const Network& network = named.network;
      const Rows rows(network);
      CholmodFactor factor(rows.view(), network.components);
      ASSERT_TRUE(factor.factor(rows.view()));
      factor.keep();
      const test::DenseFactor dense(test::dense_matrix(network));
      for (BondId e = 0; e < network.bonds(); ++e) {
        if (!network.can_stretch(e)) continue;
        const RankOne w = test::bond_change(network, e);
        const double slack = test::dense_slack(dense, static_cast<std::size_t>(network.unknowns), w);
        EXPECT_NEAR(factor.downdate(std::vector{w}), slack, 1e-13) << "bond " << e;
        ASSERT_TRUE(factor.restore());
      }
    }
  }
  {
    for (const test::NamedNetwork& named : test::triangular_networks(3)) {
      SCOPED_TRACE(named.name);
      const Network& network = named.network;
      const Rows rows(network);
      CholmodFactor factor(rows.view(), network.components);
      ASSERT_TRUE(factor.factor(rows.view()));
      std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
      std::vector<RankOne> changes;
      for (const BondId e : test::safe_removals(network, 4)) {
        broken[e] = 1;
        changes.push_back(test::bond_change(network, e));
      }
      const auto before = test::DenseFactor(test::dense_matrix(network)).determinant();
      const auto after = test::DenseFactor(test::dense_matrix(network, broken)).determinant();
      EXPECT_NEAR(factor.downdate(changes), static_cast<double>(after / before), 1e-13);
    }
  }
}

TEST(CholmodFactor, RestoresBitForBitWhatItKept) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    SCOPED_TRACE(named.name);
    const Network& network = named.network;
    Rows rows(network);
    CholmodFactor factor(rows.view(), network.components);
    EXPECT_FALSE(factor.restore()) << "nothing is kept yet";
    ASSERT_TRUE(factor.factor(rows.view()));
    EXPECT_FALSE(factor.restore()) << "nothing is kept yet";
    factor.keep();
    const auto load = any_load(network);
    const std::vector<double> x = solve(factor, load);
    std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
    for (const BondId e : test::safe_removals(network, 8)) {
      broken[e] = 1;
      (void)factor.downdate(std::vector{test::bond_change(network, e)});
    }
    EXPECT_NE(solve(factor, load), x);
    ASSERT_TRUE(factor.restore());
    EXPECT_EQ(solve(factor, load), x);
    rows.fill(broken);
    ASSERT_TRUE(factor.factor(rows.view()));
    ASSERT_TRUE(factor.restore()) << "after another matrix was factored";
    EXPECT_EQ(solve(factor, load), x);
  }
}

TEST(CholmodFactor, PinsFloppyUnknownsAndChangesNoForce) {
  const Network floppy = test::with_node_hanging(true);
  const Network rigid = test::with_node_hanging(false);
  const Rows rows(floppy);
  CholmodFactor factor(rows.view(), 2);
  ASSERT_TRUE(factor.factor(rows.view()));
  EXPECT_EQ(factor.pinned().size(), 1u);
  const std::vector<double> u = solve(factor, plate_load(floppy));
  const std::vector<double> expected = test::dense_displacements(rigid, std::vector<std::uint8_t>(96, 0));
  for (BondId e = 0; e < floppy.bonds(); ++e) {
    const double force = rigid.stiffness[e] * elongation(rigid, e, expected);
    EXPECT_NEAR(floppy.stiffness[e] * elongation(floppy, e, u), force, 1e-13) << "bond " << e;
  }
  EXPECT_NEAR(factor.last_pivot(), 1 / expected[rigid.plate], 1e-12);
}

/// The middle node moves freely across the two springs: one null pivot, whether rounding leaves it above,
/// below or at 0.
TEST(CholmodFactor, PinsANodeBetweenTwoBondsInLine) {
  for (int i = -20; i <= 20; ++i) {
    const double x = 0.137 * i;
    if (i == 0) continue;  // upright: then no bond holds the node sideways, and the slot is idle
    SCOPED_TRACE(x);
    const Network network = test::inclined_chain(Grips::clamped, x);
    const Rows rows(network);
    CholmodFactor factor(rows.view(), 2);
    ASSERT_TRUE(factor.factor(rows.view()));
    EXPECT_EQ(factor.pinned().size(), 1u);
    EXPECT_NEAR(factor.last_pivot(), 0.5 / (1 + x * x), 1e-13);
    const std::vector<double> u = solve(factor, plate_load(network));
    for (const BondId e : {0, 1}) EXPECT_NEAR(elongation(network, e, u), std::sqrt(1 + x * x), 1e-13);
  }
}

TEST(CholmodFactor, KeepsItsPinsThroughDowndatesAndRestores) {
  const Network network = test::with_node_hanging(true);
  const Rows rows(network);
  CholmodFactor factor(rows.view(), 2);
  ASSERT_TRUE(factor.factor(rows.view()));
  factor.keep();
  const auto load = plate_load(network);
  const std::vector<double> x = solve(factor, load);
  std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
  std::vector<double> r(x.size());
  for (const BondId e : {4, 30, 77}) {
    broken[e] = 1;
    ASSERT_GT(factor.downdate(std::vector{test::bond_change(network, e)}), 0.01);
    EXPECT_LT(backward_error(network, broken, solve(factor, load), r), 1e-15) << e;
  }
  ASSERT_TRUE(factor.restore());
  EXPECT_EQ(solve(factor, load), x);
}

TEST(CholmodFactor, TellsALoosePlateAndRecovers) {
  const Network sliding = test::inclined_chain(Grips::sliding);
  const Rows loose(sliding);
  CholmodFactor never(loose.view(), 2);
  EXPECT_FALSE(never.factor(loose.view()));

  for (const test::NamedNetwork& named : test::triangular_networks(3)) {
    SCOPED_TRACE(named.name);
    const Network& network = named.network;
    Rows rows(network);
    CholmodFactor factor(rows.view(), network.components);
    std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
    for (BondId e = 0; e < network.bonds(); ++e) {
      const auto [a, b] = network.lattice.bond[e];
      broken[e] = network.lattice.grip[a] != Grip::top && network.lattice.grip[b] == Grip::top ? 1 : 0;
    }
    rows.fill(broken);
    EXPECT_FALSE(factor.factor(rows.view())) << "nothing is left at the top";
    std::ranges::fill(broken, std::uint8_t{0});
    rows.fill(broken);
    EXPECT_TRUE(factor.factor(rows.view()));
    EXPECT_NEAR(factor.last_pivot(), 1 / test::dense_displacements(network, broken)[network.plate], 1e-13);
  }
}

TEST(CholmodFactor, FollowsTheSmallestSystems) {
  {
    const Network network = test::chain(3);
    const Rows rows(network);
    CholmodFactor factor(rows.view(), 1);
    ASSERT_TRUE(factor.factor(rows.view()));
    EXPECT_NEAR(factor.last_pivot(), 1.0 / 3, 1e-15);
    EXPECT_NEAR(factor.downdate(std::vector{test::bond_change(network, 1)}), 0, 1e-15);
  }
  {
    const Network network = test::bundle(5);
    const Rows rows(network);
    CholmodFactor factor(rows.view(), 1);
    ASSERT_TRUE(factor.factor(rows.view()));
    EXPECT_NEAR(factor.last_pivot(), 5, 1e-14);
    EXPECT_EQ(factor.entries(), 1);
    EXPECT_NEAR(factor.downdate(std::vector{test::bond_change(network, 0)}), 0.8, 1e-15);
    EXPECT_NEAR(solve(factor, std::vector{1.0})[0], 0.25, 1e-15);
  }
}

}  // namespace
}  // namespace crackle
