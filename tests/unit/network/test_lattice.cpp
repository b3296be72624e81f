#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "crackle/network/lattice.hpp"
#include "crackle/network/lattices.hpp"
#include "support/expect_refused.hpp"

namespace crackle {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(TriangularLattice, NumbersBondsNodeByNodeFromTheHorizontalOneOn) {
  for (const int size : {1, 2, 3}) {
    SCOPED_TRACE(size);
    const Lattice lattice = triangular_lattice(size, 1);
    BondId e = 0;
    for (NodeId node = 0; node < lattice.nodes(); ++node) {
      const bool top = lattice.grip[node] == Grip::top;
      const double slope = 1 / std::sqrt(5.0);
      const std::vector<Vector2> along = {{1, 0}, {slope, 2 * slope}, {-slope, 2 * slope}};
      for (int i = 0; i < (top ? 1 : 3); ++i, ++e) {
        EXPECT_EQ(lattice.bond[e][0], node);
        EXPECT_EQ(lattice.position[lattice.bond[e][1]].y, lattice.position[node].y + (i == 0 ? 0 : 1));
        EXPECT_NEAR(lattice.direction[e].x, along[i].x, 1e-15);
        EXPECT_NEAR(lattice.direction[e].y, along[i].y, 1e-15);
      }
    }
    EXPECT_EQ(e, lattice.bonds());
  }
}

TEST(TriangularLattice, JoinsEveryFreeNodeToSixOthers) {
  const Lattice lattice = triangular_lattice(4, 1);
  std::vector<std::set<NodeId>> neighbours(lattice.position.size());
  for (const auto& [a, b] : lattice.bond) {
    neighbours[a].insert(b);
    neighbours[b].insert(a);
  }
  for (NodeId node = 0; node < lattice.nodes(); ++node) {
    EXPECT_EQ(neighbours[node].size(), lattice.grip[node] == Grip::free ? 6u : 4u) << node;
  }
}

TEST(TriangularLattice, HasTheBondsAndNodesOfThePaper) {
  {
    for (const int size : {1, 2, 3, 8, 17}) {
      SCOPED_TRACE(size);
      const Lattice lattice = triangular_lattice(size, 1);
      EXPECT_EQ(lattice.period_x, size + 1);
      EXPECT_EQ(lattice.nodes(), (size + 1) * (size + 1));
      EXPECT_EQ(lattice.bonds(), (3 * size + 1) * (size + 1));
      EXPECT_EQ(lattice.direction.size(), lattice.bond.size());
      for (NodeId node = 0; node < lattice.nodes(); ++node) {
        const NodeId row = node / (size + 1);
        const Grip held = row == 0 ? Grip::bottom : row == size ? Grip::top : Grip::free;
        EXPECT_EQ(lattice.grip[node], held);
        EXPECT_EQ(lattice.position[node].y, row);
        EXPECT_EQ(lattice.position[node].x, node % (size + 1) + 0.5 * (row % 2));
      }
    }
  }
  {
    const Lattice lattice = triangular_lattice(2, std::sqrt(0.75));
    EXPECT_NEAR(lattice.direction[1].x, 0.5, 1e-15);
    EXPECT_NEAR(lattice.direction[1].y, std::sqrt(0.75), 1e-15);
    EXPECT_NEAR(lattice.direction[2].x, -0.5, 1e-15);
    EXPECT_EQ(lattice.position.back().y, 2 * std::sqrt(0.75));
  }
}

/// The direction of one bond from (x, 0) to (to_x, 1).
Vector2 direction(double period, double x, double to_x) {
  return make_lattice(period, {{x, 0}, {to_x, 1}}, {Grip::bottom, Grip::top}, {{0, 1}}).direction[0];
}

TEST(MakeLattice, TakesTheNearestImageAndOfTwoTheOneToTheRight) {
  {
    const double half = std::sqrt(0.5);
    EXPECT_NEAR(direction(4, 3.5, 0.5).x, half, 1e-15) << "across the edge, to the right";
    EXPECT_NEAR(direction(4, 0.5, 3.5).x, -half, 1e-15) << "across the edge, to the left";
    EXPECT_NEAR(direction(4, 0, 9).x, half, 1e-15) << "two periods away";
    EXPECT_NEAR(direction(4, 0, -9).x, -half, 1e-15);
    EXPECT_NEAR(direction(0, 0, 9).x, 9 / std::hypot(9, 1), 1e-15) << "not periodic";
  }
  {
    const double half = std::sqrt(0.5);
    for (const double from : {0.0, 1.0, 5.0}) {
      EXPECT_NEAR(direction(2, from, from + 1).x, half, 1e-15) << from;
      EXPECT_NEAR(direction(2, from + 1, from).x, half, 1e-15) << from;
    }
  }
}

/// Two bonds up through three nodes; a case spoils one part of it.
struct Parts {
  double period_x = 0;
  std::vector<Vector2> position{{0, 0}, {0, 1}, {0, 2}};
  std::vector<Grip> grip{Grip::bottom, Grip::free, Grip::top};
  std::vector<std::array<NodeId, 2>> bond{{0, 1}, {1, 2}};
};

struct Refusal {
  std::function<void(Parts&)> spoil;
  std::vector<std::string> message;
};

void expect_refusals(const std::vector<Refusal>& refusals) {
  for (const Refusal& refusal : refusals) {
    Parts parts;
    refusal.spoil(parts);
    SCOPED_TRACE(refusal.message.front());
    test::expect_refused([&] { (void)make_lattice(parts.period_x, parts.position, parts.grip, parts.bond); },
                         refusal.message);
  }
}

TEST(MakeLattice, RefusesBondsByTheirNumber) {
  expect_refusals({
      {[](Parts& p) {
         p.bond[1] = {1, 3};
       },
       {"node 3 of bond 1", "0 to 2"}},
      {[](Parts& p) {
         p.bond[1] = {-1, 2};
       },
       {"node -1 of bond 1", "0 to 2"}},
      {[](Parts& p) {
         p.bond[1] = {2, 2};
       },
       {"bond 1", "two different nodes"}},
      {[](Parts& p) {
         p.position[2] = {0, 1};
       },
       {"length of bond 1"}},
      {[](Parts& p) {
         p.period_x = 2;
         p.position[2] = {4, 1};
       },
       {"length of bond 1"}},
      {[](Parts& p) {
         p.position[1] = {-1e308, 0};
         p.position[2] = {1e308, 0};
       },
       {"length of bond 1"}},
  });
}

TEST(MakeLattice, RefusesNodesAndPeriodsByWhatIsWrong) {
  expect_refusals({
      {[](Parts& p) { p.position[2].x = kNan; }, {"position of node 2", "finite"}},
      {[](Parts& p) { p.position[1].y = kInfinity; }, {"position of node 1", "finite"}},
      {[](Parts& p) { p.grip[1] = static_cast<Grip>(3); }, {"grip of node 1", "3"}},
      {[](Parts& p) { p.grip[1] = static_cast<Grip>(-1); }, {"grip of node 1", "-1"}},
      {[](Parts& p) { p.grip[0] = Grip::free; }, {"grip", "bottom"}},
      {[](Parts& p) { p.grip[2] = Grip::free; }, {"grip", "top"}},
      {[](Parts& p) { p.grip.pop_back(); }, {"grip", "2", "3 nodes"}},
  });
  expect_refusals({
      {[](Parts& p) { p.period_x = -1; }, {"period_x", "-1"}},
      {[](Parts& p) { p.period_x = kInfinity; }, {"period_x", "inf"}},
      {[](Parts& p) { p.period_x = kNan; }, {"period_x", "nan"}},
  });
}

/// Two nodes at (x, 0) and (to_x, 1), a bond between them.
Lattice pair_of(double period, double x, double to_x, std::vector<Vector2> step = {}) {
  return make_lattice(period, {{x, 0}, {to_x, 1}}, {Grip::bottom, Grip::top}, {{0, 1}}, std::move(step));
}

TEST(MakeLattice, StepsSayWhichImageIsMeant) {
  const double half = std::sqrt(0.5);
  EXPECT_NEAR(pair_of(2, 0, 1, {{1, 1}}).direction[0].x, half, 1e-15);
  EXPECT_NEAR(pair_of(2, 0, 1, {{-1, 1}}).direction[0].x, -half, 1e-15);
  EXPECT_NEAR(pair_of(2, 0, 1, {{3, 1}}).direction[0].x, 3 / std::hypot(3, 1), 1e-15) << "once around";
  EXPECT_NO_THROW((void)pair_of(2, 1e9 + 0.1, 1e9 + 1.1, {{-1, 1}}))
      << "the rounding of positions is allowed";
  const std::vector<std::vector<Vector2>> wrong = {{{1, 1.001}}, {{0.999, 1}}, {{2, 1}},        {{1, -1}},
                                                   {{0, 0}},     {{kNan, 1}},  {{1, kInfinity}}};
  for (const std::vector<Vector2>& step : wrong)
    test::expect_refused([&] { (void)pair_of(2, 0, 1, step); }, {"step of bond 0 (nodes 0, 1)"});
  test::expect_refused([&] { (void)pair_of(0, 0, 1, {{-1, 1}}); }, {"step of bond 0"});
  test::expect_refused([&] { (void)pair_of(2, 0, 1, {{1, 1}, {1, 1}}); }, {"number of steps 2", "1 bonds"});
}

TEST(CheckDirections, RefusesTwoImagesThatAreEquallyNear) {
  for (const double scale : {1.0, 0.1, 1e-30, 1e20}) {
    for (const double shift : {0.0, 0.3, -7.7, 1e5}) {
      const Lattice lattice = pair_of(2 * scale, shift * scale, (shift + 1) * scale);
      test::expect_refused([&] { check_directions(lattice); },
                           {"bond 0 (nodes 0, 1)", "/network/bonds/step"});
      EXPECT_NO_THROW(check_directions(pair_of(2 * scale, shift * scale, (shift + 0.99) * scale)));
    }
  }
  EXPECT_NO_THROW(check_directions(pair_of(2, 0, 1, {{-1, 1}})));
  EXPECT_NO_THROW(check_directions(pair_of(0, 0, 1)));
  for (const int size : {1, 2, 3}) EXPECT_NO_THROW(check_directions(triangular_lattice(size, 1))) << size;
}

TEST(CheckDirections, RefusesWhatSquaresWouldLose) {
  test::expect_refused([] { check_directions(pair_of(0, 0, 1e-60)); }, {"direction of bond 0", "1e-50"});
  test::expect_refused([] { check_directions(pair_of(0, 0, 1e60)); }, {"direction of bond 0", "1e-50"});
  EXPECT_NO_THROW(check_directions(pair_of(0, 0, 0)));
  EXPECT_NO_THROW(check_directions(triangular_lattice(4, kLeastRowSpacing)));
  EXPECT_NO_THROW(check_directions(triangular_lattice(4, kLargestRowSpacing / 4)));
}

}  // namespace
}  // namespace crackle
