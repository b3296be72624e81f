/// Subtrees for threads, and what threads make of one sample: the same bits, however many there are.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <tuple>

#include "crackle/equilibrium/tree/equilibrium_tree.hpp"
#include "crackle/equilibrium/tree/tree_columns.hpp"
#include "crackle/equilibrium/tree/tree_factor.hpp"
#include "crackle/equilibrium/tree/tree_parts.hpp"
#include "support/break_record.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

constexpr std::array kThreads = {2, 3, 4, 7};

std::int64_t entries_of(const SeparatorTree& tree, FrontId first, FrontId last) {
  std::int64_t sum = 0;
  for (FrontId f = first; f <= last; ++f) sum += tree.front[f].entries();
  return sum;
}

TEST(TreeParts, CutTheTreeIntoSubtreesAndATop) {
  for (const int size : {1, 2, 5, 16, 40}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      SCOPED_TRACE(named.name + " " + std::to_string(size));
      const SeparatorTree tree = make_separator_tree(named.network, Dissection::automatic);
      const TreeParts parts = make_tree_parts(tree);
      std::vector<int> covered(tree.fronts(), 0);
      for (const FrontId f : parts.top) ++covered[f];
      for (const TreePart& part : parts.part) {
        EXPECT_EQ(part.first, tree.front[part.root].first_descendant);
        EXPECT_TRUE(parts.is_top(tree.front[part.root].parent)) << "what lies above a part is the top";
        EXPECT_EQ(part.entries, entries_of(tree, part.first, part.root));
        EXPECT_LE(part.entries * kPartsAtLeast, tree.factor_entries);
        for (FrontId f = part.first; f <= part.root; ++f) ++covered[f];
      }
      EXPECT_EQ(covered, std::vector<int>(tree.fronts(), 1));
      EXPECT_TRUE(parts.is_top(tree.fronts() - 1)) << "the plate's";
      EXPECT_TRUE(size < 40 || std::ssize(parts.part) >= kPartsAtLeast / 2);
    }
  }
}

/// Every row that a part's front has, below the part or above, is found again.
TEST(TreeParts, NumberTheirRowsFromZero) {
  const Network network = test::triangular_networks(24)[0].network;
  const SeparatorTree tree = make_separator_tree(network, Dissection::automatic);
  const TreeParts parts = make_tree_parts(tree);
  for (const TreePart& part : parts.part) {
    const auto above = tree.boundary(part.root);
    for (FrontId f = part.first; f <= part.root; ++f) {
      for (std::int32_t i = 0; i < tree.front[f].boundary; ++i) {
        const Position row = tree.boundary(f)[i];
        const Position local = parts.local_row[tree.front[f].rows + i];
        EXPECT_EQ(local < part.size() ? part.begin + local : above[local - part.size()], row);
        EXPECT_EQ(local_position(tree, part, row), local);
      }
    }
  }
}

TEST(TreeParts, SplitAPath) {
  const Network network = test::triangular_networks(24)[0].network;
  const SeparatorTree tree = make_separator_tree(network, Dissection::automatic);
  const TreeBonds bonds = make_tree_bonds(network, tree);
  std::vector<std::uint8_t> on_path(tree.fronts(), 0);
  std::vector<FrontId> path;
  find_path(tree, bonds, std::array<BondId, 5>{3, 200, 201, 700, 1100}, on_path, path);
  std::vector<PartOfPath> met;
  std::vector<FrontId> rest;
  const TreeParts parts = make_tree_parts(tree);
  parts.split(path, met, rest);
  std::vector<FrontId> all = rest;
  for (const PartOfPath& each : met) {
    const TreePart& part = parts.part[each.part];
    for (std::int32_t i = each.begin; i < each.end; ++i) {
      EXPECT_TRUE(path[i] >= part.first && path[i] <= part.root);
      all.push_back(path[i]);
    }
  }
  EXPECT_GE(met.size(), 2u);
  EXPECT_TRUE(std::ranges::all_of(rest, [&](FrontId f) { return parts.is_top(f); }));
  EXPECT_TRUE(std::ranges::is_sorted(rest));
  std::ranges::sort(all);
  EXPECT_EQ(all, path);
  make_whole_tree(tree).split(path, met, rest);
  EXPECT_TRUE(met.empty());
  EXPECT_EQ(rest, path);
}

/// A factor that some threads keep current, and columns that they solve for.
struct Shared {
  SeparatorTree tree;
  TreeBonds bonds;
  TreeScratch scratch;
  TreeFactor factor;
  TreeColumns columns;
  double slack;

  Shared(const Network& network, const TreeKernels& kernels, int threads)
      : tree(make_separator_tree(network, Dissection::automatic)),
        bonds(make_tree_bonds(network, tree)),
        scratch(tree, threads),
        factor(tree, bonds, kernels, false, scratch),
        columns(tree, bonds, factor, kernels, scratch) {
    factor.restore();
    const std::vector<BondId> bond = spread(network, std::min(108, network.bonds() / 4));
    const std::size_t gone = bond.size() / 3;
    slack = factor.downdate(std::span(bond).first(gone));
    EXPECT_GT(slack, 0.01);
    (void)columns.add(std::span(bond).subspan(gone, gone / 2));
    (void)columns.add(std::span(bond).subspan(gone + gone / 2, 1));
    (void)columns.add(std::span(bond).subspan(gone + gone / 2 + 1));
  }

  /// Bonds that can stretch, far from each other and in no order.
  static std::vector<BondId> spread(const Network& network, int count) {
    std::vector<BondId> all;
    for (BondId e = 0; e < network.bonds(); ++e) {
      if (network.can_stretch(e)) all.push_back(e);
    }
    std::vector<BondId> chosen;
    chosen.reserve(count);
    for (int i = 0; i < count; ++i) chosen.push_back(all[(i * 37LL % count) * std::ssize(all) / count]);
    return chosen;
  }

  /// L, 1/D, G, right-hand sides of a combination, and the slacks: all that threads have a hand in.
  [[nodiscard]] std::vector<double> numbers() {
    std::vector<double> all{slack, factor.held_slack(), factor.stiffness()};
    for (FrontId f = 0; f < tree.fronts(); ++f) {
      const FrontBlock block = factor.block(f);
      for (int c = 0; c < block.pivots; ++c) {
        const double* column = block.entries + c * block.stride;
        all.insert(all.end(), column + c, column + block.stride);
        all.push_back(factor.inverse_pivots(f)[c]);
      }
    }
    std::vector<int> some;
    for (int i = 0; i < columns.size(); ++i) {
      all.insert(all.end(), columns.gram(i), columns.gram(i) + columns.size());
      if (columns.bond(i) >= 0 && i % 3 == 0) some.push_back(i);
    }
    const std::vector<double> coefficient = test::mixed_values(some.size() * kLanes, 7);
    std::vector<double> x(static_cast<std::size_t>(tree.positions()) * kLanes, 0.0);
    std::vector<FrontId> fronts;
    columns.combine(some, coefficient.data(), x.data(), fronts);
    all.insert(all.end(), x.begin(), x.end());
    return all;
  }
};

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

TEST(TreeParts, MakeTheSameNumbersOnAnyNumberOfThreads) {
  for (const int size : {3, 24}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      for (const TreeKernels* kernels : tree_kernels()) {
        const auto alone = Shared(named.network, *kernels, 1).numbers();
        for (const int threads : kThreads) {
          SCOPED_TRACE(named.name + " " + kernels->name + ", threads " + std::to_string(threads));
          Shared shared(named.network, *kernels, threads);
          EXPECT_TRUE(same_bits(shared.numbers(), alone));
          EXPECT_TRUE(shared.scratch.is_zero());
        }
      }
    }
  }
}

/// Large enough for threads to share the rows of fronts.
TEST(TreeParts, ShareLargeFrontsToTheSameBits) {
  for (const Model model : {Model::spring, Model::fuse}) {
    const Network network =
        make_network(triangular_lattice(model == Model::spring ? 64 : 100, 1), model, Grips::sliding, {});
    for (const TreeKernels* kernels : tree_kernels()) {
      SCOPED_TRACE(kernels->name);
      const auto alone = Shared(network, *kernels, 1).numbers();
      Shared shared(network, *kernels, 3);
      EXPECT_TRUE(std::ranges::any_of(shared.scratch.parts().top, [&](FrontId f) {
        return shared.scratch.shares(kLanes * shared.tree.front[f].entries());
      })) << "no front is large enough";
      EXPECT_TRUE(same_bits(shared.numbers(), alone));
    }
  }
}

TEST(EquilibriumTree, BreaksASampleToTheSameBitsOnAnyNumberOfThreads) {
  for (const int size : {1, 16, 24}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      const auto bits = [&](int threads) {
        PhaseTimes times;
        const auto tree = make_equilibrium_tree(named.network, {}, times, {.threads = threads});
        const SampleRecord record = test::break_record(*tree, test::uniform_thresholds(named.network, 2));
        return std::tuple(record.bond, record.load, record.stiffness);
      };
      const auto alone = bits(1);
      for (const int threads : kThreads) EXPECT_EQ(bits(threads), alone) << named.name << " " << threads;
    }
  }
}

}  // namespace
}  // namespace crackle
