#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/tree/response_kernels.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "support/kernel_values.hpp"

namespace crackle {
namespace {

using test::difference;
using test::kNothing;
using test::values;

/// Two blocks of bonds and some columns, for the loops of TreeResponse.
struct ResponseCase {
  static constexpr int kSize = 2 * kResponseBlock;
  int count;
  AlignedVector column;  // one more than count
  AlignedVector stretch = values(kSize, 32);
  AlignedVector per_stretch = values(kSize, 33);
  AlignedVector broken = AlignedVector(kSize);
  AlignedVector start = values(kSize, 34);

  explicit ResponseCase(int columns)
      : count(columns), column(values(static_cast<std::size_t>(columns + 1) * kSize, 31)) {
    for (double& value : per_stretch) value = std::abs(value);
    for (int i = 3; i < kSize; i += 9) broken[i] = 1;
  }
  [[nodiscard]] ResponseColumns columns() {
    return {column.data(), static_cast<std::ptrdiff_t>(count + 1) * kResponseBlock, count, kSize};
  }
  [[nodiscard]] ResponseBonds bonds() { return {stretch.data(), per_stretch.data(), broken.data()}; }
  [[nodiscard]] double& entry(int h, int bond) {
    return column[static_cast<std::size_t>(bond / kResponseBlock * (count + 1) + h) * kResponseBlock +
                  bond % kResponseBlock];
  }
};

/// act(kernels, case) for every version and some numbers of columns.
template <class Act>
void for_each_response(Act act) {
  for (const TreeKernels* kernels : tree_kernels()) {
    for (const int count : {0, 1, 2, 7, 40}) {
      SCOPED_TRACE(std::string(kernels->name) + " " + std::to_string(count));
      ResponseCase made(count);
      act(kernels->response, made);
    }
  }
}

TEST(ResponseKernels, SumTheColumnsOfBreaksLikeAPlainLoop) {
  for_each_response([](const ResponseKernels& kernels, ResponseCase& made) {
    const AlignedVector weight = values(static_cast<std::size_t>(made.count) * kResponseGroup, 35);
    std::array<AlignedVector, kResponseGroup> sum;
    std::array<double*, kResponseGroup> at{};
    for (int g = 0; g < kResponseGroup; ++g) {
      sum[g] = values(ResponseCase::kSize, 36 + g);
      at[g] = sum[g].data();
    }
    const auto before = sum;
    kernels.group(made.columns(), weight.data(), at.data());
    const int first = made.count / 2;
    kernels.column(made.columns(), first, weight.data(), made.start.data());
    for (int e = 0; e < ResponseCase::kSize; ++e) {
      double expected = made.start[e];
      for (int h = first; h < made.count; ++h) expected += weight[h] * made.entry(h, e);
      EXPECT_NEAR(made.entry(made.count, e), expected, 1e-14) << e;
      for (int g = 0; g < kResponseGroup; ++g) {
        expected = before[g][e];
        for (int h = 0; h < made.count; ++h) expected += weight[h * kResponseGroup + g] * made.entry(h, e);
        EXPECT_NEAR(sum[g][e], expected, 1e-14) << e << " of " << g;
      }
    }
  });
}

TEST(ResponseKernels, ApplyABreakAndSumAfreshLikeAPlainLoop) {
  for_each_response([](const ResponseKernels& kernels, ResponseCase& made) {
    for (const bool magnitude : {true, false}) {
      AlignedVector expected = made.stretch;
      ResponseChange sums;
      for (int e = 0; e < ResponseCase::kSize; ++e) {
        const double a = made.entry(made.count, e);
        expected[e] += 0.3 * a;
        const double size = magnitude ? std::abs(expected[e]) : expected[e];
        sums.largest = std::max(sums.largest, size * made.per_stretch[e]);
        sums.column += made.broken[e] * a * a;
        sums.stretch += made.broken[e] * expected[e] * expected[e];
      }
      const ResponseChange change = kernels.apply(made.columns(), 0.3, made.bonds(), magnitude);
      EXPECT_LT(difference(made.stretch, expected), 1e-15);
      EXPECT_NEAR(change.largest, sums.largest, 1e-15);
      EXPECT_NEAR(change.column, sums.column, 1e-14);
      EXPECT_NEAR(change.stretch, sums.stretch, 1e-14);
    }
    const AlignedVector weight = values(made.count, 37);
    std::vector<AlignedVector> rows;
    std::vector<const double*> row(made.count);
    AlignedVector expected = made.start;
    for (int h = 0; h < made.count; ++h) {
      rows.push_back(values(ResponseCase::kSize, 38 + h));
      for (int e = 0; e < ResponseCase::kSize; ++e) expected[e] += weight[h] * rows[h][e];
    }
    for (int h = 0; h < made.count; ++h) row[h] = rows[h].data();
    double square = 0;
    for (int e = 0; e < ResponseCase::kSize; ++e) square += std::pow(expected[e] - made.stretch[e], 2);
    const double changed = kernels.recompute(row.data(), weight.data(), made.count, made.start.data(),
                                             made.stretch.data(), ResponseCase::kSize);
    EXPECT_LT(difference(made.stretch, expected), 1e-14);
    EXPECT_NEAR(changed, square, 1e-12 * square);
    made.stretch[5] = kNothing;
    EXPECT_TRUE(std::isnan(kernels.recompute(row.data(), weight.data(), made.count, made.start.data(),
                                             made.stretch.data(), ResponseCase::kSize)));
  });
}

TEST(ResponseKernels, ChooseTheLowestTiedBondAndTellHowNearOthersAre) {
  for_each_response([](const ResponseKernels& kernels, ResponseCase& made) {
    constexpr double kLargest = 0.75;
    constexpr double kTied = 0.7;
    for (const auto& [first, top] : {std::pair{90, 90}, {0, 127}, {17, 66}, {62, 64}}) {
      for (int e = 0; e < ResponseCase::kSize; ++e) made.stretch[e] = 0.5 * kTied / made.per_stretch[e];
      made.stretch[first] = -0.72 / made.per_stretch[first];
      made.per_stretch[top] = 0.5;
      made.stretch[top] = -2 * kLargest;
      const int near = (top + 30) % ResponseCase::kSize;
      made.per_stretch[near] = 0.25;
      made.stretch[near] = 4 * (kTied - 1e-6);
      const ResponseChoice found = kernels.choose(made.bonds(), ResponseCase::kSize, kLargest, kTied, true);
      EXPECT_EQ(found.first, first);
      EXPECT_EQ(found.top, top);
      EXPECT_EQ(found.equal, 1);
      EXPECT_NEAR(found.margin, 1e-6 / 0.75, 1e-15);
      made.per_stretch[near] = 1.5;
      made.stretch[near] = kLargest / 1.5;
      const ResponseChoice twice = kernels.choose(made.bonds(), ResponseCase::kSize, kLargest, kTied, true);
      EXPECT_EQ(twice.equal, 2);
      EXPECT_EQ(twice.top, std::min(near, top));
      made.stretch[top] = 2 * kLargest;
      EXPECT_EQ(kernels.choose(made.bonds(), ResponseCase::kSize, kLargest, kTied, false).first,
                std::min(near, top))
          << "compression breaks nothing";
    }
  });
}

}  // namespace
}  // namespace crackle
