#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "crackle/base/error.hpp"
#include "crackle/base/memory.hpp"

namespace crackle {
namespace {

std::string refusal(double bytes) {
  try {
    demand_memory("a lattice", bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Memory, IsRefusedBeyondWhatIsLeftWithBothFigures) {
  const MemoryLeft left = memory_left();
  EXPECT_GT(left.bytes, 0);
  EXPECT_EQ(refusal(1000), "");
  const std::string far = refusal(std::ldexp(1.0, 60));
  EXPECT_TRUE(far.starts_with("a lattice needs 1099511627776 MiB: ")) << far;
  EXPECT_NE(far.find(" leaves "), std::string::npos) << far;
  EXPECT_NE(far.find(kLessMemory), std::string::npos) << far;
}

TEST(Memory, IsNoMoreThanTheLimitOnAddressSpace) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "its shadow takes more than any limit that could be set";
#endif
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &before), 0);
  rlimit small = before;
  small.rlim_cur = std::min<rlim_t>(before.rlim_max, rlim_t{1} << 32);  // 4 GiB
  ASSERT_EQ(setrlimit(RLIMIT_AS, &small), 0);
  const std::string wide = refusal(std::ldexp(1.0, 33));  // 8 GiB
  const std::string narrow = refusal(std::ldexp(1.0, 20));
  ASSERT_EQ(setrlimit(RLIMIT_AS, &before), 0);
  EXPECT_TRUE(wide.starts_with("a lattice needs 8192 MiB: ")) << wide;
  EXPECT_EQ(narrow, "");
}

}  // namespace
}  // namespace crackle
