#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "support/kernel_values.hpp"

namespace crackle {
namespace {

constexpr double kRounding = 0x1p-24;
constexpr float kNever = std::numeric_limits<float>::infinity();

using test::kNothing;
using test::values;

SingleVector single_values(std::size_t size, std::uint64_t seed, double scale = 1) {
  const AlignedVector made = values(size, seed, scale);
  return {made.begin(), made.end()};
}

/// A front of random entries, NaN above the diagonal; its pivots are the first positions, its boundary every second of
/// those that follow.
struct Case {
  static constexpr std::ptrdiff_t kNext = 500;  // what lies behind the block is another front's
  int p;
  int q;
  int stride;
  std::ptrdiff_t height;
  AlignedVector entries;
  std::vector<Position> row;
  SingleVector single;  // of `entries`, once settled
  AlignedVector sum;

  Case(int pivots, int boundary)
      : p(pivots),
        q(boundary),
        stride((pivots + boundary + 15) / 8 * 8),
        height((pivots + boundary + kStrip - 1) / kStrip * kStrip),
        entries(values(static_cast<std::size_t>(stride) * pivots, 11, 0.4)),
        single(SingleBlock::start(height, (pivots + kStrip - 1) / kStrip) + kNext, -7.0F),
        sum(pivots, kNothing) {
    for (int c = 0; c < p; ++c) {
      for (int r = 0; r < c; ++r) at(r, c) = kNothing;
      at(c, c) = 1;
      for (int r = p + q; r < stride; ++r) at(r, c) = 0;
    }
    for (int i = 0; i < q; ++i) row.push_back(p + 2 * i + 1);
  }
  [[nodiscard]] double& at(int r, int c) { return entries[static_cast<std::size_t>(c) * stride + r]; }
  [[nodiscard]] float single_at(int r, int c) const {
    const std::ptrdiff_t strip = c / kStrip;
    return single[SingleBlock::start(height, strip) + (r - strip * kStrip) * kStrip + c % kStrip];
  }
  [[nodiscard]] int positions() const { return p + 2 * q + 1; }
  [[nodiscard]] std::size_t place(int r) const { return r < p ? r : row[r - p]; }
  [[nodiscard]] FrontBlock block() const { return {entries.data(), row.data(), stride, p, q}; }
  [[nodiscard]] SingleBlock single_block() const { return {single.data(), row.data(), height, p, q}; }

  /// x: [positions]. Into `single` as well if `store`.
  void settle(const TreeKernels& kernels, AlignedVector& x, bool store) {
    AlignedVector column(stride, kNothing);
    kernels.settle(block(), x.data(), x.data(), column.data(), store ? single.data() : nullptr,
                   store ? sum.data() : nullptr);
  }
  /// What a front of this size is solved by in all lanes. x: [positions * lanes].
  void backward(const TreeKernels& kernels, SingleVector& x, int lanes, SingleVector& most) const {
    SingleVector halves = x;
    SingleVector most_of_halves = most;
    kernels.backward_single(single_block(), x.data(), x.data(), lanes, 0, lanes, most.data());
    for (int begin = 0; begin < lanes; begin += kLanes) {
      kernels.backward_single(single_block(), halves.data(), halves.data(), lanes, begin, begin + kLanes,
                              most_of_halves.data());
    }
    EXPECT_EQ(halves, x) << "to the same bits, group by group";
    EXPECT_EQ(most_of_halves, most);
  }
};

/// act(kernels, p, q) for every version: every p and q up to what two parts of a sum and some take.
template <class Act>
void for_each_front(Act act) {
  for (const TreeKernels* kernels : tree_kernels()) {
    for (int p = 0; p <= 70; ++p) {
      for (const int q : {0, 1, 7, 63, 64, 65, 130 + p}) {
        SCOPED_TRACE(std::string(kernels->name) + " " + std::to_string(p) + " " + std::to_string(q));
        act(*kernels, p, q);
      }
    }
    for (const int p : {134, 150}) act(*kernels, p, 3);
    if (::testing::Test::HasFailure()) return;
  }
}

TEST(TreeKernels, SettleAColumnAndRoundTheBlock) {
  for_each_front([](const TreeKernels& kernels, int p, int q) {
    Case made(p, q);
    const AlignedVector given = values(made.positions(), 12);
    AlignedVector expected = given;
    AlignedVector x = given;
    AlignedVector alone = given;
    made.settle(kernels, alone, false);
    made.settle(kernels, x, true);
    EXPECT_EQ(x, alone) << "to the same bits, whether the block is rounded or not";
    for (int k = p - 1; k >= 0; --k) {
      double size = 0;
      for (int r = k + 1; r < p + q; ++r) {
        expected[k] -= made.at(r, k) * expected[made.place(r)];
        size += std::abs(made.at(r, k));
        ASSERT_EQ(made.single_at(r, k), static_cast<float>(made.at(r, k))) << r << " " << k;
      }
      for (int r = p + q; r < made.height; ++r) ASSERT_EQ(made.single_at(r, k), 0) << "below " << k;
      for (int r = k / kStrip * kStrip; r < k; ++r) ASSERT_EQ(made.single_at(r, k), 0) << "above " << k;
      ASSERT_NEAR(made.sum[k], size, 1e-13 * size) << k;
    }
    for (int k = p; k < (p + kStrip - 1) / kStrip * kStrip; ++k) {
      for (std::ptrdiff_t r = k / kStrip * kStrip; r < made.height; ++r)
        ASSERT_EQ(made.single_at(static_cast<int>(r), k), 0) << "beyond the pivots";
    }
    EXPECT_EQ(std::count(made.single.end() - Case::kNext, made.single.end(), -7.0F), Case::kNext);
    double largest = 0;
    for (const double value : expected) largest = std::max(largest, std::abs(value));
    for (std::size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(x[i], expected[i], 1e-13 * largest) << i;
  });
}

/// Additions that a product takes part in, of so many: a part of the sum, the parts, the triangle.
int longest_chain(int products) {
  return std::min(products + 2, kSingleSum + products / kSingleSum + 3 + kMostSingleRows);
}

/// Every row is solved but for a residual that the contract of TreeSingle allows, in its part of products and additions.
void expect_solved(Case& made, const SingleVector& given, const SingleVector& x, int lanes) {
  for (int lane = 0; lane < lanes; ++lane) {
    double largest = 0;
    for (int r = 0; r < made.p + made.q; ++r)
      largest = std::max<double>(largest, std::abs(x[made.place(r) * lanes + lane]));
    for (int k = 0; k < made.p; ++k) {
      double residual = static_cast<double>(given[k * lanes + lane]) - x[k * lanes + lane];
      double size = 0;
      for (int r = k + 1; r < made.p + made.q; ++r) {
        residual -= static_cast<double>(made.single_at(r, k)) * x[made.place(r) * lanes + lane];
        size += std::abs(made.single_at(r, k));
      }
      const double gamma = (longest_chain(made.p + made.q - k) + 3) * kRounding;
      ASSERT_LE(std::abs(residual), 2 * gamma * (0.5 + size) * largest) << "row " << k << ", lane " << lane;
    }
  }
}

TEST(TreeKernels, SolveBackwardInSinglePrecisionWithinTheirBound) {
  for_each_front([](const TreeKernels& kernels, int p, int q) {
    Case made(p, q);
    AlignedVector x = values(made.positions(), 12);
    made.settle(kernels, x, true);
    for (const int lanes : {kLanes, kMostStates}) {
      const SingleVector given = single_values(static_cast<std::size_t>(made.positions()) * lanes, 13);
      SingleVector found = given;
      SingleVector most(lanes, 0.0F);
      most[3] = 1e30F;
      made.backward(kernels, found, lanes, most);
      expect_solved(made, given, found, lanes);
      for (std::size_t i = static_cast<std::size_t>(p) * lanes; i < found.size(); ++i)
        ASSERT_EQ(found[i], given[i]) << "not the front's to write";
      for (int lane = 0; lane < lanes; ++lane) {
        float largest = lane == 3 ? 1e30F : 0;
        for (int k = 0; k < p; ++k) largest = std::max(largest, std::abs(found[k * lanes + lane]));
        ASSERT_EQ(most[lane], largest) << lane;
      }
    }
  });
}

/// Rounded once, `combine` in the lanes of one group; the others stay.
void expect_combined(const TreeKernels& kernels, std::span<const PanelPart> part, const AlignedVector& weight,
                     const AlignedVector& expected, int lanes) {
  const int rows = static_cast<int>(weight.size());
  for (int first = 0; first < lanes; first += kLanes) {
    SingleVector out(static_cast<std::size_t>(rows) * lanes, -7.0F);
    kernels.combine_single(part.data(), static_cast<int>(part.size()), weight.data(), rows,
                           out.data() + first, lanes);
    for (int i = 0; i < rows * lanes; ++i) {
      const int lane = i % lanes - first;
      const bool own = lane >= 0 && lane < kLanes;
      const double told = own ? expected[i / lanes * kLanes + lane] : -7.0;
      ASSERT_NEAR(out[i], told, kRounding * std::abs(told) + 1e-10) << i;
    }
  }
}

TEST(TreeKernels, CombinePanelsInSinglePrecision) {
  constexpr std::array<std::int32_t, 4> kLane{1, 2, 9, 15};
  for (const TreeKernels* kernels : tree_kernels()) {
    for (int rows = 0; rows <= 40; ++rows) {
      for (const int parts : {0, 1, 2, 7, 24}) {
        SCOPED_TRACE(std::string(kernels->name) + " " + std::to_string(rows) + " " + std::to_string(parts));
        const AlignedVector weight = values(rows, 23, 1e4);
        const AlignedVector y = values(static_cast<std::size_t>(rows + parts) * kLanes, 25);
        const AlignedVector coefficient = values(static_cast<std::size_t>(parts + kLanes) * kLanes, 26);
        std::vector<PanelPart> part(parts);
        for (int i = 0; i < parts; ++i) {
          part[i] = {y.data() + i * kLanes, kLane.data() + i % 3, coefficient.data() + i * kLanes, i % 2 + 1};
        }
        AlignedVector expected(static_cast<std::size_t>(rows) * kLanes, kNothing);
        kernels->combine(part.data(), parts, weight.data(), rows, expected.data());
        for (const int lanes : {kLanes, kMostStates}) {
          expect_combined(*kernels, part, weight, expected, lanes);
        }
      }
    }
  }
}

/// What single precision may make of a sum of four: nothing is claimed that near to a limit.
constexpr double kAbout = 1e-5;

/// A bond's stretch in one lane, summed in double.
double stretch_of(const SingleForce& bond, const SingleVector& x, int lanes, int lane) {
  double sum = bond.base;
  for (int i = 0; i < bond.width; ++i)
    sum += static_cast<double>(bond.value[i]) * x[static_cast<std::size_t>(bond.row[i]) * lanes + lane];
  return sum;
}

void expect_told(const TreeKernels& kernels, const SingleForce& bond, int lanes) {
  SingleVector x = single_values(static_cast<std::size_t>(6) * lanes, 53);
  const SingleVector margin(lanes, 0.01F);
  SingleVector least(lanes, kNever);
  std::vector<double> ratio(lanes, kNothing);
  const auto reaches = [&] {
    return kernels.ratios_single(bond, x.data(), lanes, margin.data(), least.data(), ratio.data());
  };
  EXPECT_FALSE(reaches());
  for (int lane = 0; lane < lanes; ++lane) {
    const double stretch = stretch_of(bond, x, lanes, lane);
    const double size = bond.magnitude ? std::abs(stretch) : std::max(stretch, 0.0);
    EXPECT_NEAR(ratio[lane], bond.per_limit * size, kAbout) << lane;
    const double most = bond.per_limit * (size + margin[lane]);
    least[lane] = static_cast<float>(most - kAbout);
    EXPECT_TRUE(reaches()) << lane;
    least[lane] = static_cast<float>(most + kAbout);
    EXPECT_FALSE(reaches()) << lane;
    float& spoilt = x[static_cast<std::size_t>(bond.row[0]) * lanes + lane];
    const float before = std::exchange(spoilt, static_cast<float>(kNothing));
    EXPECT_TRUE(reaches()) << "what is not a number may be anything";
    spoilt = before;
    least[lane] = kNever;
  }
}

TEST(TreeKernels, TellWhetherABondMayComeUpToALeastRatioInSinglePrecision) {
  const std::vector<Position> row{5, 0, 2, 3};
  const SingleVector value = single_values(4, 54, 4);
  for (const TreeKernels* kernels : tree_kernels()) {
    for (const int lanes : {kLanes, kMostStates}) {
      for (const int width : {2, 4}) {
        for (const bool magnitude : {true, false}) {
          SCOPED_TRACE(std::string(kernels->name) + " " + std::to_string(lanes) + " " +
                       std::to_string(width));
          expect_told(*kernels, {row.data(), value.data(), 0.3F, 2.5F, width, magnitude}, lanes);
        }
      }
    }
  }
}

/// Bonds between random rows; every ninth is broken.
struct SomeBonds {
  std::vector<Position> row;
  SingleVector value;
  SingleVector base;
  SingleVector limit;
  SingleBonds block;

  SomeBonds(int bonds, int width)
      : value(single_values(static_cast<std::size_t>(bonds) * width, 51)),
        base(single_values(bonds, 55)),
        limit(single_values(bonds, 52)) {
    for (int i = 0; i < bonds * width; ++i) row.push_back(i * 37 % 29);
    for (int e = 0; e < bonds; ++e) {
      limit[e] += 0.7F;
      if (e % 9 == 4) limit[e] = kNever;
    }
    block = {row.data(), value.data(), base.data(), limit.data(), bonds, width};
  }
  /// By how much its stretch and margin exceed the limit in the lane where they do so most.
  [[nodiscard]] double excess(int e, bool magnitude, const SingleVector& x, int lanes,
                              const SingleVector& cut, const SingleVector& margin) const {
    double most = -std::numeric_limits<double>::infinity();
    for (int lane = 0; lane < lanes; ++lane) {
      double stretch = base[e];
      for (int i = e * block.width; i < (e + 1) * block.width; ++i)
        stretch += static_cast<double>(value[i]) * x[static_cast<std::size_t>(row[i]) * lanes + lane];
      const double size = magnitude ? std::abs(stretch) : stretch;
      most = std::max(most, size + margin[lane] - static_cast<double>(limit[e]) * cut[lane]);
    }
    return most;
  }
};

void expect_found(const TreeKernels& kernels, int bonds, int width, int lanes, bool magnitude) {
  const SingleVector x = single_values(static_cast<std::size_t>(29) * lanes, 53);
  SingleVector cut(lanes, 1.2F);
  SingleVector margin(lanes, 0.02F);
  cut[5] = 1e30F;
  margin[lanes - 1] = 0.3F;  // a lane that lists what the others don't
  const SomeBonds some(bonds, width);
  std::vector<std::int32_t> found(bonds + 1, -1);
  const auto find = magnitude ? kernels.find_single_magnitude : kernels.find_single_tension;
  found.resize(find(some.block, x.data(), lanes, cut.data(), margin.data(), found.data()));
  EXPECT_TRUE(std::ranges::is_sorted(found));
  int sure = 0;
  for (int e = 0; e < bonds; ++e) {
    const double excess = some.excess(e, magnitude, x, lanes, cut, margin);
    if (std::abs(excess) < kAbout) continue;
    ++sure;
    EXPECT_EQ(std::ranges::count(found, e), excess > 0 ? 1 : 0) << "bond " << e;
  }
  EXPECT_GE(sure, bonds - 1);
  if (bonds > 100) {
    EXPECT_TRUE(std::ssize(found) > bonds / 20 && std::ssize(found) < bonds - bonds / 20) << found.size();
  }
}

TEST(TreeKernels, FindEveryBondThatMayExceedItsLimitInSinglePrecision) {
  for (const TreeKernels* kernels : tree_kernels()) {
    for (const int bonds : {0, 1, 2, 3, 17, 64, 65, 200}) {
      for (const int width : {2, 4}) {
        for (const int lanes : {kLanes, kMostStates}) {
          for (const bool magnitude : {true, false}) {
            SCOPED_TRACE(std::string(kernels->name) + " " + std::to_string(bonds) + " " +
                         std::to_string(width) + " " + std::to_string(lanes) +
                         (magnitude ? " magnitude" : " tension"));
            expect_found(*kernels, bonds, width, lanes, magnitude);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace crackle
