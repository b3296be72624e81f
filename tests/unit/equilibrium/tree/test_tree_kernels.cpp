#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "support/kernel_values.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

using test::difference;
using test::kNothing;
using test::values;

/// A front of random entries, NaN above the diagonal; its pivots are the first rows of x, its boundary every
/// second of those that follow.
struct Case {
  int p;
  int q;
  int stride;
  AlignedVector entries;
  std::vector<Position> row;
  AlignedVector x;

  Case(int pivots, int boundary)
      : p(pivots),
        q(boundary),
        stride((pivots + boundary + 15) / 8 * 8),
        entries(values(static_cast<std::size_t>(stride) * pivots, 11, 0.4)),
        x(values(static_cast<std::size_t>(pivots + 2 * boundary + 1) * kLanes, 12)) {
    for (int c = 0; c < p; ++c) {
      for (int r = 0; r < c; ++r) at(r, c) = kNothing;
      at(c, c) = 1;
      for (int r = p + q; r < stride; ++r) at(r, c) = 0;
    }
    for (int i = 0; i < q; ++i) row.push_back(p + 2 * i + 1);
  }
  [[nodiscard]] double& at(int r, int c) { return entries[static_cast<std::size_t>(c) * stride + r]; }
  [[nodiscard]] FrontBlock block() const { return {entries.data(), row.data(), stride, p, q}; }
  /// Row r of the block in x.
  [[nodiscard]] std::size_t place(int r) const {
    return static_cast<std::size_t>(r < p ? r : row[r - p]) * kLanes;
  }
};

/// act(kernels, p, q) for every version; together they see every p and every q from 0 to 40.
template <class Act>
void for_each_size(Act act) {
  ASSERT_STREQ(tree_kernels().back()->name, "plain");
  for (const TreeKernels* kernels : tree_kernels()) {
    for (int size = 0; size <= 40; ++size) {
      for (const int other : {0, 1, 2, 7, 16, 40}) {
        SCOPED_TRACE(std::string(kernels->name) + " " + std::to_string(size) + " " + std::to_string(other));
        act(*kernels, size, other);
        act(*kernels, other, size);
      }
    }
  }
}

constexpr std::array<std::pair<int, int>, 6> kWindows{{{0, 1}, {3, 5}, {0, 8}, {8, 16}, {9, 15}, {6, 11}}};

AlignedVector only_lanes(AlignedVector x, int begin, int end) {
  for (std::size_t i = 0; i < x.size(); ++i) {
    const int lane = static_cast<int>(i % kLanes);
    if (lane < begin || lane >= end) x[i] = 0;
  }
  return x;
}

TEST(TreeKernels, SolveForwardAndBackwardLikeAPlainLoop) {
  for_each_size([](const TreeKernels& kernels, int p, int q) {
    Case made(p, q);
    AlignedVector forward = made.x;
    AlignedVector backward = made.x;
    const auto subtract = [&made](AlignedVector& x, int from, double factor, int row) {
      for (int l = 0; l < kLanes; ++l) x[made.place(from) + l] -= factor * x[made.place(row) + l];
    };
    for (int k = 0; k < p; ++k) {
      for (int r = k + 1; r < p + q; ++r) subtract(forward, r, made.at(r, k), k);
    }
    for (int k = p - 1; k >= 0; --k) {
      for (int r = k + 1; r < p + q; ++r) subtract(backward, k, made.at(r, k), r);
    }
    FrontBlock block = made.block();
    AlignedVector x = made.x;
    kernels.backward(block, x.data(), x.data());
    EXPECT_LT(difference(x, backward), 1e-13) << "backward";
    for (const bool ahead : {false, true}) {
      if (ahead) block.ahead = made.entries.data();
      if (ahead) block.ahead_end = made.entries.data() + made.entries.size();
      x = made.x;
      kernels.forward(block, x.data(), x.data(), 0, kLanes);
      EXPECT_LT(difference(x, forward), 1e-13) << "forward";
    }
    for (const auto& [begin, end] : kWindows) {
      x = only_lanes(made.x, begin, end);
      kernels.forward(block, x.data(), x.data(), begin, end);
      EXPECT_LT(difference(x, only_lanes(forward, begin, end)), 1e-13) << begin << " to " << end;
    }
    AlignedVector column(block.stride, kNothing);
    x = made.x;
    for (int lane = 0; lane < kLanes; ++lane)
      kernels.forward_one(block, x.data() + lane, x.data() + lane, column.data());
    EXPECT_LT(difference(x, forward), 1e-13) << "lane by lane";
  });
}

TEST(TreeKernels, MultiplyTwoPanelsLikeAPlainLoop) {
  constexpr int kWide = 3 * kLanes;
  for_each_size([](const TreeKernels& kernels, int rows, int) {
    const AlignedVector a = values(static_cast<std::size_t>(rows) * kLanes, 21);
    const AlignedVector b = values(static_cast<std::size_t>(rows) * kLanes, 22);
    const AlignedVector weight = values(rows, 23);
    AlignedVector g = values(static_cast<std::size_t>(kWide) * kLanes, 24);
    AlignedVector expected = g;
    for (const int lanes : {1, 2, 5, 8, kLanes}) {
      const int first = kLanes - lanes;
      kernels.gram(a.data() + first, lanes, b.data(), weight.data(), rows, g.data() + kLanes, kWide);
      for (int k = 0; k < rows; ++k) {
        for (int i = 0; i < lanes; ++i) {
          for (int j = 0; j < kLanes; ++j)
            expected[i * kWide + kLanes + j] += a[k * kLanes + first + i] * weight[k] * b[k * kLanes + j];
        }
      }
      EXPECT_LT(difference(g, expected), 1e-13) << lanes << " lanes";
    }
  });
}

TEST(TreeKernels, CombinePanelsLikeAPlainLoop) {
  for_each_size([](const TreeKernels& kernels, int rows, int parts) {
    const AlignedVector weight = values(rows, 23);
    const AlignedVector y = values(static_cast<std::size_t>(rows + parts) * kLanes, 25);
    const AlignedVector coefficient = values(static_cast<std::size_t>(parts + kLanes) * kLanes, 26);
    std::vector<PanelPart> part(parts);
    constexpr std::array<std::int32_t, 4> kLane{1, 2, 9, 15};
    for (int i = 0; i < parts; ++i) {
      part[i] = {y.data() + i * kLanes, kLane.data() + i % 3, coefficient.data() + i * kLanes, i % 3 % 2 + 1};
    }
    AlignedVector out(static_cast<std::size_t>(rows) * kLanes, kNothing);
    kernels.combine(part.data(), parts, weight.data(), rows, out.data());
    AlignedVector expected(out.size());
    for (int k = 0; k < rows; ++k) {
      for (const PanelPart& some : part) {
        for (int i = 0; i < some.columns * kLanes; ++i) {
          expected[k * kLanes + i % kLanes] +=
              weight[k] * some.rows[k * kLanes + some.lane[i / kLanes]] * some.coefficient[i];
        }
      }
    }
    EXPECT_LT(difference(out, expected), 1e-13);
  });
}

TEST(TreeKernels, FindTheLargestProduct) {
  for (const TreeKernels* kernels : tree_kernels()) {
    SCOPED_TRACE(kernels->name);
    AlignedVector a = values(3 * kLanes, 51);
    const AlignedVector b = values(3 * kLanes, 52);
    a[5] = kNothing;
    AlignedVector product(a.size());
    for (const bool magnitude : {false, true}) {
      double largest = 0;
      for (std::size_t i = 0; i < a.size(); ++i)
        largest = std::max(largest, magnitude ? std::abs(a[i] * b[i]) : a[i] * b[i]);
      const int size = static_cast<int>(a.size());
      EXPECT_EQ(kernels->products(a.data(), b.data(), size, magnitude, product.data()), largest);
      EXPECT_EQ(std::ranges::count(product, largest), 1);
      EXPECT_EQ(kernels->products(a.data(), b.data(), 0, magnitude, product.data()), 0);
    }
  }
}

TEST(TreeKernels, CompareABondsForceWithItsThreshold) {
  const AlignedVector x = values(6 * kLanes, 53);
  const AlignedVector value = values(4, 54, 4);
  const std::vector<Position> row{5, 0, 2, 3};
  const AlignedVector least(kLanes, 0.2);
  for (const TreeKernels* kernels : tree_kernels()) {
    for (const int width : {2, 4}) {
      for (const bool magnitude : {false, true}) {
        SCOPED_TRACE(std::string(kernels->name) + " " + std::to_string(width));
        for (const double no_force : {0.15, 100.0}) {
          AlignedVector ratio(kLanes, kNothing);
          kernels->ratios({row.data(), value.data(), 3.0, 0.5, no_force, width, magnitude}, x.data(),
                          least.data(), ratio.data());
          for (int lane = 0; lane < kLanes; ++lane) {
            double size = 0;
            for (int i = 0; i < width; ++i) size += value[i] * x[row[i] * kLanes + lane];
            if (magnitude) size = std::abs(size);
            const bool carries = size > 0.2 || 3 * size > no_force;
            EXPECT_NEAR(ratio[lane], carries ? 6 * size : 0, 1e-14) << lane;
          }
        }
      }
    }
  }
}

TEST(TreeKernels, AddRowsLikeAPlainLoop) {
  for_each_size([](const TreeKernels& kernels, int count, int size) {
    const int most = (size + 2 * kLanes - 1) / (2 * kLanes) * (2 * kLanes);
    const AlignedVector rows = values(static_cast<std::size_t>(count) * 96, 31);
    const AlignedVector weight = values(count, 32);
    AlignedVector sum = values(most + 1, 33);
    AlignedVector expected = sum;
    kernels.add_rows(rows.data(), 96, weight.data(), count, sum.data(), size);
    for (int i = 0; i < size; ++i) {
      for (int h = 0; h < count; ++h) expected[i] += weight[h] * rows[h * 96 + i];
      EXPECT_NEAR(sum[i], expected[i], 1e-13);
    }
    EXPECT_EQ(sum.back(), expected.back()) << "went too far";
  });
}

/// L D L^T over the front's rows.
std::vector<double> product(Case& made, const std::vector<double>& d) {
  const int n = made.p + made.q;
  std::vector<double> A(static_cast<std::size_t>(n) * n, 0.0);
  for (int k = 0; k < made.p; ++k) {
    for (int i = k; i < n; ++i) {
      for (int j = k; j < n; ++j) A[i * n + j] += made.at(i, k) * d[k] * made.at(j, k);
    }
  }
  return A;
}

/// A -= sum of w w^T times their weights, rows of w from `first` on.
void subtract(std::vector<double>& A, const Case& made, const AlignedVector& w,
              const std::vector<double>& weight, int first) {
  const int n = made.p + made.q;
  for (std::size_t v = 0; v < weight.size(); ++v) {
    const double* own = w.data() + v * made.stride;
    for (int i = first; i < n; ++i) {
      for (int j = first; j < n; ++j) A[i * n + j] -= weight[v] * own[i] * own[j];
    }
  }
}

AlignedVector small_vectors(const Case& made, int count) {
  AlignedVector w = values(static_cast<std::size_t>(made.stride) * count, 41, 0.1);
  for (int v = 0; v < count; ++v) {
    std::fill(w.begin() + v * made.stride + made.p + made.q, w.begin() + (v + 1) * made.stride, 0.0);
  }
  return w;
}

/// The old product less all w w^T is the new product less what the parent has to take: w w^T / slack.
void expect_downdate(const TreeKernels& kernels, int p, int q, int count) {
  Case made(p, q);
  AlignedVector w = small_vectors(made, count);
  std::vector<double> d(p, 2.0);
  std::vector<double> inverse(p, 0.5);
  std::vector<double> expected = product(made, d);
  subtract(expected, made, w, std::vector<double>(count, 1.0), 0);
  std::vector<double> slack(count, 1.0);
  kernels.downdate(made.block(), made.entries.data(), d.data(), inverse.data(), w.data(), count,
                   slack.data());
  std::vector<double> found = product(made, d);
  std::vector<double> weight;
  for (const double s : slack) weight.push_back(1 / s);
  subtract(found, made, w, weight, p);
  for (std::size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], expected[i], 1e-13);
  double determinants = 1;
  for (int k = 0; k < p; ++k) {
    determinants *= d[k] / 2;
    EXPECT_NEAR(d[k] * inverse[k], 1, 1e-14);
    for (int r = p + q; r < made.stride; ++r) ASSERT_EQ(made.at(r, k), 0) << "padding";
  }
  const double slacks = std::accumulate(slack.begin(), slack.end(), 1.0, std::multiplies{});
  EXPECT_NEAR(slacks, determinants, 1e-13);
}

TEST(TreeKernels, DowndateToTheProductLessTheVectors) {
  for_each_size([](const TreeKernels& kernels, int p, int q) {
    for (const int count : {0, 1, 5}) expect_downdate(kernels, p, q, count);
  });
  for (const TreeKernels* kernels : tree_kernels()) {
    for (int count = 0; count <= kLanes; ++count) expect_downdate(*kernels, 19, 12, count);
  }
}

/// What stands in a pinned pivot's row of w is rounding: it changes nothing.
TEST(TreeKernels, LeavePinnedPivotsAloneInADowndate) {
  for (const TreeKernels* kernels : tree_kernels()) {
    for (const int pinned : {0, 1, 7, 8, 12}) {
      SCOPED_TRACE(std::string(kernels->name) + " " + std::to_string(pinned));
      std::array<AlignedVector, 2> d{AlignedVector(13, 2.0), AlignedVector(13, 2.0)};
      std::array<std::array<double, 3>, 2> slack{{{1, 1, 1}, {1, 1, 1}}};
      for (const int way : {0, 1}) {
        Case made(13, 9);
        for (int r = pinned + 1; r < made.stride; ++r) made.at(r, pinned) = 0;
        AlignedVector inverse(13, 0.5);
        d[way][pinned] = inverse[pinned] = 0;
        AlignedVector w = small_vectors(made, 3);
        for (int v = 0; v < 3; ++v) w[v * made.stride + pinned] += 1e-3 * way;
        kernels->downdate(made.block(), made.entries.data(), d[way].data(), inverse.data(), w.data(), 3,
                          slack[way].data());
        EXPECT_TRUE(d[way][pinned] == 0 && inverse[pinned] == 0);
        for (int r = pinned + 1; r < made.stride; ++r) EXPECT_EQ(made.at(r, pinned), 0);
      }
      EXPECT_EQ(d[0], d[1]);
      EXPECT_EQ(slack[0], slack[1]);
    }
  }
}

/// Bonds between random rows; every ninth is broken, every tenth breaks under any force.
struct SomeBonds {
  std::vector<Position> row;
  std::vector<double> value;
  std::vector<double> limit;
  BondBlock block;

  SomeBonds(int bonds, int width) : value(test::mixed_values(static_cast<std::size_t>(bonds) * width, 51)) {
    for (int i = 0; i < bonds * width; ++i) row.push_back(i * 37 % 29);
    limit = test::mixed_values(bonds, 52);
    for (int e = 0; e < bonds; ++e) {
      limit[e] += 0.5;
      if (e % 9 == 4) limit[e] = std::numeric_limits<double>::infinity();
      if (e % 10 == 7) limit[e] = 0;
    }
    block = {row.data(), value.data(), limit.data(), bonds, width};
  }
  [[nodiscard]] bool exceeds(int e, bool magnitude, const AlignedVector& x, const AlignedVector& cut) const {
    bool any = false;
    for (int lane = 0; lane < kLanes; ++lane) {
      double force = 0;
      for (int i = e * block.width; i < (e + 1) * block.width; ++i)
        force += value[i] * x[row[i] * kLanes + lane];
      any = any || (magnitude ? std::abs(force) : force) > limit[e] * cut[lane];
    }
    return any;
  }
};

void expect_found(const TreeKernels& kernels, int bonds, int width, bool magnitude) {
  const AlignedVector x = values(29 * kLanes, 53);
  AlignedVector cut(kLanes, 1.2);
  cut[5] = 1e300;
  const SomeBonds some(bonds, width);
  std::vector<std::int32_t> expected;
  for (int e = 0; e < bonds; ++e) {
    if (some.exceeds(e, magnitude, x, cut)) expected.push_back(e);
  }
  std::vector<std::int32_t> found(bonds + 1, -1);
  const auto find = magnitude ? kernels.find_magnitude : kernels.find_tension;
  found.resize(find(some.block, x.data(), cut.data(), found.data()));
  EXPECT_EQ(found, expected) << kernels.name << ", width " << width << ", magnitude " << magnitude;
}

TEST(TreeKernels, FindEveryBondBeyondItsLimitAndNoOther) {
  for (const TreeKernels* kernels : tree_kernels()) {
    for (const int bonds : {0, 1, 2, 3, 17, 40, 63, 64, 65, 128, 200}) {
      for (const int width : {2, 4}) {
        for (const bool magnitude : {true, false}) expect_found(*kernels, bonds, width, magnitude);
      }
    }
  }
}

}  // namespace
}  // namespace crackle
