#include <gtest/gtest.h>

#include <algorithm>

#include "crackle/equilibrium/tree/vertex_cover.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

CoupledPairs pairs_of(const std::vector<std::vector<std::int32_t>>& coupled, std::int32_t rights) {
  CoupledPairs pairs;
  for (const auto& row : coupled) {
    pairs.right.insert(pairs.right.end(), row.begin(), row.end());
    pairs.start.push_back(static_cast<std::int32_t>(pairs.right.size()));
  }
  pairs.rights = rights;
  return pairs;
}

void expect_cover(const CoupledPairs& pairs, const VertexCover& cover) {
  EXPECT_TRUE(std::ranges::is_sorted(cover.left));
  EXPECT_TRUE(std::ranges::is_sorted(cover.right));
  for (std::int32_t i = 0; i < pairs.lefts(); ++i) {
    for (std::int32_t k = pairs.start[i]; k < pairs.start[i + 1]; ++k) {
      EXPECT_TRUE(std::ranges::binary_search(cover.left, i) ||
                  std::ranges::binary_search(cover.right, pairs.right[k]))
          << i << " and " << pairs.right[k];
    }
  }
}

/// The smallest cover, by trying all choices of left vertices.
std::size_t least_by_trial(const CoupledPairs& pairs) {
  std::size_t least = pairs.lefts();
  for (unsigned chosen = 0; chosen < 1U << pairs.lefts(); ++chosen) {
    std::vector<std::uint8_t> needed(pairs.rights, 0);
    std::size_t size = 0;
    for (std::int32_t i = 0; i < pairs.lefts(); ++i) {
      if ((chosen >> i & 1U) != 0) {
        ++size;
      } else {
        for (std::int32_t k = pairs.start[i]; k < pairs.start[i + 1]; ++k) needed[pairs.right[k]] = 1;
      }
    }
    least = std::min(least, size + std::ranges::count(needed, 1));
  }
  return least;
}

TEST(VertexCover, IsEmptyWithoutPairs) {
  EXPECT_TRUE(least_vertex_cover({}).left.empty());
  const VertexCover cover = least_vertex_cover(pairs_of({{}, {}}, 3));
  EXPECT_TRUE(cover.left.empty() && cover.right.empty());
}

TEST(VertexCover, TakesTheHubOfAStar) {
  EXPECT_EQ(least_vertex_cover(pairs_of({{0, 1, 2, 3}}, 4)).left, std::vector<std::int32_t>{0});
  EXPECT_EQ(least_vertex_cover(pairs_of({{0}, {0}, {0}}, 1)).right, std::vector<std::int32_t>{0});
}

/// Across a zigzag of inclined springs and the horizontal ones between them: three unknowns for two rows.
TEST(VertexCover, NeedsThreeUnknownsForTwoRowsOfATriangularLattice) {
  constexpr int kRows =
      40;  // left of even rows (x, y), right of odd rows (x, y); horizontals couple x with x
  std::vector<std::vector<std::int32_t>> coupled;
  for (int row = 0; row < kRows; ++row) {
    std::vector<std::int32_t> x{2 * row};
    std::vector<std::int32_t> y;
    for (const int other : {row - 1, row + 1}) {
      if (row % 2 != 0 || other < 0 || other >= kRows) continue;
      for (std::vector<std::int32_t>* own : {&x, &y}) own->insert(own->end(), {2 * other, 2 * other + 1});
    }
    coupled.push_back(x);
    coupled.push_back(y);
  }
  const CoupledPairs pairs = pairs_of(coupled, 2 * kRows);
  const VertexCover cover = least_vertex_cover(pairs);
  expect_cover(pairs, cover);
  EXPECT_EQ(cover.left.size() + cover.right.size(), 3U * kRows / 2);
}

TEST(VertexCover, IsTheSmallestOfRandomGraphs) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    std::vector<double> value(11 * 9);
    draw_uniform_thresholds(seed, 0, value);
    std::vector<std::vector<std::int32_t>> coupled(11);
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (value[i] < 0.05 + 0.001 * static_cast<double>(seed))
        coupled[i / 9].push_back(static_cast<int>(i % 9));
    }
    const CoupledPairs pairs = pairs_of(coupled, 9);
    const VertexCover cover = least_vertex_cover(pairs);
    expect_cover(pairs, cover);
    ASSERT_EQ(cover.left.size() + cover.right.size(), least_by_trial(pairs)) << "seed " << seed;
  }
}

}  // namespace
}  // namespace crackle
