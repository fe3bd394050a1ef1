#include "renderer/sampling/sampling.h"

#include <array>
#include <limits>

#include <Eigen/LU>

#include "base/constants.h"
#include "renderer/sampling/random.h"
#include "tests/renderer/statistics.h"

namespace tensorray {
namespace {

using testing::Each;

Vector2d uniform(int i) { return {random_uniform(11, i, 0), random_uniform(11, i, 1)}; }

/// The score of the pairs (first(i), second(i)), which are uniform only if both are uniform and independent.
template <class First, class Second>
double pair_score(const First& first, const Second& second) {
  return square_score([&](int i) { return Vector2d(first(i), second(i)); });
}

double turn(double x, double y) { return std::atan2(y, x) / (2 * pi) + 0.5; }

TEST(PathSampler, SingleNumbersAreStratified) {
  std::vector<int> counts(256);
  for (std::uint32_t i = 0; i < 256; ++i) ++counts[static_cast<int>(PathSampler{3, 4, i, 9}.next_1d() * 256)];
  EXPECT_THAT(counts, Each(1));
}

/// Some of the pairs that a sample has without dimensions.
Vector2d pair_of(std::uint64_t pixel, int sample, int number) {
  const PathSampler path(5, pixel, static_cast<std::uint32_t>(sample));
  if (number == 0) return path.in_pixel();
  const SurfaceNumbers numbers = path.at_surface((number + 1) / 2);
  return number % 2 ? numbers.direction : numbers.light;
}

TEST(PathSampler, NumbersOfSurfacesAreEvenAndUnrelated) {
  constexpr int pairs = 7;  // Those of three surfaces, too.
  for (int number = 0; number < pairs; ++number) {
    EXPECT_LT(square_score([&](int i) { return pair_of(1, i, number); }), 4) << number;
    EXPECT_LT(std::abs(square_score([&](int i) { return pair_of(static_cast<std::uint64_t>(i), 0, number); })), 4);
    for (int other = 0; other < number; ++other) {
      const auto both = [&](std::uint64_t pixel, int sample) {
        return Vector2d(pair_of(pixel, sample, number).x(), pair_of(pixel, sample, other).x());
      };
      const bool are_twins = number % 2 == 0 && other == number - 1;  // Of one point, so related within a pixel.
      EXPECT_TRUE(are_twins || square_score([&](int i) { return both(3, i); }) < 5.5) << number << " " << other;
      EXPECT_LT(std::abs(square_score([&](int i) { return both(static_cast<std::uint64_t>(i), 0); })), 4.5);
    }
  }
}

TEST(PathSampler, DimensionsAndPixelsAreUnrelated) {
  const auto number = [](std::uint64_t pixel, int sample, std::uint32_t dimension) {
    return PathSampler{5, pixel, static_cast<std::uint32_t>(sample), dimension}.next_1d();
  };
  const auto pair = [](int i) { return PathSampler{5, static_cast<std::uint64_t>(i), 0}.next_2d(); };
  // Each number alone is stratified. This leaves 31 * 31 of 1023 degrees of freedom: 1.4 standard deviations less.
  const auto of_sample = [&](int i) { return number(0, i, 0); };
  EXPECT_LT(std::abs(pair_score(of_sample, [&](int i) { return number(0, i, 1); })), 5.5);
  EXPECT_LT(std::abs(pair_score(of_sample, [&](int i) { return number(1, i, 0); })), 5.5);
  // The first sample of each pixel, and two of its dimensions.
  const auto of_pixel = [&](int i) { return number(i, 0, 0); };
  EXPECT_LT(std::abs(pair_score(of_pixel, [&](int i) { return number(i, 0, 1); })), 4);
  EXPECT_LT(std::abs(pair_score(of_pixel, [&](int i) { return number(i + 1, 0, 0); })), 4);
  EXPECT_LT(std::abs(square_score(pair)), 4);
}

TEST(FrameAbout, IsRightHandedAndOrthonormal) {
  for (int i = 0; i < 1000; ++i) {
    Vector3d axis = square_to_sphere(uniform(i));
    if (i < 6) axis = (i % 2 ? -1 : 1) * Vector3d::Unit(i / 2);
    if (i == 6) axis = Vector3d(1e-9, -1e-9, -1).normalized();
    const Matrix3d frame = frame_about(axis);
    EXPECT_EQ(frame.col(2), axis);
    EXPECT_LT((frame.transpose() * frame - Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_GT(frame.determinant(), 0);
  }
}

TEST(CircleAt, IsCosineAndSine) {
  for (int i = -20000; i <= 20000; ++i) {
    const double turn = i / 10000.0;
    const Vector2d exact(std::cos(2 * pi * turn), std::sin(2 * pi * turn));
    EXPECT_TRUE(((circle_at(turn) - exact).array().abs() <= 2e-15).all()) << turn;
  }
}

TEST(Choose, LeavesAnEvenNumber) {
  constexpr int count = 60000;
  for (const double share : {0.0, 1e-3, 0.3, 1.0}) {
    std::array<std::array<int, 10>, 2> bins{};
    for (int i = 0; i < count; ++i) {
      double u = (i + 0.5) / count;
      const bool chosen = choose(share, u);
      ASSERT_TRUE(u >= 0 && u < 1) << u;
      ++bins[chosen][static_cast<std::size_t>(10 * u)];
    }
    for (const bool chosen : {false, true})
      for (const int bin : bins[chosen]) EXPECT_NEAR(bin, count * (chosen ? share : 1 - share) / 10, 1.5) << share;
  }
}

// The textbook inverse of each warp must return a uniform square.

TEST(Warps, DiskIsEven) {
  const auto inverse = [](int i) {
    const Vector2d p = square_to_disk(uniform(i));
    return Vector2d(p.squaredNorm(), turn(p.x(), p.y()));
  };
  EXPECT_LT(std::abs(square_score(inverse)), 4);
  EXPECT_EQ(square_to_disk({0.5, 0.5}), Vector2d::Zero());
  for (const Vector2d& edge : {Vector2d(0, 0), Vector2d(0, 0.3), Vector2d(0.7, 0), Vector2d(1, 1), Vector2d(0.2, 1)})
    EXPECT_NEAR(square_to_disk(edge).norm(), 1, 1e-15);
}

TEST(Warps, Cone) {
  for (const double angle : {pi, 1.0, 0.1, 0.00465, 1e-7}) {
    const auto inverse = [angle](int i) {
      const Vector3d d = square_to_cone(uniform(i), angle);
      // sin²(θ/2) relative to its largest value, computed from sin θ if θ is small.
      const double sine = std::hypot(d.x(), d.y());
      const double half = d.z() > 0 ? std::asin(sine) / 2 : (pi - std::asin(sine)) / 2;
      return Vector2d(std::pow(std::sin(half) / std::sin(angle / 2), 2), turn(d.x(), d.y()));
    };
    EXPECT_LT(std::abs(square_score(inverse)), 4) << angle;
  }
  EXPECT_NEAR(cone_solid_angle(pi), 4 * pi, 1e-14);
  EXPECT_NEAR(cone_solid_angle(pi / 2), 2 * pi, 1e-14);
  EXPECT_NEAR(cone_solid_angle(1e-7) / (pi * 1e-14), 1, 1e-9);
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
    for (const std::uint32_t index : {0u, 1u, 2u, 77u, 4096u, 3000000000u, 0xffffffffu})
      EXPECT_EQ(sobol_pair(seed, index), (std::array{sobol(seed, index, 0), sobol(seed, index, 1)})) << index;
}

/// Whether each box of 2^-bits[0] × … has as many of the first 2^k points.
template <class Point>
bool is_even(int k, const std::array<int, 4>& bits, const Point& point_of) {
  std::vector<int> counts(std::size_t{1} << (bits[0] + bits[1] + bits[2] + bits[3]));
  for (int index = 0; index < (1 << k); ++index) {
    const std::array<double, 4> point = point_of(index);
    std::size_t box = 0;
    for (std::size_t axis = 0; axis < 4; ++axis)
      box = (box << bits[axis]) + static_cast<std::size_t>(std::ldexp(point[axis], bits[axis]));
    ++counts[box];
  }
  return std::all_of(counts.begin(), counts.end(), [&](int count) { return count == counts[0]; });
}

TEST(SobolTest, FirstPointsFillEveryElementaryInterval) {
  for (const std::uint64_t seed : {0u, 1u, 12345u}) {
    const auto point = [&](int index) { return std::array{sobol(seed, index, 0), sobol(seed, index, 1), 0.0, 0.0}; };
    for (int k = 0; k <= 10; ++k)
      for (int i = 0; i <= k; ++i)
        ASSERT_TRUE(is_even(k, {i, k - i, 0, 0}, point))
            << "seed " << seed << ", 2^" << k << " points, column bits " << i;
  }
}

TEST(SobolTest, FourDimensionsAreStratifiedTogether) {
  for (const bool second : {false, true}) {
    // A joint point, with one of its twins.
    const auto point = [second](int index) {
      const auto i = static_cast<std::uint32_t>(index);
      const auto [x, y] = joint_sobol_start(77, i);
      const SobolTwins twins = joint_sobol_twins(78, i);
      const auto [z, w] = second ? twins.second : twins.first;
      return std::array<double, 4>{x, y, z, w};
    };
    for (int k = 2; k <= 10; ++k) {
      const int bits = k - (k <= 7 ? 2 : 3);
      for (int a = 0; a <= bits; ++a)
        for (int b = 0; a + b <= bits; ++b)
          for (int c = 0; a + b + c <= bits; ++c)
            EXPECT_TRUE(is_even(k, {a, b, c, bits - a - b - c}, point)) << k << ": " << a << " " << b << " " << c;
      for (int a = 0; a <= k; ++a) EXPECT_TRUE(is_even(k, {a, k - a, 0, 0}, point)) << k << ": " << a;
    }
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

TEST(Distribution1D, InvertsTheCumulativeSum) {
  const Distribution1D distribution({0, 3, 1, 0, 0, 4, 0});
  EXPECT_EQ(distribution.sample(0).cell, 1);
  EXPECT_EQ(distribution.sample(0).within, 0);
  EXPECT_EQ(distribution.sample(0.375).cell, 2);
  EXPECT_EQ(distribution.sample(0.4375).within, 0.5);
  EXPECT_EQ(distribution.sample(0.5).cell, 5);
  const Distribution1D::Sample last = distribution.sample(1 - 0x1p-53);
  EXPECT_EQ(last.cell, 5);
  EXPECT_LT(last.within, 1);
}

TEST(Distribution1D, NothingIsEven) {
  for (const double value : {0.0, std::numeric_limits<double>::denorm_min()}) {
    const Distribution1D distribution({value, value, value, value});
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(distribution.probability(i), 0.25);
      EXPECT_EQ(distribution.sample(0.25 * i + 0.1).cell, i);
    }
  }
}

}  // namespace
}  // namespace tensorray
