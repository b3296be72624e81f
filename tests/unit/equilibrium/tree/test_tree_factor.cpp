#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "crackle/equilibrium/tree/tree_factor.hpp"
#include "support/dense_reference.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// Whatever a factor stands on, and two of them: one that follows, one that is made afresh.
struct Factors {
  SeparatorTree tree;
  TreeBonds bonds;
  TreeScratch scratch;
  TreeFactor factor;
  TreeFactor fresh;

  explicit Factors(const Network& network, bool keep = true, Dissection how = Dissection::automatic,
                   const TreeKernels& kernels = *tree_kernels().front())
      : tree(make_separator_tree(network, how, 4)),
        bonds(make_tree_bonds(network, tree)),
        scratch(tree),
        factor(tree, bonds, kernels, keep, scratch),
        fresh(tree, bonds, kernels, false, scratch) {
    factor.restore();
  }

  /// L from the diagonal down and 1/D, front by front.
  [[nodiscard]] std::vector<double> entries(const TreeFactor& of) const {
    std::vector<double> all;
    for (FrontId f = 0; f < tree.fronts(); ++f) {
      const FrontBlock block = of.block(f);
      for (int c = 0; c < block.pivots; ++c) {
        const double* column = block.entries + c * block.stride;
        all.insert(all.end(), column + c, column + block.pivots + block.boundary);
        all.push_back(of.inverse_pivots(f)[c]);
      }
    }
    return all;
  }
};

std::vector<double> displacements(const TreeFactor& factor, const Network& network) {
  std::vector<double> u(network.unknowns, -1.0);
  factor.solve_plate(u);
  return u;
}

double largest_difference(std::span<const double> a, std::span<const double> b) {
  double largest = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    const double difference = std::abs(a[i] - b[i]) / std::max(1.0, std::abs(b[i]));
    if (!(difference <= largest)) largest = difference;
  }
  return largest;
}

TEST(TreeFactor, SolvesLikeADenseMatrix) {
  for (const int size : {1, 2, 3, 7}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      for (const Dissection how : {Dissection::coordinates, Dissection::metis}) {
        SCOPED_TRACE(named.name + " " + std::to_string(size));
        const Factors made(named.network, false, how);
        const std::vector<std::uint8_t> none(named.network.bonds(), 0);
        std::vector<double> expected = test::dense_displacements(named.network, none);
        const std::vector<double> u = displacements(made.factor, named.network);
        EXPECT_LT(test::relative_difference(u, expected), 1e-13);
        EXPECT_NEAR(made.factor.stiffness() * expected[named.network.plate], 1, 1e-13)
            << "F is the last pivot";
        for (const Dof slot : named.network.idle) EXPECT_EQ(u[slot], 0);
        EXPECT_EQ(made.factor.pivots().null, 0);
      }
    }
  }
}

TEST(TreeFactor, SolvesWithThePlateHeld) {
  for (const test::NamedNetwork& named : test::triangular_networks(6)) {
    SCOPED_TRACE(named.name);
    const Factors made(named.network);
    const auto n = static_cast<std::size_t>(named.network.unknowns);
    std::vector<double> load(n);
    draw_uniform_thresholds(4, 2, load);
    for (const Dof slot : named.network.idle) load[slot] = 0;
    std::vector<double> x(n, -1.0);
    made.factor.solve_held(load, x);
    EXPECT_EQ(x[named.network.plate], 0);
    std::vector<double> left(n);
    const std::vector<std::uint8_t> none(named.network.bonds(), 0);
    residual(named.network, none, x, left);  // e_plate - K x
    left[named.network.plate] = load[named.network.plate] = 0;
    for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(-left[i], load[i], 1e-12) << i;
  }
}

TEST(TreeFactor, TheHeldSlackLeavesFOut) {
  const Network network = test::chain(2);
  Factors made(network);
  const double slack = made.factor.downdate(std::vector<BondId>{0});
  EXPECT_NEAR(slack, 0, 1e-15) << "F has gone";
  EXPECT_NEAR(made.factor.held_slack(), 0.5, 1e-15) << "the middle node still hangs on the other bond";
}

TEST(TreeFactor, IsAfterEveryRemovalWhatAFreshFactorizationIs) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    for (const TreeKernels* kernels : tree_kernels()) {
      SCOPED_TRACE(named.name + " " + kernels->name);
      const Network& network = named.network;
      Factors made(network, true, Dissection::automatic, *kernels);
      std::vector<std::uint8_t> broken(network.bonds(), 0);
      const auto bonds = test::safe_removals(network, 20);
      ASSERT_EQ(bonds.size(), 20u);
      for (const BondId e : bonds) {
        const test::DenseFactor dense(test::dense_matrix(network, broken));
        const double slack = test::dense_slack(dense, network.unknowns, test::bond_change(network, e));
        EXPECT_NEAR(made.factor.downdate(std::array{e}), slack, 1e-12) << "bond " << e;
        broken[e] = 1;
        made.fresh.factorize(broken);
        ASSERT_LT(largest_difference(made.entries(made.factor), made.entries(made.fresh)), 1e-12)
            << "bond " << e;
        EXPECT_TRUE(made.scratch.is_zero()) << "scratch is left zero";
      }
      const std::vector<double> u = displacements(made.factor, network);
      EXPECT_LT(test::relative_difference(u, test::dense_displacements(network, broken)), 1e-12);
      EXPECT_GT(made.factor.entries_updated(), 0);
      EXPECT_EQ(made.factor.factorizations(), 1);
      EXPECT_EQ(made.fresh.factorizations(), 20);
    }
  }
}

TEST(TreeFactor, TakesManyBondsAtOnceAsOneByOne) {
  for (const test::NamedNetwork& named : test::triangular_networks(9)) {
    SCOPED_TRACE(named.name);
    std::vector<BondId> bonds = test::safe_removals(named.network, 37);
    ASSERT_EQ(bonds.size(), 37u);
    for (const std::size_t count : {2u, 3u, 7u, 16u, 17u, 37u}) {
      Factors together(named.network);
      Factors apart(named.network);
      std::vector<BondId> some(bonds.begin(), bonds.begin() + static_cast<std::ptrdiff_t>(count));
      // they are taken by owner, then by number; in that order even the slacks are the same
      std::ranges::sort(some, {}, [&](BondId e) { return std::pair(together.bonds.owner[e], e); });
      double smallest = 1;
      for (const BondId e : some) smallest = std::min(smallest, apart.factor.downdate(std::array{e}));
      EXPECT_NEAR(together.factor.downdate(some), smallest, 1e-12) << count;
      EXPECT_LT(largest_difference(together.entries(together.factor), apart.entries(apart.factor)), 1e-12);
      Factors mixed(named.network);
      std::ranges::reverse(some);
      EXPECT_GT(mixed.factor.downdate(some), 0.01);
      EXPECT_LT(largest_difference(mixed.entries(mixed.factor), apart.entries(apart.factor)), 1e-12);
    }
  }
}

TEST(TreeFactor, TakesMoreBondsThanOnePassDoes) {
  for (const test::NamedNetwork& named : test::triangular_networks(24)) {
    for (const int more : {-1, 0, 1, 30}) {
      SCOPED_TRACE(named.name + " " + std::to_string(more));
      Factors made(named.network, false);
      std::vector<BondId> bonds;
      std::vector<std::uint8_t> broken(named.network.bonds(), 0);
      for (BondId e = 7; std::ssize(bonds) < TreeDowndate::kMost + more; e += 13) {
        if (!named.network.can_stretch(e)) continue;
        bonds.push_back(e);
        broken[e] = 1;
      }
      EXPECT_GT(made.factor.downdate(bonds), 0.01);
      made.fresh.factorize(broken);
      EXPECT_LT(largest_difference(made.entries(made.factor), made.entries(made.fresh)), 1e-12);
    }
  }
}

TEST(TreeFactor, RestoresBitForBit) {
  for (const test::NamedNetwork& named : test::triangular_networks(6)) {
    for (const bool keep : {true, false}) {
      SCOPED_TRACE(named.name + (keep ? ", kept" : ", made again"));
      Factors made(named.network, keep);
      const std::vector<double> before = made.entries(made.factor);
      const double stiffness = made.factor.stiffness();
      const std::vector<double> u = displacements(made.factor, named.network);
      const auto bonds = test::safe_removals(named.network, 9);
      EXPECT_GT(made.factor.downdate(bonds), 0);
      EXPECT_NE(made.entries(made.factor), before);
      made.factor.restore();
      EXPECT_EQ(made.entries(made.factor), before);
      EXPECT_EQ(made.factor.stiffness(), stiffness);
      std::vector<std::uint8_t> broken(named.network.bonds(), 0);
      broken[bonds.front()] = 1;
      made.factor.factorize(broken);
      made.factor.restore();
      EXPECT_EQ(made.entries(made.factor), before) << "after another factorization";
      EXPECT_EQ(displacements(made.factor, named.network), u);
      EXPECT_EQ(made.factor.factorizations(), keep ? 2 : 4);
      const auto e = bonds.back();
      const double slack = made.factor.downdate(std::array{e});
      made.factor.restore();
      EXPECT_EQ(made.factor.downdate(std::array{e}), slack) << "1/D and D are restored as well";
    }
  }
}

TEST(TreeFactor, PinsFloppyUnknownsAndChangesNoForce) {
  const Network floppy = test::with_node_hanging(true);
  const Network rigid = test::with_node_hanging(false);
  for (const Dissection how : {Dissection::coordinates, Dissection::metis}) {
    Factors made(floppy, true, how);
    EXPECT_EQ(made.factor.pivots().null, 1);
    const std::vector<double> intact = made.entries(made.factor);
    std::vector<std::uint8_t> broken(floppy.bonds(), 0);
    for (const BondId e : {-1, 4, 30, 77}) {
      if (e >= 0) {
        EXPECT_GT(made.factor.downdate(std::array{e}), 0.01) << e;
        broken[e] = 1;
        made.fresh.factorize(broken);
        EXPECT_EQ(made.fresh.pivots().null, 1);
        EXPECT_LT(largest_difference(made.entries(made.factor), made.entries(made.fresh)), 1e-12) << e;
      }
      const std::vector<double> u = displacements(made.factor, floppy);
      const std::vector<double> expected = test::dense_displacements(rigid, broken);
      EXPECT_NEAR(made.factor.stiffness() * expected[rigid.plate], 1, 1e-12);
      for (BondId bond = 0; bond < floppy.bonds(); ++bond) {
        const double force = rigid.stiffness[bond] * elongation(rigid, bond, expected);
        EXPECT_NEAR(floppy.stiffness[bond] * elongation(floppy, bond, u), force, 1e-12) << "bond " << bond;
      }
    }
    made.factor.restore();
    EXPECT_EQ(made.entries(made.factor), intact);
    EXPECT_EQ(made.factor.pivots().null, 1);
  }
}

TEST(TreeFactor, CountsTheNullPivotsThatBreaksLeave) {
  // Every node of the second row of a fuse lattice is cut off: as many loose pieces as nodes.
  const Network network = make_network(triangular_lattice(4, 1), Model::fuse, Grips::sliding, {});
  for (const int loose : {1, 2, 3}) {
    Factors made(network);
    std::vector<std::uint8_t> broken(network.bonds(), 0);
    for (BondId e = 0; e < network.bonds(); ++e) {
      for (int i = 0; i < loose; ++i) {
        if (std::ranges::count(network.lattice.bond[e], 5 + i) > 0) broken[e] = 1;
      }
    }
    made.factor.factorize(broken);
    EXPECT_EQ(made.factor.pivots().null, loose);
    made.factor.restore();
    EXPECT_EQ(made.factor.pivots().null, 0);
  }
}

TEST(TreeFactor, FollowsTheSmallestSystems) {
  for (const double x : {-2.74, -0.5, 0.137, 0.411, 1.0}) {
    const Network clamped = test::inclined_chain(Grips::clamped, x);
    const Factors made(clamped);
    EXPECT_EQ(made.factor.pivots().null, 1) << x;
    EXPECT_NEAR(made.factor.stiffness(), 0.5 / (1 + x * x), 1e-13);
    const Factors loose(test::inclined_chain(Grips::sliding, x));
    EXPECT_NEAR(loose.factor.stiffness(), 0, 1e-13) << "the plate is never pinned";
  }
  const Network three = test::chain(3);
  Factors chain(three);
  EXPECT_NEAR(chain.factor.stiffness(), 1.0 / 3, 1e-15);
  EXPECT_NEAR(chain.factor.downdate(std::array{1}), 0, 1e-15);
  const Network five = test::bundle(5);
  Factors bundle(five);
  EXPECT_EQ(bundle.tree.fronts(), 1);
  EXPECT_NEAR(bundle.factor.stiffness(), 5, 1e-15);
  EXPECT_NEAR(bundle.factor.downdate(std::array{0}), 0.8, 1e-15);
  EXPECT_NEAR(bundle.factor.downdate(std::array{1, 2}), 2.0 / 3, 1e-15);
  EXPECT_NEAR(bundle.factor.stiffness(), 2, 1e-14);
  EXPECT_NEAR(displacements(bundle.factor, five)[0], 0.5, 1e-14);
}

}  // namespace
}  // namespace crackle
