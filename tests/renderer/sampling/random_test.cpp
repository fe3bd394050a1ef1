#include "renderer/sampling/random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "tests/renderer/statistics.h"

namespace tensorray {
namespace {

/// The score of the pairs (first(i), second(i)), which are uniform only if both are uniform and independent.
template <class First, class Second>
double pair_score(const First& first, const Second& second) {
  return square_score([&](int i) { return Eigen::Vector2d(first(i), second(i)); });
}

TEST(RandomUniformTest, KeysAreIndependent) {
  const auto base = [](int i) { return random_uniform(5, i, 0); };
  EXPECT_LT(std::abs(pair_score(base, [](int i) { return random_uniform(5, i, 1); })), 4) << "dimensions";
  EXPECT_LT(std::abs(pair_score(base, [](int i) { return random_uniform(5, i + 1, 0); })), 4) << "indices";
  EXPECT_LT(std::abs(pair_score(base, [](int i) { return random_uniform(6, i, 0); })), 4) << "seeds";
  EXPECT_LT(std::abs(pair_score(base, [](int i) { return random_uniform(i, 5, 0); })), 4) << "seed for index";
  const auto by_seed = [](int i) { return random_uniform(i, 0, 0); };
  EXPECT_LT(std::abs(pair_score(by_seed, [](int i) { return random_uniform(i + 1, 0, 0); })), 4) << "runs of seeds";
  EXPECT_LT(std::abs(pair_score(by_seed, [](int i) { return random_uniform(i, 0, 1); })), 4) << "dimensions by seed";
}

TEST(SobolTest, PairsAreItsFirstDimensions) {
  for (const std::uint64_t seed : {0u, 1u, 12345u})
    for (const std::uint32_t index : {0u, 1u, 2u, 77u, 4096u, 3000000000u, 0xffffffffu}) {
      const auto [x, y] = sobol_pair(seed, index);
      EXPECT_EQ(x, sobol(seed, index, 0));
      EXPECT_EQ(y, sobol(seed, index, 1));
    }
}

TEST(SobolTest, FirstPointsFillEveryElementaryInterval) {
  for (const std::uint64_t seed : {0u, 1u, 12345u})
    for (int k = 0; k <= 10; ++k)
      for (int i = 0; i <= k; ++i) {
        std::vector<int> counts(1 << k);
        for (int index = 0; index < (1 << k); ++index) {
          const int column = static_cast<int>(std::ldexp(sobol(seed, index, 0), i));
          const int row = static_cast<int>(std::ldexp(sobol(seed, index, 1), k - i));
          ++counts[(column << (k - i)) + row];
        }
        for (const int count : counts)
          ASSERT_EQ(count, 1) << "seed " << seed << ", 2^" << k << " points, column bits " << i;
      }
}

/// The coordinates of a joint point, with one of its twins.
std::array<double, 4> joint_point(std::uint64_t key, int index, bool second) {
  const auto i = static_cast<std::uint32_t>(index);
  const auto [x, y] = joint_sobol_start(key, i);
  const SobolTwins twins = joint_sobol_twins(key + 1, i);
  const auto [z, w] = second ? twins.second : twins.first;
  return {x, y, z, w};
}

/// Whether each box of 2^-bits[0] × … has as many of the first 2^k joint points.
bool is_even(int k, const std::array<int, 4>& bits, bool second) {
  std::vector<int> counts(std::size_t{1} << (bits[0] + bits[1] + bits[2] + bits[3]));
  for (int index = 0; index < (1 << k); ++index) {
    const std::array<double, 4> point = joint_point(77, index, second);
    std::size_t box = 0;
    for (std::size_t axis = 0; axis < 4; ++axis)
      box = (box << bits[axis]) + static_cast<std::size_t>(std::ldexp(point[axis], bits[axis]));
    ++counts[box];
  }
  return std::all_of(counts.begin(), counts.end(), [&](int count) { return count == counts[0]; });
}

TEST(SobolTest, FourDimensionsAreStratifiedTogether) {
  for (const bool second : {false, true})
    for (int k = 2; k <= 10; ++k) {
      const int bits = k - (k <= 7 ? 2 : 3);
      for (int a = 0; a <= bits; ++a)
        for (int b = 0; a + b <= bits; ++b)
          for (int c = 0; a + b + c <= bits; ++c)
            EXPECT_TRUE(is_even(k, {a, b, c, bits - a - b - c}, second)) << k << ": " << a << " " << b << " " << c;
      for (int a = 0; a <= k; ++a) EXPECT_TRUE(is_even(k, {a, k - a, 0, 0}, second)) << k << ": " << a;
    }
}

TEST(SobolTest, TwinsAreUncorrelated) {
  // One function of each; over keys, the errors of their means must not go together.
  double product = 0, first2 = 0, second2 = 0;
  for (std::uint64_t key = 0; key < 4000; ++key) {
    double first = -0.25, second = -0.25;
    for (std::uint32_t i = 0; i < 16; ++i) {
      const SobolTwins twins = key % 2 ? joint_sobol_twins(10 * key, i) : sobol_twins(10 * key, i);
      first += twins.first[0] * twins.first[1] / 16;
      second += twins.second[0] * twins.second[1] / 16;
    }
    product += first * second;
    first2 += first * first;
    second2 += second * second;
  }
  EXPECT_LT(std::abs(product) / std::sqrt(first2 * second2), 4 / std::sqrt(4000.0));
}

}  // namespace
}  // namespace tensorray
