#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "crackle/base/named.hpp"
#include "crackle/network/disorder.hpp"
#include "crackle/network/lattices.hpp"
#include "support/expect_refused.hpp"

namespace crackle {
namespace {

__extension__ typedef unsigned __int128 Wide;
using Words = std::array<std::uint64_t, 2>;

/// Philox2x64-10 as the paper of J. K. Salmon et al. describes it: ten rounds of multiplying and mixing.
Words philox(Words counter, std::uint64_t key) {
  for (int round = 0; round < 10; ++round) {
    const Wide product = Wide{0xD2B74407B1CE6E93} * counter[0];
    counter = {static_cast<std::uint64_t>(product >> 64) ^ key ^ counter[1],
               static_cast<std::uint64_t>(product)};
    key += 0x9E3779B97F4A7C15;
  }
  return counter;
}

std::vector<double> thresholds(std::uint64_t seed, std::int64_t sample, std::size_t bonds) {
  std::vector<double> values(bonds, -1);
  draw_uniform_thresholds(seed, sample, values);
  return values;
}

TEST(Disorder, IsPhiloxAndHasTheValuesItAlwaysHad) {
  // known answers that Random123 publishes: counter, key, words
  constexpr std::uint64_t kOnes = ~std::uint64_t{0};
  EXPECT_EQ(philox({0, 0}, 0), (Words{0xca00a0459843d731, 0x66c24222c9a845b5}));
  EXPECT_EQ(philox({kOnes, kOnes}, kOnes), (Words{0x65b021d60cd8310f, 0x4d02f3222f86df20}));
  EXPECT_EQ(philox({0x243f6a8885a308d3, 0x13198a2e03707344}, 0xa4093822299f31d0),
            (Words{0x0a5e742c2997341c, 0xb0f883d38000de5d}));
  for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{77}, kOnes}) {
    for (const std::int64_t sample : {std::int64_t{0}, std::int64_t{3}, std::int64_t{1} << 40}) {
      const std::vector<double> drawn = thresholds(seed, sample, 200);
      for (std::size_t bond = 0; bond < drawn.size(); ++bond) {
        const std::uint64_t word = philox({bond, static_cast<std::uint64_t>(sample)}, seed)[0];
        ASSERT_EQ(drawn[bond], std::ldexp(static_cast<double>(word >> 11), -53)) << seed << " " << sample;
      }
    }
  }
  // Runs are compared by their thresholds: these must never change.
  EXPECT_EQ(thresholds(0, 0, 1)[0], 0x1.9401408b3087ap-1);
  const std::vector<double> first = thresholds(1, 0, 4);
  EXPECT_EQ(first[0], 0x1.d7a4a4f00a661p-1);
  EXPECT_EQ(first[1], 0x1.b32854b84bb9dp-1);
  EXPECT_EQ(first[2], 0x1.7f6aac159e6eep-2);
  EXPECT_EQ(first[3], 0x1.1c984b16f6ff3p-1);
  EXPECT_EQ(thresholds(1, 1, 2)[1], 0x1.ce6835d1953e7p-1);
  EXPECT_EQ(thresholds(2, 0, 2)[1], 0x1.5955eac065ae6p-1);
  EXPECT_EQ(thresholds(12345678901234567890U, 7, 1001)[1000], 0x1.a3a5e118f6512p-2);
}

TEST(Disorder, DependsOnSeedSampleAndBondAlone) {
  const std::vector<double> whole = thresholds(5, 9, 100);
  (void)thresholds(5, 10, 31);
  (void)thresholds(6, 9, 7);
  EXPECT_EQ(thresholds(5, 9, 100), whole) << "drawn again, after others";
  const std::vector<double> part = thresholds(5, 9, 40);
  EXPECT_TRUE(std::equal(part.begin(), part.end(), whole.begin())) << "fewer bonds";
  EXPECT_NE(thresholds(5, 10, 100), whole);
  EXPECT_NE(thresholds(6, 9, 100), whole);
}

/// Correlation of two sequences of uniform numbers; about 1/sqrt(n) when they are independent.
double correlation(const double* a, const double* b, std::size_t n) {
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) sum += (a[i] - 0.5) * (b[i] - 0.5);
  return 12 * sum / static_cast<double>(n);
}

TEST(Disorder, IsUniformAndIndependent) {
  // Chi-square of 100 bins, 99 degrees of freedom: above 149 or below 62 once in a thousand samples each.
  {
    constexpr std::size_t kDraws = 100000;
    const std::vector<double> drawn = thresholds(3, 0, kDraws);
    std::array<double, 100> bin{};
    for (const double t : drawn) {
      ASSERT_GE(t, 0);
      ASSERT_LT(t, 1);
      ASSERT_EQ(std::floor(std::ldexp(t, 53)), std::ldexp(t, 53)) << "no multiple of 2^-53";
      ++bin[static_cast<std::size_t>(100 * t)];
    }
    double chi_square = 0;
    for (const double count : bin) chi_square += (count - kDraws / 100.0) * (count - kDraws / 100.0);
    chi_square /= kDraws / 100.0;
    EXPECT_LT(chi_square, 149);
    EXPECT_GT(chi_square, 62);
  }
  {
    constexpr std::size_t kDraws = 100000;
    const double four_sigma = 4 / std::sqrt(static_cast<double>(kDraws));
    const std::vector<double> here = thresholds(1, 0, kDraws + 1);
    EXPECT_LT(std::abs(correlation(here.data(), here.data() + 1, kDraws)), four_sigma) << "bonds";
    EXPECT_LT(std::abs(correlation(here.data(), thresholds(1, 1, kDraws).data(), kDraws)), four_sigma)
        << "samples";
    EXPECT_LT(std::abs(correlation(here.data(), thresholds(2, 0, kDraws).data(), kDraws)), four_sigma)
        << "seeds";
  }
}

TEST(Disorder, LawsFollowFromTheUniformNumbers) {
  constexpr std::size_t kDraws = 20000;
  const std::vector<double> r = thresholds(5, 2, kDraws);
  std::vector<double> drawn(kDraws);
  draw_thresholds({.seed = 5}, 2, drawn);
  EXPECT_EQ(drawn, r);
  draw_thresholds({.law = find_named(threshold_laws(), "constant"), .seed = 5}, 2, drawn);
  EXPECT_EQ(drawn, std::vector<double>(kDraws, 1.0));
  draw_thresholds({.law = find_named(threshold_laws(), "power"), .exponent = 50, .seed = 5}, 2, drawn);
  for (std::size_t i = 0; i < kDraws; ++i) ASSERT_EQ(drawn[i], std::pow(r[i], 50)) << i;
  EXPECT_LT(*std::ranges::min_element(drawn), 1e-180);

  draw_thresholds({.zero_share = 0.25, .seed = 5}, 2, drawn);
  std::size_t zeros = 0;
  for (std::size_t i = 0; i < kDraws; ++i) {
    if (drawn[i] == 0) ++zeros;
    ASSERT_TRUE(drawn[i] == 0 || drawn[i] == r[i]) << i;
  }
  EXPECT_NEAR(static_cast<double>(zeros) / kDraws, 0.25, 4 * std::sqrt(0.25 * 0.75 / kDraws));
}

TEST(Disorder, WeibullsSurviveAsTheirModulusSays) {
  constexpr std::size_t kDraws = 20000;
  std::vector<double> drawn(kDraws);
  for (const double modulus : {0.5, 2.0, 20.0}) {
    const DisorderOptions law{.law = find_named(threshold_laws(), "weibull"), .exponent = modulus, .seed = 5};
    draw_thresholds(law, 2, drawn);
    for (const double t : {0.3, 1.0, 1.2}) {
      const double alive = std::exp(-std::pow(t, modulus));
      const double seen =
          static_cast<double>(std::ranges::count_if(drawn, [t](double x) { return x > t; })) / kDraws;
      EXPECT_NEAR(seen, alive, 4 * std::sqrt(alive * (1 - alive) / kDraws) + 1e-12) << modulus << " " << t;
    }
  }
  const DisorderOptions wide{.law = find_named(threshold_laws(), "weibull"), .exponent = 1e-3, .seed = 5};
  test::expect_refused([&] { draw_thresholds(wide, 2, drawn); },
                       {"-disorder_exponent 0.001", "a number from"});
}

TEST(Disorder, PowersThatDoublesCannotHoldAreRefused) {
  std::vector<double> drawn(40);
  const DisorderOptions law{.law = find_named(threshold_laws(), "power"), .exponent = 500, .seed = 5};
  test::expect_refused([&] { draw_thresholds(law, 0, drawn); },
                       {"-disorder_exponent 500", "sample 0", "up to"});
  const std::vector<double> r = thresholds(5, 0, drawn.size());
  const double most = std::log(kLeastThreshold) / std::log(*std::ranges::min_element(r));
  EXPECT_NO_THROW(draw_thresholds(
      {.law = find_named(threshold_laws(), "power"), .exponent = most * 0.999, .seed = 5}, 0, drawn));
  std::vector<std::size_t> order(r.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t bond) { return r[bond]; });
  for (std::size_t i = 1; i < order.size(); ++i) EXPECT_LT(drawn[order[i - 1]], drawn[order[i]]);
  test::expect_refused(
      [&] {
        draw_thresholds({.law = find_named(threshold_laws(), "power"), .exponent = most * 1.001, .seed = 5},
                        0, drawn);
      },
      {"-disorder_exponent"});
}

TEST(Disorder, StiffnessesAreWhereTheirKindSays) {
  const Lattice lattice = triangular_lattice(30, 1);
  EXPECT_TRUE(draw_stiffness({}, lattice).empty());
  const auto count = [&](const StiffnessOptions& options, auto condition) {
    const std::vector<double> k = draw_stiffness(options, lattice);
    EXPECT_EQ(k.size(), lattice.bond.size());
    return static_cast<double>(std::ranges::count_if(k, condition)) / static_cast<double>(k.size());
  };
  const StiffnessOptions random{.law = find_named(stiffness_laws(), "random"), .contrast = 1e6};
  EXPECT_EQ(count(random, [](double k) { return k > 1e-6 && k <= 1; }), 1);
  EXPECT_NEAR(count(random, [](double k) { return k < 1e-3; }), 0.5, 0.05);
  const StiffnessOptions inclusion{.law = find_named(stiffness_laws(), "inclusion"), .contrast = 100};
  EXPECT_NEAR(count(inclusion, [](double k) { return k == 100; }), 3.14159 / 36 * 0.8, 0.02);
  const StiffnessOptions band{.law = find_named(stiffness_laws(), "band"), .contrast = 100};
  EXPECT_NEAR(count(band, [](double k) { return k == 0.01; }), 0.2, 0.03);
  EXPECT_NEAR(count({.dilution = 0.3}, [](double k) { return k == 0; }), 0.3, 0.04);
  EXPECT_NE(draw_stiffness({.dilution = 0.3, .seed = 2}, lattice),
            draw_stiffness({.dilution = 0.3}, lattice));
}

}  // namespace
}  // namespace crackle
