#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "crackle/equilibrium/tree/tree_batch.hpp"
#include "crackle/equilibrium/tree/tree_columns.hpp"
#include "crackle/equilibrium/tree/tree_predictor.hpp"
#include "crackle/equilibrium/tree/tree_search.hpp"
#include "support/break_record.hpp"
#include "support/dense_reference.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

struct Solver {
  const Network& network;
  const TreeKernels& kernels;
  SeparatorTree tree;
  TreeBonds bonds;
  TreeScratch scratch;
  TreeFactor factor;

  explicit Solver(const Network& on, const TreeKernels& with = *tree_kernels().front())
      : network(on),
        kernels(with),
        tree(make_separator_tree(on, Dissection::automatic, 6)),
        bonds(make_tree_bonds(on, tree)),
        scratch(tree),
        factor(tree, bonds, with, false, scratch) {
    factor.restore();
  }
};

/// What a strategy hands on: infinity for bonds that can't stretch.
std::vector<double> thresholds(const Network& network, std::int64_t sample) {
  std::vector<double> threshold = test::uniform_thresholds(network, sample);
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (!network.can_stretch(e)) threshold[e] = kNever;
  }
  return threshold;
}

/// Every second bond that can stretch.
std::vector<BondId> some_bonds(const Network& network) {
  std::vector<BondId> some;
  for (BondId e = 0; e < network.bonds(); e += 2) {
    if (network.can_stretch(e)) some.push_back(e);
  }
  return some;
}

std::vector<double> full_vector(const Network& network, BondId e) {
  std::vector<double> g(network.unknowns, 0.0);
  const RankOne w = test::bond_change(network, e);
  for (int i = 0; i < w.size; ++i) g[w.row[i]] = w.value[i];
  return g;
}

TEST(TreeColumns, HaveTheGramMatrixOfADenseInverse) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    SCOPED_TRACE(named.name);
    const Network& network = named.network;
    Solver solver(network);
    TreeColumns columns(solver.tree, solver.bonds, solver.factor, solver.kernels, solver.scratch);
    const std::vector<BondId> some = some_bonds(network);
    EXPECT_EQ(columns.add(std::span(some).first(5)), 5);
    EXPECT_EQ(columns.size(), kLanes);
    EXPECT_EQ(columns.add(std::span(some).subspan(5)), std::ssize(some) - 5);
    const test::DenseFactor dense(test::dense_matrix(network));
    const auto u = test::dense_displacements(network, std::vector<std::uint8_t>(network.bonds(), 0));
    std::vector<BondId> held;
    for (int i = 0; i < columns.size(); ++i) {
      if (columns.bond(i) < 0) continue;
      held.push_back(columns.bond(i));
      const double stretch = std::sqrt(network.stiffness[held.back()]) * elongation(network, held.back(), u);
      EXPECT_NEAR(columns.stretch(i), stretch, 1e-13);
      const std::vector<double> x = dense.solve(full_vector(network, columns.bond(i)));
      for (int j = 0; j < columns.size(); ++j) {
        double expected = 0;
        if (columns.bond(j) >= 0) {
          const std::vector<double> g = full_vector(network, columns.bond(j));
          for (std::size_t k = 0; k < g.size(); ++k) expected += g[k] * x[k];
        }
        ASSERT_NEAR(columns.gram(i)[j], expected, 1e-13) << i << " " << j;
        ASSERT_NEAR(columns.gram(j)[i], expected, 1e-13) << i << " " << j;
      }
    }
    std::ranges::sort(held);
    EXPECT_EQ(held, some);
    EXPECT_TRUE(solver.scratch.is_zero());
  }
}

TEST(TreeColumns, TakeAsManyAsThereIsRoomFor) {
  const Network network = test::triangular_networks(12)[0].network;
  Solver solver(network);
  TreeColumns columns(solver.tree, solver.bonds, solver.factor, solver.kernels, solver.scratch);
  const std::vector<BondId>& all = solver.bonds.by_owner;
  ASSERT_GT(std::ssize(all), TreeColumns::kMost + 3);
  EXPECT_EQ(columns.add(std::span(all).first(3)), 3);
  EXPECT_EQ(columns.add(std::span(all).subspan(3)), TreeColumns::kMost - kLanes);
  EXPECT_EQ(columns.size(), TreeColumns::kMost);
  EXPECT_EQ(columns.add(std::span(all).last(1)), 0);
  columns.clear();
  EXPECT_EQ(columns.size(), 0);
}

/// Predicts from every second bond, solves for all states, and holds them to dense solves.
class Pass {
 public:
  Pass(const Network& network, BreakOn break_on, const TreeKernels& kernels)
      : solver(network, kernels),
        threshold(thresholds(network, 0)),
        columns(solver.tree, solver.bonds, solver.factor, kernels, solver.scratch),
        predictor(network, kernels, break_on),
        search(network, solver.tree, solver.bonds, solver.factor, kernels, break_on, 0, solver.scratch) {
    in_set = some_bonds(network);
    (void)columns.add(in_set);
    predictor.clear(1 / solver.factor.stiffness());
    search.set_thresholds(threshold);
  }

  /// The first `count` of the predicted breaks happen.
  void commit(int count) {
    for (int i = 0; i < count; ++i) {
      ASSERT_TRUE(predictor.commit(columns, prediction.column[prediction.waiting + i]));
      threshold[prediction.bond[i]] = kNever;
      search.set_broken(prediction.bond[i]);
      gone.push_back(prediction.bond[i]);
    }
  }

  void solve(std::span<const double> cut) {
    std::array<std::vector<FrontId>, kMostGroups> fronts;
    for (int g = 0; g < prediction.groups(); ++g) {
      columns.combine(std::span(prediction.column).first(prediction.waiting + prediction.states - 1),
                      prediction.coefficient[g].data(), search.states(g), fronts[g]);
    }
    search.run(std::span(fronts).first(prediction.groups()), cut.data(), candidates);
  }

  /// A network without what breaks before `state`.
  [[nodiscard]] std::vector<std::uint8_t> broken(int state) const {
    std::vector<std::uint8_t> all(solver.network.bonds(), 0);
    for (const BondId e : gone) all[e] = 1;
    for (int s = 0; s < state; ++s) all[prediction.bond[s]] = 1;
    return all;
  }

  Solver solver;
  std::vector<double> threshold;
  TreeColumns columns;
  TreePredictor predictor;
  TreeSearch search;
  Prediction prediction;
  std::vector<BondId> in_set;
  std::vector<BondId> gone;
  std::vector<BondId> candidates;
};

double expected_ratio(const Network& network, BondId e, std::span<const double> u, BreakOn break_on,
                      double t) {
  const double force = network.stiffness[e] * elongation(network, e, u);
  return std::max(0.0, break_on == BreakOn::magnitude ? std::abs(force) : force) / t;
}

void expect_dense_states(const Pass& pass, BreakOn break_on) {
  const Network& network = pass.solver.network;
  for (int s = 0; s < pass.prediction.states; ++s) {
    const auto broken = pass.broken(s);
    const auto u = test::dense_displacements(network, broken);
    const double size = u.back();
    EXPECT_NEAR(pass.search.plate(s) / size, 1, 1e-10) << s;
    EXPECT_NEAR(pass.prediction.plate[s] / size, 1, 1e-10) << s;
    std::vector<double> state(network.unknowns);
    pass.search.copy_state(s, state);
    EXPECT_LT(test::relative_difference(state, u), 1e-10) << s;
    double largest = 0;
    std::array<double, kMostStates> ratios{};
    for (BondId e = 0; e < network.bonds(); ++e) {
      if (!network.can_stretch(e)) continue;
      const double stretch = std::sqrt(network.stiffness[e]) * elongation(network, e, u);
      ASSERT_NEAR(pass.search.stretch(e, s) / size, stretch / size, 1e-10) << "bond " << e << ", state " << s;
      const double ratio = expected_ratio(network, e, u, break_on, pass.threshold[e]);
      EXPECT_NEAR(pass.search.ratio(e, s) / size, ratio / size, 1e-10 / pass.threshold[e]);
      pass.search.ratios(e, pass.prediction.groups(), ratios.data());
      EXPECT_NEAR(ratios[s] / size, ratio / size, 1e-10 / pass.threshold[e]);
      if (broken[e] == 0 && std::ranges::count(pass.in_set, e) > 0) largest = std::max(largest, ratio);
    }
    EXPECT_NEAR(pass.prediction.ratio[s] / largest, 1, 1e-9) << "the largest of the set, state " << s;
  }
}

TEST(TreeSearch, HasTheForcesOfFullSolvesInEveryPredictedState) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    for (const BreakOn break_on : {BreakOn::magnitude, BreakOn::tension}) {
      for (const TreeKernels* kernels : tree_kernels()) {
        SCOPED_TRACE(named.name + " " + kernels->name);
        Pass pass(named.network, break_on, *kernels);
        const std::vector<double> cut(kMostStates, 1e300);
        for (const int most : {1, kLanes, kMostStates}) {
          pass.predictor.predict(pass.columns, pass.threshold, most, pass.prediction);
          ASSERT_GE(pass.prediction.states, std::min(most, 5));
          EXPECT_EQ(pass.prediction.waiting, std::ssize(pass.gone));
          pass.solve(cut);
          EXPECT_TRUE(pass.candidates.empty());
          expect_dense_states(pass, break_on);
          pass.commit(std::min(2, most));
        }
      }
    }
  }
}

TEST(TreeSearch, ListsEveryBondAboveTheCutOnce) {
  for (const test::NamedNetwork& named : test::triangular_networks(6)) {
    for (const BreakOn break_on : {BreakOn::magnitude, BreakOn::tension}) {
      for (const double share : {0.02, 0.3, 0.9, 2.0}) {
        SCOPED_TRACE(named.name + " " + std::to_string(share));
        Pass pass(named.network, break_on, *tree_kernels().front());
        pass.predictor.predict(pass.columns, pass.threshold, kMostStates, pass.prediction);
        pass.commit(1);
        pass.predictor.predict(pass.columns, pass.threshold, kMostStates, pass.prediction);
        std::vector<double> cut(kMostStates, 1e300);
        for (int s = 0; s < pass.prediction.states; s += 3) cut[s] = share * pass.prediction.ratio[s];
        pass.solve(cut);
        std::vector<BondId> expected;
        for (BondId e = 0; e < named.network.bonds(); ++e) {
          bool above = false;
          for (int s = 0; named.network.can_stretch(e) && s < pass.prediction.states; ++s)
            above = above || pass.search.ratio(e, s) > cut[s];
          if (above) expected.push_back(e);
        }
        std::ranges::sort(pass.candidates);
        EXPECT_EQ(pass.candidates, expected);
        EXPECT_EQ(std::ranges::count(expected, pass.gone[0]), 0) << "it is broken";
      }
    }
  }
}

TEST(TreePredictor, HasNothingToPredictWhereNothingCanBreak) {
  const Network network = test::triangular_networks(3)[0].network;
  Pass pass(network, BreakOn::magnitude, *tree_kernels().front());
  const std::vector<double> never(network.bonds(), kNever);
  pass.predictor.predict(pass.columns, never, kMostStates, pass.prediction);
  EXPECT_TRUE(pass.prediction.states == 0 && pass.prediction.groups() == 1);
}

/// Breaks a whole sample batch by batch; the breaks in order.
std::vector<VerifiedBreak> break_in_batches(Solver& solver, Precision precision,
                                            std::vector<double> threshold, BatchCounts& counts) {
  PhaseTimes times;
  TreeBatch batch(solver.network, solver.tree, solver.bonds, solver.factor, solver.kernels,
                  BreakOn::magnitude, precision, solver.scratch, times);
  batch.reset(threshold);
  const double least = kRefereedStiffness * solver.factor.stiffness();
  std::vector<std::uint8_t> broken(solver.network.bonds(), 0);
  std::vector<VerifiedBreak> breaks;
  while (true) {
    const BatchResult result = batch.next(least);
    if (result == BatchResult::failed) break;
    for (const VerifiedBreak& found : batch.verified()) {
      breaks.push_back(found);
      threshold[found.bond] = kNever;
      broken[found.bond] = 1;
      batch.remove(found.bond);
    }
    if (result == BatchResult::found && !batch.full()) continue;
    EXPECT_FALSE(result == BatchResult::stale && batch.waiting().empty()) << "no progress";
    solver.factor.factorize(broken);
    batch.refresh();
    if (solver.factor.stiffness() <= least || ::testing::Test::HasFailure()) break;
  }
  counts = batch.counts();
  return breaks;
}

TEST(TreeBatch, VerifiesTheBreaksOfTheDenseSolve) {
  for (const test::NamedNetwork& named : test::triangular_networks(7)) {
    const SampleRecord dense =
        test::break_record(named.network, {.strategy = "dense"}, test::uniform_thresholds(named.network, 1));
    for (const Precision precision : {Precision::single, Precision::all_double}) {
      const bool single = precision == Precision::single;
      SCOPED_TRACE(named.name + (single ? " single" : " double"));
      Solver solver(named.network);
      BatchCounts counts;
      const auto breaks = break_in_batches(solver, precision, thresholds(named.network, 1), counts);
      ASSERT_EQ(breaks.size(), dense.bond.size());
      for (std::size_t i = 0; i < breaks.size(); ++i) {
        EXPECT_EQ(breaks[i].bond, dense.bond[i]) << i;
        EXPECT_NEAR(breaks[i].ratio * dense.load[i], 1, 1e-11 * dense.stiffness[0] / dense.stiffness[i]) << i;
      }
      EXPECT_EQ(counts.verified, std::ssize(breaks));
      EXPECT_LT(2 * counts.passes, counts.verified) << "several breaks a pass";
      EXPECT_EQ(counts.single > 0, single);
      EXPECT_LT(counts.used_margin, 1);
    }
  }
}

}  // namespace
}  // namespace crackle
