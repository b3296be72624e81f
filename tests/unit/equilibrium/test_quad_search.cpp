#include <gtest/gtest.h>

#include <limits>

#include "crackle/equilibrium/quad_search.hpp"
#include "support/break_record.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

/// A sample that is taken over after some breaks goes on as it would have gone on.
TEST(QuadSearch, ASampleTakenOverGoesOnTheSame) {
  for (const test::NamedNetwork& named : test::triangular_networks(5)) {
    PhaseTimes times;
    QuadSearch whole(named.network, BreakOn::magnitude, times);
    QuadSearch later(named.network, BreakOn::magnitude, times);
    std::vector<double> threshold = test::uniform_thresholds(named.network, 0);
    for (BondId e = 0; e < named.network.bonds(); ++e) {
      if (!named.network.can_stretch(e)) threshold[e] = std::numeric_limits<double>::infinity();
    }
    whole.begin({}, 0);
    std::vector<BondId> broken;
    Critical next;
    State state = whole.find_critical(threshold, next);
    for (; state == State::carrying; state = whole.find_critical(threshold, next)) {
      if (broken.size() == 5) later.begin(broken, whole.intact_stiffness());
      if (broken.size() >= 5) {
        Critical same;
        ASSERT_EQ(later.find_critical(threshold, same), State::carrying) << named.name;
        EXPECT_EQ(same.bond, next.bond) << named.name;
        EXPECT_DOUBLE_EQ(same.load, next.load) << named.name;
        later.remove(next.bond);
      }
      whole.remove(next.bond);
      threshold[next.bond] = std::numeric_limits<double>::infinity();
      broken.push_back(next.bond);
    }
    EXPECT_EQ(state, State::failed) << named.name;
    EXPECT_EQ(later.find_critical(threshold, next), State::failed) << named.name;
    EXPECT_GT(broken.size(), 10U) << named.name;
  }
}

}  // namespace
}  // namespace crackle
