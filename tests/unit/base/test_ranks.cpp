/// Written for any number of processes: tests/processes runs them in several.

#include <gtest/gtest.h>

#include <utility>

#include "crackle/base/ranks.hpp"
#include "support/expect_refused.hpp"
#include "support/processes.hpp"

namespace crackle {
namespace {

int size_of(MPI_Comm comm) {
  int size = 0;
  MPI_Comm_size(comm, &size);
  return size;
}

int place_in(MPI_Comm comm) {
  int rank = -1;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

TEST(Ranks, FormGroupsOfNeighboursWhoseFirstLeads) {
  const int here = place_in(MPI_COMM_WORLD);
  for (const int each : test::group_sizes()) {
    SCOPED_TRACE(each);
    const Ranks ranks(MPI_COMM_WORLD, each);
    EXPECT_EQ(ranks.processes(), size_of(MPI_COMM_WORLD));
    EXPECT_EQ(ranks.group_size(), each);
    EXPECT_EQ(ranks.groups() * each, ranks.processes());
    EXPECT_EQ(ranks.group_number(), here / each);
    EXPECT_EQ(size_of(ranks.group()), each);
    EXPECT_EQ(place_in(ranks.group()), here % each);
    EXPECT_EQ(ranks.leader(), here % each == 0);
    EXPECT_EQ(ranks.first(), here == 0);
    EXPECT_EQ(place_in(ranks.world()), here);
    if (!ranks.leader()) continue;
    EXPECT_EQ(size_of(ranks.leaders()), ranks.groups());
    EXPECT_EQ(place_in(ranks.leaders()), ranks.group_number());
  }
}

TEST(Ranks, RefuseGroupsThatDoNotComeOut) {
  const int processes = size_of(MPI_COMM_WORLD);
  const std::string number = std::to_string(processes + 1);
  test::expect_refused([&] { const Ranks ranks(MPI_COMM_WORLD, processes + 1); },
                       {"-ensemble_ranks_per_sample " + number, "divisor", std::to_string(processes)});
}

/// Messages of the program's own are never taken for those of a library that talks in the same processes.
TEST(Ranks, TalkInCommunicatorsOfTheirOwn) {
  const Ranks ranks(MPI_COMM_WORLD, 1);
  for (const MPI_Comm other : {MPI_COMM_WORLD, ranks.leaders()}) {
    int same = MPI_IDENT;
    MPI_Comm_compare(ranks.world(), other, &same);
    EXPECT_EQ(same, MPI_CONGRUENT) << "the same processes, another context";
  }
}

TEST(Ranks, ShareWhatTheLeaderHas) {
  const int here = place_in(MPI_COMM_WORLD);
  for (const int each : test::group_sizes()) {
    SCOPED_TRACE(each);
    const Ranks ranks(MPI_COMM_WORLD, each);
    const int leader = here / each * each;
    struct {
      int number;
      double half;
    } both{here, 0.5 * here};
    ranks.share(both);
    EXPECT_EQ(both.number, leader);
    EXPECT_EQ(both.half, 0.5 * leader);
    std::vector<int> many(1000, here);
    many.back() = 7 + here;
    ranks.share(many);
    EXPECT_EQ(many.front(), leader);
    EXPECT_EQ(many.back(), 7 + leader);
  }
}

TEST(Ranks, AllHearOfTheFirstThatFails) {
  const Ranks ranks(MPI_COMM_WORLD, 1);
  const int here = place_in(MPI_COMM_WORLD);
  const int last = ranks.processes() - 1;
  int done = 0;
  ranks.together([&] { ++done; });
  EXPECT_EQ(done, 1);
  test::expect_refused(
      [&] {
        ranks.together([&] {
          if (here == last) throw InputError("-seed", "x", "a number");
        });
      },
      {"-seed x: allowed is a number"});
  test::expect_refused([&] { ranks.together([&] { throw InputError("process " + std::to_string(here)); }); },
                       {"process 0"});
  ranks.together([&] { ++done; });
  EXPECT_EQ(done, 2) << "nobody has been left behind";
}

TEST(Communicator, IsFreedOnceByWhomItWasMovedTo) {
  Communicator whole = Communicator::split(MPI_COMM_WORLD, 0);
  EXPECT_EQ(place_in(whole), place_in(MPI_COMM_WORLD));
  Communicator moved = std::move(whole);
  EXPECT_EQ(static_cast<MPI_Comm>(whole), MPI_COMM_NULL);  // NOLINT(*-use-after-move,*-cplusplus.Move)
  EXPECT_EQ(size_of(moved), size_of(MPI_COMM_WORLD));
  Communicator alone = Communicator::split(MPI_COMM_WORLD, place_in(MPI_COMM_WORLD));
  EXPECT_EQ(size_of(alone), 1);
  moved = std::move(alone);
  EXPECT_EQ(size_of(moved), 1);
}

}  // namespace
}  // namespace crackle
