#include "renderer/density/kernel_deposit.h"

#include <cmath>

#include <gtest/gtest.h>

namespace tensorray {
namespace {

/// The centred B-spline of a degree, by its definition:  d B_d(x) = (x + (d+1)/2) B_{d−1}(x + ½) + ((d+1)/2 − x)
/// B_{d−1}(x − ½).
double spline(int degree, double x) {
  if (degree == 0) return x >= -0.5 && x < 0.5 ? 1 : 0;
  const double half = (degree + 1) / 2.0;
  return ((x + half) * spline(degree - 1, x + 0.5) + (half - x) * spline(degree - 1, x - 0.5)) / degree;
}

DensityPoint make_point(float x, float y, int column, int row, int channel) {
  DensityPoint point;
  point.x = x;
  point.y = y;
  point.column = static_cast<std::uint16_t>(column);
  point.row = static_cast<std::uint16_t>(row);
  point.channel = static_cast<std::uint16_t>(channel);
  return point;
}

TEST(KernelDeposit, SplinesAreQuinticBSplines) {
  constexpr std::size_t width = 9;
  for (const float x : {0.0f, 0.125f, 0.5f, 0.9f, 1.0f}) {
    std::vector<double> pixels(width * 8);
    deposit_splines({make_point(x, 0.25f, 2, 1, 0)}, 0, 1, {pixels.data(), width, nullptr});
    for (int row = 0; row < 8; ++row)
      for (int column = 0; column < 9; ++column)
        ASSERT_NEAR(pixels[row * width + column], spline(5, column - 4.0 - x) * spline(5, row - 3.25), 1e-15)
            << x << " " << row << " " << column;
  }
}

TEST(KernelDeposit, ColoursMultiplyTheKernel) {
  constexpr std::size_t width = 40, height = 8;
  const std::vector<PixelColor> colors{{{1, 2, 3, 0}}, {{0.5, 0, -1, 0}}};
  std::vector<DensityPoint> points;
  for (int i = 0; i < 150; ++i)  // More points than one group of points whose weights are computed together.
    points.push_back(make_point(static_cast<float>(i) / 150, 0.3f, i % 30, i % 2, i % 2));
  const GaussianKernel gaussian(1.5, 2.25);
  for (const bool splines : {true, false}) {
    const auto deposit = [&](std::size_t first, std::size_t last, const DepositTarget& target) {
      splines ? deposit_splines(points, first, last, target) : deposit_gaussians(points, first, last, gaussian, target);
    };
    std::vector<PixelColor> colored(width * height);
    deposit(0, points.size(), {colored[0].values, width, colors.data()});
    std::vector<PixelColor> expected(width * height);
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::vector<double> plain(width * height);
      deposit(i, i + 1, {plain.data(), width, nullptr});
      for (std::size_t pixel = 0; pixel < plain.size(); ++pixel)
        for (int c = 0; c < 3; ++c) expected[pixel].values[c] += plain[pixel] * colors[points[i].channel].values[c];
    }
    for (std::size_t pixel = 0; pixel < expected.size(); ++pixel)
      for (int c = 0; c < 4; ++c) ASSERT_NEAR(colored[pixel].values[c], expected[pixel].values[c], 1e-13) << splines;
  }
}

TEST(KernelDeposit, WhatIsAddedIsRounded) {
  constexpr std::size_t width = 40, height = 8;
  const double quantum = std::ldexp(1.0, -26);
  const std::vector<PixelColor> colors{{{0.9, 0.3, -0.01, 0}}};
  const std::vector<DensityPoint> points{make_point(0.37f, 0.81f, 5, 1, 0)};
  const GaussianKernel gaussian(1.5, 2.25);
  for (const PixelColor* const color : {colors.data(), static_cast<const PixelColor*>(nullptr)})
    for (const bool splines : {true, false}) {
      const auto deposit = [&](double rounding) {
        std::vector<PixelColor> pixels(width * height);
        const DepositTarget target{pixels[0].values, width, color, rounding};
        splines ? deposit_splines(points, 0, 1, target) : deposit_gaussians(points, 0, 1, gaussian, target);
        return pixels;
      };
      const std::vector<PixelColor> exact = deposit(0), rounded = deposit(std::ldexp(1.5, 52) * quantum);
      for (std::size_t pixel = 0; pixel < exact.size(); ++pixel)
        for (int c = 0; c < 4; ++c) {
          const double value = rounded[pixel].values[c] / quantum;
          ASSERT_EQ(value, std::round(value));
          ASSERT_NEAR(value, exact[pixel].values[c] / quantum, 0.5 + 1e-6);
        }
    }
}

TEST(KernelDeposit, GaussiansAreCutAndNormalised) {
  for (const double tau : {0.3, 0.7, 1.9}) {
    const double reach = 4.5 * tau + 0.5;
    const GaussianKernel kernel(tau, reach);
    for (const double beyond : {0.0, 0.2, 0.5, 0.99}) {
      std::vector<double> weights(kernel.taps());
      kernel.weights(beyond, weights.data());
      double sum = 0;
      const auto value = [&](int i) {
        const double distance = i - (kernel.taps() / 2 - 1) - beyond;
        return std::abs(distance) <= reach ? std::exp(-distance * distance / (2 * tau * tau)) : 0;
      };
      for (int i = -2; i < kernel.taps() + 2; ++i) sum += value(i);  // The part that is cut off lies beyond the reach.
      for (int i = 0; i < kernel.taps(); ++i) ASSERT_NEAR(weights[i], value(i) / sum, 1e-14) << tau << " " << beyond;
    }
  }
}

}  // namespace
}  // namespace tensorray
