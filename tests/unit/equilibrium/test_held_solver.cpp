#include <gtest/gtest.h>

#include <cmath>

#include "crackle/equilibrium/held_solver.hpp"
#include "crackle/equilibrium/quad/equilibrium_quad.hpp"
#include "crackle/equilibrium/tree/tree_factor.hpp"
#include "support/break_record.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// What a strategy lends: right, slow to converge, or none.
class Lent final : public HeldFactor {
 public:
  Lent(const Network& network, double share)
      : tree_(make_separator_tree(network, Dissection::automatic, 4)),
        bonds_(make_tree_bonds(network, tree_)),
        scratch_(tree_),
        factor_(tree_, bonds_, *tree_kernels().front(), false, scratch_),
        share_(share) {
    factor_.factorize({});
  }
  void follow(BondId bond) override { (void)factor_.downdate(std::vector<BondId>{bond}); }
  [[nodiscard]] bool move_plate(std::span<double> u) override {
    factor_.move_plate(1, u);
    return share_ > 0;
  }
  [[nodiscard]] bool solve_held(std::span<const double> load, std::span<double> x) override {
    factor_.solve_held(load, x);
    for (double& value : x) value *= share_;
    ++solves_;
    return true;
  }
  [[nodiscard]] std::size_t held_pins() const override { return 0; }
  [[nodiscard]] int solves() const { return solves_; }

 private:
  SeparatorTree tree_;
  TreeBonds bonds_;
  TreeScratch scratch_;
  TreeFactor factor_;
  double share_;
  int solves_ = 0;
};

/// Two stiff halves joined by bonds of this stiffness: F is about as much, and doubles of it have lost that many digits.
Network soft_across(double stiffness, Model model) {
  const Lattice lattice = triangular_lattice(6, 1);
  std::vector<double> k(lattice.bond.size(), 1.0);
  for (BondId e = 0; e < lattice.bonds(); ++e) {
    const double low = lattice.position[lattice.bond[e][0]].y;
    const double high = lattice.position[lattice.bond[e][1]].y;
    if (std::min(low, high) == 3 && std::max(low, high) == 4) k[e] = stiffness;
  }
  return make_network(lattice, model, Grips::clamped, std::move(k));
}

struct Forces {
  double stiffness = 0;
  std::vector<double> force;
};

Forces quad_forces(const Network& network, BondId gone) {
  PhaseTimes times;
  const auto quad = make_equilibrium_quad(network, {}, times);
  quad->reset(test::uniform_thresholds(network, 0));
  Critical next;
  EXPECT_EQ(quad->find_critical(next), State::carrying);
  quad->remove(gone);
  EXPECT_EQ(quad->find_critical(next), State::carrying);
  return {next.stiffness, quad->forces()};
}

void expect_forces(const HeldSolver& solver, const Forces& right) {
  EXPECT_NEAR(solver.stiffness() / right.stiffness, 1, 1e-14);
  EXPECT_LT(solver.uncertain(), 1e-14);
  for (std::size_t e = 0; e < right.force.size(); ++e) {
    EXPECT_NEAR(solver.force()[e], right.force[e], 1e-14) << e;
  }
}

TEST(HeldSolver, FindsTheForcesOf113BitsByTheFactorItIsLentAndByItsOwn) {
  for (const Model model : {Model::fuse, Model::spring}) {
    for (const double stiffness : {1e-2, 1e-7, 1e-11}) {
      SCOPED_TRACE(stiffness);
      const Network network = soft_across(stiffness, model);
      const BondId gone = 30;
      const Forces right = quad_forces(network, gone);
      std::vector<std::uint8_t> broken(network.bonds(), 0);
      broken[gone] = 1;
      PhaseTimes times;
      HeldSolver solver(network, times);
      for (const double share : {1.0, 0.2, 0.0}) {
        Lent lent(network, share);
        lent.follow(gone);
        ASSERT_EQ(solver.solve(broken, 0, &lent), HeldSolver::Outcome::solved);
        expect_forces(solver, right);
        EXPECT_EQ(lent.solves() > 0, share > 0) << share;
      }
      ASSERT_EQ(solver.solve(broken, 0, nullptr), HeldSolver::Outcome::solved);
      expect_forces(solver, right);
      ASSERT_EQ(solver.solve_wide(broken, 0), HeldSolver::Outcome::solved);
      expect_forces(solver, right);
    }
  }
}

TEST(HeldSolver, IsLooseBelowWhatCountsAsNothing) {
  const Network network = soft_across(1e-7, Model::fuse);
  const std::vector<std::uint8_t> none(network.bonds(), 0);
  PhaseTimes times;
  HeldSolver solver(network, times);
  Lent lent(network, 1);
  EXPECT_EQ(solver.solve(none, 1e-3, &lent), HeldSolver::Outcome::loose);
  EXPECT_EQ(lent.solves(), 0) << "displacements that move the plate for less energy prove it";
  EXPECT_EQ(solver.solve(none, 1e-3, nullptr), HeldSolver::Outcome::loose);
  EXPECT_EQ(solver.solve_wide(none, 1e-3), HeldSolver::Outcome::loose);
}

}  // namespace
}  // namespace crackle
