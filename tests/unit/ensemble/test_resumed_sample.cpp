/// A sample that was left where its strategy had settled goes on as if it had not been left, bit for bit.

#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/fracture/fracture.hpp"
#include "crackle/record/part_breaks.hpp"
#include "crackle/record/part_profile.hpp"
#include "crackle/record/part_snapshot.hpp"
#include "support/break_record.hpp"
#include "support/sample_records.hpp"
#include "support/small_networks.hpp"
#include "support/solver_options.hpp"

namespace crackle {
namespace {

constexpr std::int64_t kSettleEvery = 7;

/// Breaks and records a sample with everything that observes.
class Watched {
 public:
  Watched(const Network& network, const ChosenStrategy& options)
      : network_(network),
        equilibrium_(make_equilibrium(network, options, times_)),
        breaks_(record_),
        profile_(network, 1, record_),
        snapshot_({3, 20}, record_),
        observers_{&breaks_, &profile_, &snapshot_} {}

  /// The sample from the start, or from `begun` on; until it has settled after `until` breaks (0: to its end).
  SampleRecord run(std::int64_t sample, const SampleRecord* begun = nullptr, std::int32_t until = 0) {
    const StopRule stop;
    const std::vector<double> threshold = test::uniform_thresholds(network_, sample);
    Fracture fracture(*equilibrium_, stop, observers_, kSettleEvery);
    if (begun != nullptr) {
      fracture.resume(*begun, threshold);
    } else {
      fracture.begin(sample, threshold);
    }
    while (fracture.step()) {
      EXPECT_EQ(fracture.settled(), fracture.summary().n_f % kSettleEvery == 0);
      if (until > 0 && fracture.summary().n_f == until) break;
    }
    record_.summary = fracture.summary();
    record_.summary.wall_time = 0;
    return record_;
  }

 private:
  const Network& network_;
  PhaseTimes times_;
  std::unique_ptr<Equilibrium> equilibrium_;
  SampleRecord record_;
  ObserveBreaks breaks_;
  ObserveProfile profile_;
  ObserveSnapshot snapshot_;
  std::vector<Observer*> observers_;
};

/// From several places, by a strategy just made and by one that has broken other samples.
void expect_resumable(const Network& network, const ChosenStrategy& options) {
  Watched whole(network, options);
  (void)whole.run(5);
  const SampleRecord expected = whole.run(2);
  ASSERT_GT(expected.summary.n_f, 2 * kSettleEvery);
  const auto last = expected.summary.n_f / kSettleEvery;
  for (const std::int64_t settled : {std::int64_t{1}, last / 2, last}) {
    const auto until = static_cast<std::int32_t>(settled * kSettleEvery);
    SCOPED_TRACE("left after break " + std::to_string(until));
    const SampleRecord begun = Watched(network, options).run(2, nullptr, until);
    ASSERT_EQ(std::ssize(begun.bond), until);
    test::expect_same(Watched(network, options).run(2, &begun), expected);
    test::expect_same(whole.run(2, &begun), expected);
    test::expect_same(whole.run(2), expected);
  }
}

TEST(ResumedSample, GoesOnBitForBitWithEveryStrategyOfOurs) {
  for (const auto& [name, network] : test::triangular_networks(9)) {
    for (const char* strategy : {"tree", "ksp"}) {
      SCOPED_TRACE(name + " " + strategy);
      expect_resumable(network, {.strategy = strategy});
    }
  }
  const auto small = test::triangular_networks(4);
  expect_resumable(small.front().network, {.strategy = "dense"});
  for (const auto& [name, network] : test::triangular_networks(6)) {
    SCOPED_TRACE(name + " quad");
    expect_resumable(network, {.strategy = "quad"});
  }
}

TEST(ResumedSample, GoesOnBitForBitWithSolversOfPetsc) {
  const auto networks = test::triangular_networks(6);
  using Options = std::vector<std::pair<std::string, std::string>>;
  for (const Options& solver :
       {Options{{"-ksp_type", "cg"}, {"-pc_updown_rank", "8"}},
        Options{{"-ksp_type", "cg"}, {"-pc_type", "icc"}}, Options{{"-ksp_type", "cg"}, {"-pc_type", "gamg"}},
        Options{{"-ksp_type", "cg"}, {"-ksp_initial_guess_nonzero", "true"}},
        Options{{"-pc_type", "cholesky"}, {"-pc_factor_mat_solver_type", "mumps"}}}) {
    SCOPED_TRACE(solver.front().second + " " + solver.back().second);
    const test::SolverOptions first{solver.front()};
    const test::SolverOptions second{solver.back()};
    expect_resumable(networks.front().network, {.strategy = "ksp"});
  }
}

/// Settling forgets, it doesn't change: the same bonds break as without.
TEST(ResumedSample, SettlingChangesNoBond) {
  for (const auto& [name, network] : test::triangular_networks(9)) {
    for (const char* strategy : {"tree", "ksp"}) {
      SCOPED_TRACE(name + " " + strategy);
      const auto threshold = test::uniform_thresholds(network, 2);
      EXPECT_EQ(Watched(network, {.strategy = strategy}).run(2).bond,
                test::break_record(network, {.strategy = strategy}, threshold).bond);
    }
  }
}

}  // namespace
}  // namespace crackle
