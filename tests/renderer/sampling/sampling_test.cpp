#include "renderer/sampling/sampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "base/constants.h"
#include "renderer/sampling/random.h"
#include "tests/renderer/statistics.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d uniform(int i) { return {random_uniform(11, i, 0), random_uniform(11, i, 1)}; }

double turn(double x, double y) { return std::atan2(y, x) / (2 * pi) + 0.5; }

TEST(PathSampler, SingleNumbersAreStratified) {
  std::vector<int> counts(256);
  for (std::uint32_t sample = 0; sample < 256; ++sample)
    ++counts[static_cast<int>(PathSampler{3, 4, sample, 9}.next_1d() * 256)];
  for (const int count : counts) EXPECT_EQ(count, 1);
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
      if (!are_twins) {
        EXPECT_LT(square_score([&](int i) { return both(3, i); }), 5.5) << number << " " << other;
      }
      EXPECT_LT(std::abs(square_score([&](int i) { return both(static_cast<std::uint64_t>(i), 0); })), 4.5);
    }
  }
}

TEST(PathSampler, DimensionsAndPixelsAreUnrelated) {
  const auto number = [](std::uint64_t pixel, int sample, std::uint32_t dimension) {
    return PathSampler{5, pixel, static_cast<std::uint32_t>(sample), dimension}.next_1d();
  };
  // Each number alone is stratified. This leaves 31 * 31 of 1023 degrees of freedom: 1.4 standard deviations less.
  EXPECT_LT(std::abs(square_score([&](int i) { return Vector2d(number(0, i, 0), number(0, i, 1)); })), 5.5);
  EXPECT_LT(std::abs(square_score([&](int i) { return Vector2d(number(0, i, 0), number(1, i, 0)); })), 5.5);
  // The first sample of each pixel, and two of its dimensions.
  EXPECT_LT(std::abs(square_score([&](int i) { return Vector2d(number(i, 0, 0), number(i, 0, 1)); })), 4);
  EXPECT_LT(std::abs(square_score([&](int i) { return Vector2d(number(i, 0, 0), number(i + 1, 0, 0)); })), 4);
  EXPECT_LT(std::abs(square_score([&](int i) {
              return PathSampler{5, static_cast<std::uint64_t>(i), 0}.next_2d();
            })),
            4);
}

TEST(FrameAbout, IsRightHandedAndOrthonormal) {
  for (int i = 0; i < 1000; ++i) {
    Vector3d axis = square_to_sphere(uniform(i));
    if (i < 6) axis = (i % 2 ? -1 : 1) * Vector3d::Unit(i / 2);
    if (i == 6) axis = Vector3d(1e-9, -1e-9, -1).normalized();
    const Eigen::Matrix3d frame = frame_about(axis);
    EXPECT_EQ(frame.col(2), axis);
    EXPECT_LT((frame.transpose() * frame - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_GT(frame.determinant(), 0);
  }
}

// Applies the textbook inverse to the result of each warp; the inverse must return a uniform square.

TEST(CircleAt, IsCosineAndSine) {
  for (int i = -20000; i <= 20000; ++i) {
    const double turn = i / 10000.0;
    const Vector2d at = circle_at(turn);
    EXPECT_NEAR(at.x(), std::cos(2 * pi * turn), 2e-15) << turn;
    EXPECT_NEAR(at.y(), std::sin(2 * pi * turn), 2e-15) << turn;
  }
}

/// One number chooses with the given probability, and what is left of it is uniform after either choice.
TEST(Choose, LeavesAnEvenNumber) {
  constexpr int count = 60000;
  for (const double share : {0.0, 1e-3, 0.3, 1.0}) {
    std::array<std::array<int, 10>, 2> bins{};
    for (int i = 0; i < count; ++i) {
      double u = (i + 0.5) / count;
      const bool chosen = choose(share, u);
      ASSERT_GE(u, 0);
      ASSERT_LT(u, 1);
      ++bins[chosen][static_cast<std::size_t>(10 * u)];
    }
    for (const bool chosen : {false, true})
      for (const int bin : bins[chosen]) EXPECT_NEAR(bin, count * (chosen ? share : 1 - share) / 10, 1.5) << share;
  }
}

TEST(Warps, DiskIsEven) {
  EXPECT_LT(std::abs(square_score([](int i) {
              const Vector2d p = square_to_disk(uniform(i));
              return Vector2d(p.squaredNorm(), turn(p.x(), p.y()));
            })),
            4);
  EXPECT_EQ(square_to_disk({0.5, 0.5}), Vector2d::Zero());
  for (const Vector2d& edge : {Vector2d(0, 0), Vector2d(0, 0.3), Vector2d(0.7, 0), Vector2d(1, 1), Vector2d(0.2, 1)})
    EXPECT_NEAR(square_to_disk(edge).norm(), 1, 1e-15);
}

TEST(Warps, Cone) {
  for (const double angle : {pi, 1.0, 0.1, 0.00465, 1e-7}) {
    EXPECT_LT(std::abs(square_score([angle](int i) {
                const Vector3d d = square_to_cone(uniform(i), angle);
                // sin²(θ/2) relative to its largest value, computed from sin θ if θ is small.
                const double sine = std::hypot(d.x(), d.y());
                const double half = d.z() > 0 ? std::asin(sine) / 2 : (pi - std::asin(sine)) / 2;
                return Vector2d(std::pow(std::sin(half) / std::sin(angle / 2), 2), turn(d.x(), d.y()));
              })),
              4)
        << angle;
  }
  EXPECT_NEAR(cone_solid_angle(pi), 4 * pi, 1e-14);
  EXPECT_NEAR(cone_solid_angle(pi / 2), 2 * pi, 1e-14);
  EXPECT_NEAR(cone_solid_angle(1e-7) / (pi * 1e-14), 1, 1e-9);
}

}  // namespace
}  // namespace tensorray
