/// The default strategy breaks a bond without allocating anything, in our code or in a library below it.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

#include "crackle/base/petsc_handle.hpp"
#include "crackle/equilibrium/ksp/pc_updown.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/fracture/fracture.hpp"
#include "crackle/network/lattice.hpp"
#include "crackle/network/lattices.hpp"
#include "crackle/record/part_breaks.hpp"
#include "crackle/record/part_profile.hpp"
#include "support/break_record.hpp"

namespace {
std::atomic<std::int64_t> allocations{0};
}

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

// NOLINTBEGIN: every caller in the process, shared libraries too, finds these first
void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  ++allocations;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  ++allocations;
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? 12 : 0;
}
// NOLINTEND
}

namespace crackle {
namespace {

/// Calls while each bond of a sample broke: how many breaks had any, and of how many.
struct Counted {
  int breaks = 0;
  int with_allocations = 0;
  std::int64_t factorizations = 0;  // from scratch: these do allocate
};

/// In a sample that has been broken before: every vector has the room that it needs.
Counted count_allocations(int size, std::int64_t number, int threads) {
  const Network network = make_network(triangular_lattice(size, 1), Model::spring, Grips::sliding, {});
  PhaseTimes times;
  const auto equilibrium =
      make_equilibrium(network, {.strategy = "tree", .tree = {.threads = threads}}, times);
  SampleRecord record;
  ObserveBreaks breaks(record);
  ObserveProfile profile(network, 1, record);
  const std::vector<Observer*> observers{&breaks, &profile};
  const StopRule stop;
  Fracture sample(*equilibrium, stop, observers);
  Counted counted;
  const std::vector<double> threshold = test::uniform_thresholds(network, number);
  for (int time = 0; time < 2; ++time) {
    counted = {};
    sample.begin(number, threshold);
    const std::int64_t made = equilibrium->counts().factorizations;
    for (std::int64_t before = allocations; sample.step(); before = allocations) {
      ++counted.breaks;
      if (allocations != before) ++counted.with_allocations;
    }
    counted.factorizations = equilibrium->counts().factorizations - made;
  }
  return counted;
}

/// (-equilibrium ksp does allocate: CHOLMOD makes a workspace for each of its solves.)
TEST(Allocation, ThereIsNoneWhenABondBreaks) {
  for (const int size : {8, 24}) {
    for (const int threads : {1, 3}) {
      SCOPED_TRACE("L = " + std::to_string(size) + ", threads " + std::to_string(threads));
      const Counted counted = count_allocations(size, 4, threads);
      EXPECT_GT(counted.breaks, 30);
      ASSERT_EQ(counted.factorizations, 0) << "this sample can't tell";
      EXPECT_EQ(counted.with_allocations, 0) << "of " << counted.breaks << " breaks";
    }
  }
}

TEST(Allocation, IsCounted) {
  const std::int64_t before = allocations;
  const std::vector<double> one(100);
  EXPECT_EQ(allocations, before + 1);
  EXPECT_EQ(one.back(), 0);
}

}  // namespace
}  // namespace crackle

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const crackle::petsc::Session session(argc, argv, "");
  crackle::petsc::check(crackle::register_pc_updown());
  return RUN_ALL_TESTS();
}
