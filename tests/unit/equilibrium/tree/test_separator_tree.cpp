#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "crackle/equilibrium/tree/separator_tree.hpp"
#include "crackle/equilibrium/tree/tree_bonds.hpp"
#include "crackle/equilibrium/tree/tree_dissection.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// Fuses or springs between random points nearer than 1.6, beside them an island of two nodes, and lone nodes.
Network irregular(Model model, NodeId nodes, NodeId lone) {
  const double side = std::sqrt(static_cast<double>(nodes));
  const auto place = test::mixed_values(2 * static_cast<std::size_t>(nodes), 3);
  std::vector<Vector2> position;
  std::vector<Grip> grip;
  for (NodeId i = 0; i < nodes; ++i) {
    position.push_back({side * place[2 * i], side * place[2 * i + 1]});
    const double y = place[2 * i + 1];
    grip.push_back(y < -0.35 ? Grip::bottom : y > 0.35 ? Grip::top : Grip::free);
  }
  test::Bonds bonds;
  for (NodeId a = 0; a < nodes; ++a) {
    for (NodeId b = a + 1; b < nodes; ++b) {
      if (std::hypot(position[a].x - position[b].x, position[a].y - position[b].y) < 1.6)
        bonds.push_back({a, b});
    }
  }
  bonds.push_back({nodes, nodes + 1});
  for (NodeId i = 0; i < lone + 2; ++i) {
    position.push_back({side * (1 + 0.1 * i), 0.3 * (i % 2)});
    grip.push_back(Grip::free);
  }
  return make_network(make_lattice(0, position, grip, bonds), model, Grips::sliding, {});
}

std::vector<test::NamedNetwork> networks() {
  std::vector<test::NamedNetwork> all;
  for (const int size : {1, 2, 3, 8, 17}) {
    for (test::NamedNetwork& named : test::triangular_networks(size)) {
      all.push_back({named.name + " " + std::to_string(size), std::move(named.network)});
    }
  }
  for (const LatticeKind& kind : lattice_kinds()) {
    for (const int size : {2, 9, 16}) {
      all.push_back({std::string(kind.name) + " fuses " + std::to_string(size),
                     make_network(kind.make(size, 1e-3), Model::fuse, Grips::sliding, {})});
    }
  }
  all.push_back({"bundle", test::bundle(3)});
  all.push_back({"chain", test::chain(40)});
  all.push_back({"inclined chain", test::inclined_chain(Grips::sliding)});
  all.push_back({"irregular fuses", irregular(Model::fuse, 300, 0)});
  all.push_back({"irregular springs", irregular(Model::spring, 300, 0)});
  all.push_back({"fuses and lone nodes", irregular(Model::fuse, 50, 60)});
  all.push_back({"springs and lone nodes", irregular(Model::spring, 50, 60)});
  return all;
}

/// check(network, tree) for every network, dissection and several sizes of leaves.
template <class Check>
void for_each_tree(Check check) {
  for (const test::NamedNetwork& named : networks()) {
    for (const Dissection how : {Dissection::automatic, Dissection::coordinates, Dissection::metis}) {
      for (const int leaf : {1, kLeafUnknowns, 1000}) {
        SCOPED_TRACE(named.name + ", dissection " + std::to_string(static_cast<int>(how)) + ", leaf " +
                     std::to_string(leaf));
        check(named.network, make_separator_tree(named.network, how, leaf));
      }
    }
  }
}

TEST(SeparatorTree, EliminatesEveryUnknownOnceAndThePlateAloneAtTheEnd) {
  for_each_tree([](const Network& network, const SeparatorTree& tree) {
    std::vector<Position> times(network.unknowns, 0);
    ASSERT_EQ(tree.positions(), network.unknowns - static_cast<Dof>(network.idle.size()));
    for (Position at = 0; at < tree.positions(); ++at) {
      ++times[tree.dof[at]];
      EXPECT_EQ(tree.position[tree.dof[at]], at);
    }
    for (const Dof slot : network.idle) {
      EXPECT_EQ(tree.position[slot], -1);
      ++times[slot];
    }
    EXPECT_EQ(std::ranges::count(times, 1), network.unknowns);
    EXPECT_EQ(tree.dof.back(), network.plate);
    EXPECT_EQ(tree.front.back().pivots, 1);
    EXPECT_EQ(tree.front.back().boundary, 0);
    EXPECT_EQ(tree.front.back().parent, -1);
    EXPECT_EQ(tree.front.back().first_descendant, 0);
  });
}

TEST(SeparatorTree, HasItsFrontsInPostorder) {
  for_each_tree([](const Network& /*network*/, const SeparatorTree& tree) {
    Position next = 0;
    for (FrontId f = 0; f < tree.fronts(); ++f) {
      const Front& front = tree.front[f];
      EXPECT_EQ(front.first, next);
      for (int i = 0; i < front.pivots; ++i) EXPECT_EQ(tree.owner[next++], f);
      for (FrontId g = 0; g < f; ++g) {
        // g belongs to f's subtree when a walk up from it passes f
        FrontId up = g;
        while (up >= 0 && up < f) up = tree.front[up].parent;
        EXPECT_EQ(up == f, g >= front.first_descendant) << g << " under " << f;
      }
      EXPECT_TRUE(f + 1 == tree.fronts() || front.parent > f);
    }
    EXPECT_EQ(next, tree.positions());
  });
}

TEST(SeparatorTree, PlacesBlocksSideBySideWithColumnsOnCacheLines) {
  for_each_tree([](const Network& /*network*/, const SeparatorTree& tree) {
    std::size_t end = 0;
    std::size_t rows = 0;
    std::int64_t entries = 0;
    for (FrontId f = 0; f < tree.fronts(); ++f) {
      const Front& front = tree.front[f];
      EXPECT_EQ(front.block, end);
      EXPECT_EQ(front.rows, rows);
      EXPECT_EQ(front.stride % 8, 0);
      EXPECT_GE(front.stride, front.pivots + front.boundary);
      end += static_cast<std::size_t>(front.stride) * front.pivots;
      rows += front.boundary;
      for (int c = 0; c < front.pivots; ++c) entries += front.pivots - c + front.boundary;
    }
    EXPECT_EQ(tree.block_entries, end);
    EXPECT_EQ(tree.factor_entries, entries);
    EXPECT_EQ(tree.row.size(), rows);
    EXPECT_EQ(tree.parent_row.size(), rows);
  });
}

TEST(SeparatorTree, HasBoundariesThatBelongToAncestorsAndParentsThatHoldThem) {
  for_each_tree([](const Network& /*network*/, const SeparatorTree& tree) {
    for (FrontId f = 0; f < tree.fronts(); ++f) {
      const Front& front = tree.front[f];
      const auto boundary = tree.boundary(f);
      EXPECT_EQ(std::ranges::adjacent_find(boundary, std::ranges::greater_equal{}), boundary.end());
      std::set<FrontId> ancestors;
      for (FrontId up = front.parent; up >= 0; up = tree.front[up].parent) ancestors.insert(up);
      for (std::size_t i = 0; i < boundary.size(); ++i) {
        EXPECT_TRUE(ancestors.contains(tree.owner[boundary[i]])) << "front " << f;
        const Front& parent = tree.front[front.parent];
        const std::int32_t at = tree.parent_row[front.rows + i];
        ASSERT_GE(at, 0);
        ASSERT_LT(at, parent.pivots + parent.boundary);
        const Position there =
            at < parent.pivots ? parent.first + at : tree.boundary(front.parent)[at - parent.pivots];
        EXPECT_EQ(there, boundary[i]) << "front " << f;
      }
    }
  });
}

/// A boundary is what eliminating the front couples: its bonds' unknowns and what its children left.
TEST(SeparatorTree, FillsWhatEliminationFillsAndNothingElse) {
  for_each_tree([](const Network& network, const SeparatorTree& tree) {
    const TreeBonds bonds = make_tree_bonds(network, tree);
    std::vector<std::set<Position>> coupled(tree.fronts());
    for (FrontId f = 0; f < tree.fronts(); ++f) {
      const Front& front = tree.front[f];
      for (std::int32_t i = bonds.start[f]; i < bonds.start[f + 1]; ++i) {
        const BondId e = bonds.by_owner[i];
        for (int j = 0; j < bonds.width; ++j) {
          if (bonds.values(e)[j] != 0) coupled[f].insert(bonds.rows(e)[j]);
        }
      }
      std::set<Position> left = coupled[f];
      std::erase_if(left, [&](Position at) { return at < front.first + front.pivots; });
      EXPECT_TRUE(coupled[f].empty() || *coupled[f].begin() >= front.first);
      const auto boundary = tree.boundary(f);
      EXPECT_EQ(left, std::set<Position>(boundary.begin(), boundary.end())) << "front " << f;
      if (front.parent >= 0) coupled[front.parent].insert(left.begin(), left.end());
    }
  });
}

TEST(SeparatorTree, GivesEveryBondThatCanStretchToTheFrontThatMeetsItFirst) {
  for_each_tree([](const Network& network, const SeparatorTree& tree) {
    const TreeBonds bonds = make_tree_bonds(network, tree);
    EXPECT_EQ(bonds.by_owner.size(), static_cast<std::size_t>(network.stretchable));
    std::vector<double> from_tree(network.unknowns);
    for (BondId e = 0; e < network.bonds(); ++e) {
      if (!network.can_stretch(e)) {
        EXPECT_EQ(bonds.owner[e], -1);
        EXPECT_EQ(bonds.place[e], -1);
        continue;
      }
      EXPECT_EQ(bonds.by_owner[bonds.place[e]], e);
      EXPECT_GE(bonds.place[e], bonds.start[bonds.owner[e]]);
      EXPECT_LT(bonds.place[e], bonds.start[bonds.owner[e] + 1]);
      FrontId first = tree.fronts();
      std::ranges::fill(from_tree, 0.0);
      for (int i = 0; i < bonds.width; ++i) {
        if (bonds.values(e)[i] == 0) continue;
        from_tree[tree.dof[bonds.rows(e)[i]]] = bonds.values(e)[i];
        first = std::min(first, tree.owner[bonds.rows(e)[i]]);
      }
      EXPECT_EQ(bonds.owner[e], first);
      for (int i = 0; i < bonds.width; ++i) {
        if (network.bond_values(e)[i] == 0) continue;
        const double value = std::exchange(from_tree[network.bond_dofs(e)[i]], 0.0);
        EXPECT_DOUBLE_EQ(value, std::sqrt(network.stiffness[e]) * network.bond_values(e)[i]);
      }
      EXPECT_EQ(std::ranges::count(from_tree, 0.0), network.unknowns) << "an unknown that isn't the bond's";
    }
  });
}

TEST(SeparatorTree, ChoosesTheDissectionThatFillsLess) {
  for (const test::NamedNetwork& named : networks()) {
    SCOPED_TRACE(named.name);
    const auto entries = [&](Dissection how) {
      return make_separator_tree(named.network, how).factor_entries;
    };
    const std::int64_t coordinates = entries(Dissection::coordinates);
    const std::int64_t metis = entries(Dissection::metis);
    const std::int64_t chosen = entries(Dissection::automatic);
    EXPECT_TRUE(chosen == coordinates || chosen == metis);
    EXPECT_LE(static_cast<double>(chosen), 1.04 * static_cast<double>(std::min(coordinates, metis)));
  }
}

/// What METIS's separators filled, or straight cuts by the thinnest separator.
TEST(SeparatorTree, FillsLatticesNoMoreThanBefore) {
  const auto entries = [](const Lattice& lattice, Model model) {
    return make_separator_tree(make_network(lattice, model, Grips::sliding, {}), Dissection::automatic)
        .factor_entries;
  };
  for (const auto& [size, before] : {std::pair{8, 3095}, {16, 15884}, {32, 80913}, {64, 398900}})
    EXPECT_LE(entries(triangular_lattice(size, 1), Model::spring), before) << size;
  EXPECT_LE(entries(lattice_kinds()[0].make(64, 1), Model::fuse), 134336);
  EXPECT_LE(entries(lattice_kinds()[1].make(64, 1), Model::fuse), 90733);
  EXPECT_LE(entries(lattice_kinds()[2].make(64, 1), Model::fuse), 111345);
}

TEST(SeparatorTree, CutsWholeLatticesOfAnySizeAtLeastAsWellAsMetis) {
  for (const LatticeKind& kind : lattice_kinds()) {
    for (const int size : {13, 21, 30, 47}) {
      for (const Model model : {Model::fuse, Model::spring}) {
        if (model == Model::spring && kind.floppy != nullptr) continue;
        for (const Grips grips : {Grips::sliding, Grips::clamped}) {
          SCOPED_TRACE(std::string(kind.name) + " " + std::to_string(size));
          const Network network = make_network(kind.make(size, 0.7), model, grips, {});
          const auto chosen = make_separator_tree(network, Dissection::automatic).factor_entries;
          EXPECT_EQ(chosen, make_separator_tree(network, Dissection::coordinates).factor_entries);
          const auto metis = make_separator_tree(network, Dissection::metis).factor_entries;
          EXPECT_LE(static_cast<double>(chosen), 1.01 * static_cast<double>(metis));
        }
      }
    }
  }
}

}  // namespace
}  // namespace crackle
