#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "crackle/equilibrium/tree/tree_columns.hpp"
#include "crackle/equilibrium/tree/tree_predictor.hpp"
#include "crackle/equilibrium/tree/tree_search.hpp"
#include "support/break_record.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kNeverCut = 1e30;

using Flags = std::vector<std::uint8_t>;

/// A network, some of its bonds gone.
struct Case {
  std::string name;
  Network network;
  Flags broken;
};

/// Stiffnesses of c^r, r uniform on [0, 1).
Network contrasted(const Network& network, double contrast) {
  std::vector<double> stiffness(network.bonds());
  draw_uniform_thresholds(5, 0, stiffness);
  for (double& k : stiffness) k = std::pow(contrast, k);
  return make_network(network.lattice, network.model, network.grips, stiffness);
}

/// Every bond with probability `share`.
Flags some_broken(const Network& network, double share) {
  std::vector<double> draw(network.bonds());
  draw_uniform_thresholds(6, 0, draw);
  Flags broken(network.bonds());
  std::ranges::transform(draw, broken.begin(), [share](double r) { return r < share ? 1 : 0; });
  return broken;
}

/// All that holds the upper grip are two inclined bonds of one node, of stiffness 1e-8: F has fallen by that much.
Case hanging(const test::NamedNetwork& named) {
  const Lattice& lattice = named.network.lattice;
  std::vector<double> stiffness(lattice.bond.size(), 1.0);
  Flags broken(lattice.bond.size(), 0);
  int kept = 0;
  for (BondId e = 0; e < lattice.bonds(); ++e) {
    const auto [a, b] = lattice.bond[e];
    if ((lattice.grip[a] == Grip::top) == (lattice.grip[b] == Grip::top)) continue;
    broken[e] = kept < 2 ? 0 : 1;
    stiffness[e] = 1e-8;
    ++kept;
  }
  return {named.name + ", hanging",
          make_network(lattice, named.network.model, named.network.grips, stiffness), broken};
}

std::vector<Case> cases(int size) {
  std::vector<Case> all;
  for (const test::NamedNetwork& named : test::triangular_networks(size)) {
    const Network& network = named.network;
    const Flags none(network.bonds(), 0);
    all.push_back({named.name, network, none});
    all.push_back({named.name + ", damaged", network, some_broken(network, 0.15)});
    all.push_back({named.name + ", contrast 1e4", contrasted(network, 1e4), none});
    all.push_back({named.name + ", contrast 1e8", contrasted(network, 1e8), none});
    all.push_back(hanging(named));
  }
  return all;
}

/// States after breaks of a set of bonds, from a factor and in both precisions.
class Pass {
 public:
  Pass(const Case& made, const TreeKernels& kernels, int groups, BreakOn break_on = BreakOn::magnitude)
      : network(made.network),
        threshold(test::uniform_thresholds(network, 0)),
        most_(groups * kLanes),
        tree_(make_separator_tree(network, Dissection::automatic)),
        bonds_(make_tree_bonds(network, tree_)),
        scratch_(tree_),
        factor_(tree_, bonds_, kernels, false, scratch_),
        columns_(tree_, bonds_, factor_, kernels, scratch_),
        predictor_(network, kernels, break_on),
        kernels_(kernels),
        break_on_(break_on) {
    factor_.factorize(made.broken);
    for (BondId e = 0; e < network.bonds(); ++e) {
      if (!network.can_stretch(e) || made.broken[e] != 0) threshold[e] = kNever;
    }
    predict();
  }

  [[nodiscard]] TreeSearch make_search() {
    TreeSearch search(network, tree_, bonds_, factor_, kernels_, break_on_, most_ / kLanes, scratch_);
    search.set_thresholds(threshold);
    return search;
  }

  /// Some of those that are left make the set, and break in the order in which they would if they were alone.
  void predict() {
    const auto some = std::max<std::size_t>(1, bonds_.by_owner.size() / 90);
    std::vector<BondId> set;
    for (std::size_t i = 0; i < bonds_.by_owner.size(); i += some) {
      if (std::isfinite(threshold[bonds_.by_owner[i]])) set.push_back(bonds_.by_owner[i]);
    }
    columns_.clear();
    columns_.add(set);
    predictor_.clear(1 / factor_.stiffness());
    predictor_.predict(columns_, threshold, most_, prediction);
  }

  /// The factor takes in the first breaks of the prediction; another prediction begins.
  void take_in(int breaks) {
    const auto gone = std::span<const BondId>(prediction.bond).first(breaks);
    for (const BondId e : gone) threshold[e] = kNever;
    ASSERT_GT(factor_.downdate(gone), 1e-6);
    predict();
  }

  void solve_single(TreeSearch& search, std::span<const double> cut) {
    std::array<std::vector<FrontId>, kMostGroups> fronts;
    for (int g = 0; g < prediction.groups(); ++g) {
      columns_.combine_single(std::span(prediction.column).first(prediction.states - 1),
                              prediction.coefficient[g].data(), search.single_states() + g * kLanes,
                              search.single_lanes(), fronts[g]);
    }
    search.run_single(std::span(fronts).first(prediction.groups()), cut, candidates);
  }

  void solve_double(TreeSearch& search) {
    std::array<std::vector<FrontId>, kMostGroups> fronts;
    for (int g = 0; g < prediction.groups(); ++g) {
      columns_.combine(std::span(prediction.column).first(prediction.states - 1),
                       prediction.coefficient[g].data(), search.states(g), fronts[g]);
    }
    const std::vector<double> cut(kMostStates, kNeverCut);
    search.run(std::span(fronts).first(prediction.groups()), cut.data(), candidates);
  }

  /// |d'|_max of a state, by the last single pass.
  [[nodiscard]] double largest_difference(TreeSearch& search, int state) const {
    double most = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(tree_.positions()); ++i)
      most = std::max<double>(most, std::abs(search.single_states()[i * search.single_lanes() + state]));
    return most;
  }
  [[nodiscard]] const std::vector<BondId>& stretchable() const { return bonds_.by_owner; }

  const Network& network;
  std::vector<double> threshold;  // infinite: broken, or can't stretch
  Prediction prediction;
  std::vector<BondId> candidates;

 private:
  int most_;
  SeparatorTree tree_;
  TreeBonds bonds_;
  TreeScratch scratch_;
  TreeFactor factor_;
  TreeColumns columns_;
  TreePredictor predictor_;
  const TreeKernels& kernels_;
  BreakOn break_on_;
};

/// What a single pass says.
struct Said {
  std::vector<double> margin;   // [states]
  std::vector<double> stretch;  // [states * stretchable]
  double per_size = 0;          // margin over |d'|_max

  bool operator==(const Said&) const = default;
};

Said look(Pass& pass, TreeSearch& search) {
  const std::vector<double> cut(kMostStates, kNeverCut);
  pass.solve_single(search, cut);
  Said said;
  for (int s = 0; s < pass.prediction.states; ++s) {
    said.margin.push_back(search.stretch_margin(s));
    const double most = pass.largest_difference(search, s);
    if (most > 0) said.per_size = said.margin.back() / most;
    for (const BondId e : pass.stretchable()) said.stretch.push_back(search.stretch(e, s));
  }
  return said;
}

/// What the bound of a margin is in double, of u0 and of a reference: by how much two stretches in double may differ in
/// a state of an exact pass.
double double_bound(const Pass& pass, const TreeSearch& search, const Said& said, int state) {
  constexpr double kDoubleToSingle = 0x1p-29;
  std::vector<double> u(pass.network.unknowns);
  search.copy_state(state, u);
  double size = 0;
  for (const double each : u) size = std::max(size, std::abs(each));
  return 2 * kDoubleToSingle * said.per_size * size;
}

/// Largest error of a stretch over what it may be.
double used_margin(Pass& pass, TreeSearch& search, const Said& said) {
  pass.solve_double(search);
  double used = 0;
  auto single = said.stretch.begin();
  for (int s = 0; s < pass.prediction.states; ++s) {
    const double allowed = said.margin[s] + double_bound(pass, search, said, s);
    for (const BondId e : pass.stretchable()) {
      const double error = std::abs(*single++ - search.stretch(e, s));
      if (std::isnan(error)) return kNever;
      if (error > 0) used = std::max(used, error / allowed);
    }
  }
  return used;
}

/// The bound is never reached, and is not out of all proportion: a margin of a hundred-thousandth would be seen.
TEST(TreeSingle, IsNoFurtherFromDoubleThanItsMargin) {
  for (const int size : {7, 20}) {
    for (const Case& made : cases(size)) {
      int looked = 0;
      for (const TreeKernels* kernels : tree_kernels()) {
        for (const int groups : {1, 2}) {
          SCOPED_TRACE(made.name + " " + std::to_string(size) + " " + kernels->name);
          Pass pass(made, *kernels, groups);
          if (pass.prediction.states == 1) continue;  // no difference to look at
          ++looked;
          TreeSearch search = pass.make_search();
          ASSERT_TRUE(search.searches_in_single());
          const Said said = look(pass, search);
          EXPECT_EQ(said.margin[0], 0) << "the factor's own state is known in double";
          const double used = used_margin(pass, search, said);
          EXPECT_LE(used, 1);
          EXPECT_GT(used, 1e-5);
        }
      }
      EXPECT_TRUE(looked > 0 || made.name.ends_with("1e8")) << made.name;
    }
  }
}

/// Only fronts that a downdate has met are taken over again: to the bits of what is made anew.
TEST(TreeSingle, FollowsDowndatesToTheBitsOfANewOne) {
  for (const Case& made : cases(9)) {
    for (const TreeKernels* kernels : tree_kernels()) {
      SCOPED_TRACE(made.name + " " + kernels->name);
      Pass pass(made, *kernels, 1);
      TreeSearch search = pass.make_search();
      (void)look(pass, search);
      for (int turn = 0; turn < 3; ++turn) {
        pass.take_in(std::min(2, pass.prediction.states - 1));
        if (pass.prediction.states == 1) break;  // and no difference to look at
        const Said stale = look(pass, search);
        EXPECT_GT(used_margin(pass, search, stale), 1) << "a factor of before is seen to be wrong";
        search.set_thresholds(pass.threshold);
        search.refresh();
        const Said said = look(pass, search);
        TreeSearch anew = pass.make_search();
        EXPECT_TRUE(look(pass, anew) == said);
        EXPECT_LE(used_margin(pass, search, said), 1);
      }
    }
  }
}

/// Of a bond's ratio, over all states: margins are guessed from the widest of the pass before.
double widest_margin(const Pass& pass, const TreeSearch& search, BondId e) {
  double widest = 0;
  for (int s = 0; s < pass.prediction.states; ++s) widest = std::max(widest, search.margin(e, s));
  return widest;
}

/// Ratios of an exact pass, and by how much they may be wrong; of stretchable bonds.
struct Ratios {
  std::vector<double> ratio;
  std::vector<double> error;
};

std::vector<Ratios> ratios(Pass& pass, TreeSearch& search) {
  const Said said = look(pass, search);
  pass.solve_double(search);
  std::vector<Ratios> all(pass.prediction.states);
  for (int s = 0; s < pass.prediction.states; ++s) {
    const double bound = double_bound(pass, search, said, s);
    for (const BondId e : pass.stretchable()) {
      all[s].ratio.push_back(search.ratio(e, s));
      all[s].error.push_back(bound * std::sqrt(pass.network.stiffness[e]) / pass.threshold[e]);
    }
  }
  return all;
}

/// Cuts just below a bond's ratio in double, which is all that a pass may rely on.
void expect_listed(Pass& pass, TreeSearch& search) {
  const std::vector<Ratios> exact = ratios(pass, search);
  for (std::size_t i = 0; i < pass.stretchable().size(); i += 3) {
    const int s = static_cast<int>(i) % pass.prediction.states;
    const auto& [ratio, error] = exact[s];
    std::vector<double> cut(kMostStates, kNeverCut);
    cut[s] = (ratio[i] - 2 * error[i]) * (1 - 1e-9);
    if (!(cut[s] > 0)) continue;
    pass.solve_single(search, cut);
    for (std::size_t j = 0; j < ratio.size(); ++j) {
      const BondId e = pass.stretchable()[j];
      const auto listed = std::ranges::count(pass.candidates, e);
      const bool must = ratio[j] - error[j] > cut[s];
      const double reach = (ratio[j] + error[j] + 3 * widest_margin(pass, search, e)) * (1 + 1e-5);
      const bool may = reach >= cut[s] && std::isfinite(pass.threshold[e]);
      ASSERT_TRUE(listed >= (must ? 1 : 0) && listed <= (may ? 1 : 0)) << e << " for " << i;
    }
  }
}

TEST(TreeSingle, ListsEveryBondThatExceedsACutInDouble) {
  for (const Case& made : cases(6)) {
    for (const BreakOn break_on : {BreakOn::magnitude, BreakOn::tension}) {
      for (const TreeKernels* kernels : tree_kernels()) {
        SCOPED_TRACE(made.name + " " + kernels->name);
        Pass pass(made, *kernels, 1, break_on);
        TreeSearch search = pass.make_search();
        expect_listed(pass, search);
      }
    }
  }
}

}  // namespace
}  // namespace crackle
