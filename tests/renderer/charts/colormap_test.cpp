#include "renderer/charts/colormap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/constants.h"
#include "renderer/color/color.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

using ::testing::HasSubstr;

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

Eigen::Vector3d to_lab(const Eigen::Vector3d& linear) {
  const Eigen::Matrix3d matrix = rec709_to_xyz();
  const Eigen::Vector3d white = matrix * Eigen::Vector3d::Ones();
  const Eigen::Vector3d f = (matrix * linear).cwiseQuotient(white).unaryExpr([](double t) {
    return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116;
  });
  return {116 * f.y() - 16, 500 * (f.x() - f.y()), 200 * (f.y() - f.z())};
}

double degrees(double angle) { return angle * 180 / pi; }
double radians(double angle) { return angle * pi / 180; }
double cos_degrees(double angle) { return std::cos(radians(angle)); }

/// The hue angle, 0 to 360 degrees.
double hue(double a, double b) {
  const double angle = degrees(std::atan2(b, a));
  return angle < 0 ? angle + 360 : angle;
}

/// CIEDE2000 (CIE 142; G. Sharma, W. Wu, E. Dalal 2005).
double color_difference(const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
  const auto seventh = [](double c) { return std::sqrt(std::pow(c, 7) / (std::pow(c, 7) + std::pow(25.0, 7))); };
  const double stretch = 1 + 0.5 * (1 - seventh((std::hypot(p[1], p[2]) + std::hypot(q[1], q[2])) / 2));
  const double c1 = std::hypot(stretch * p[1], p[2]), c2 = std::hypot(stretch * q[1], q[2]);
  const double h1 = hue(stretch * p[1], p[2]), h2 = hue(stretch * q[1], q[2]);
  double turn = c1 * c2 == 0 ? 0 : h2 - h1;
  if (turn > 180) turn -= 360;
  if (turn < -180) turn += 360;
  const double h = c1 * c2 == 0 ? h1 + h2 : h1 + turn / 2, c = (c1 + c2) / 2, l = (p[0] + q[0]) / 2;
  const double t = 1 - 0.17 * cos_degrees(h - 30) + 0.24 * cos_degrees(2 * h) + 0.32 * cos_degrees(3 * h + 6) -
                   0.2 * cos_degrees(4 * h - 63);
  const double positive = h < 0 ? h + 360 : h;
  const double blue = 60 * std::exp(-std::pow((positive - 275) / 25, 2));
  const double sl = 1 + 0.015 * std::pow(l - 50, 2) / std::sqrt(20 + std::pow(l - 50, 2));
  const double dl = (q[0] - p[0]) / sl, dc = (c2 - c1) / (1 + 0.045 * c);
  const double dh = 2 * std::sqrt(c1 * c2) * std::sin(radians(turn / 2)) / (1 + 0.015 * c * t);
  return std::sqrt(dl * dl + dc * dc + dh * dh - std::sin(radians(blue)) * 2 * seventh(c) * dc * dh);
}

Eigen::Vector3d lab(Colormap map, double x) { return to_lab(colormap_linear(map, x)); }

/// In the order of the enumeration.
constexpr const char* names[] = {"viridis", "magma", "inferno", "plasma", "cividis", "cool_warm", "twilight", "grey"};

const char* name_of(Colormap map) { return names[static_cast<std::size_t>(map)]; }

std::vector<Colormap> all_maps() {
  std::vector<Colormap> maps;
  for (std::size_t i = 0; i < std::size(names); ++i) maps.push_back(static_cast<Colormap>(i));
  return maps;
}

struct Published {
  Colormap map;
  double x;
  Eigen::Vector3d color;  ///< From 0 to 255.
  double tolerance;
};

/// Compares entries of the published tables that lie between the control points.
TEST(ColormapTest, AgreesWithThePublishedTables) {
  const auto of256 = [](int i) { return i / 255.0; };
  const std::vector<Published> entries{{Colormap::viridis, of256(3), {69, 5, 89}, 1.5},
                                       {Colormap::viridis, of256(42), {68, 57, 131}, 1.5},
                                       {Colormap::viridis, of256(128), {33, 145, 140}, 1.5},
                                       {Colormap::viridis, of256(213), {144, 215, 67}, 1.5},
                                       {Colormap::magma, of256(42), {44, 17, 95}, 1.5},
                                       {Colormap::magma, of256(128), {183, 55, 121}, 1.5},
                                       {Colormap::magma, of256(252), {252, 247, 185}, 1.5},
                                       {Colormap::inferno, of256(42), {50, 10, 94}, 1.5},
                                       {Colormap::inferno, of256(213), {251, 182, 26}, 1.5},
                                       {Colormap::inferno, of256(252), {248, 251, 154}, 1.5},
                                       {Colormap::plasma, of256(3), {22, 7, 138}, 1.5},
                                       {Colormap::plasma, of256(128), {204, 71, 120}, 1.5},
                                       {Colormap::plasma, of256(213), {253, 180, 47}, 1.5},
                                       {Colormap::cividis, of256(42), {42, 63, 109}, 3.5},
                                       {Colormap::cividis, of256(128), {125, 124, 120}, 3.5},
                                       {Colormap::cividis, of256(213), {210, 192, 96}, 3.5},
                                       {Colormap::twilight, 84 / 509.0, {124, 162, 194}, 1.5},
                                       {Colormap::twilight, 255 / 509.0, {47, 20, 54}, 2.5},
                                       {Colormap::twilight, 426 / 509.0, {198, 139, 110}, 1.5},
                                       {Colormap::cool_warm, 0, {59, 76, 192}, 1e-9},
                                       {Colormap::cool_warm, 0.5, {221, 221, 221}, 1e-9},
                                       {Colormap::cool_warm, 24 / 32.0, {244, 154, 123}, 1e-9},
                                       {Colormap::cool_warm, 1, {180, 4, 38}, 1e-9}};
  for (const Published& entry : entries)
    EXPECT_LE((255 * colormap_srgb(entry.map, entry.x) - entry.color).cwiseAbs().maxCoeff(), entry.tolerance)
        << name_of(entry.map) << " at " << entry.x;
}

TEST(ColormapTest, LightIsTheDecodedColorAndOtherArgumentsAreClamped) {
  for (const Colormap map : all_maps()) {
    for (double x = 0; x <= 1; x += 0.01) {
      const Eigen::Vector3d srgb = colormap_srgb(map, x);
      EXPECT_TRUE((srgb.array() >= 0).all() && (srgb.array() <= 1).all());
      EXPECT_LT((srgb_to_linear(srgb) - colormap_linear(map, x)).norm(), 1e-6) << name_of(map);
    }
    EXPECT_EQ(colormap_srgb(map, -3), colormap_srgb(map, 0));
    EXPECT_EQ(colormap_srgb(map, INFINITY), colormap_srgb(map, 1));
    EXPECT_EQ(colormap_linear(map, nan_value), colormap_linear(map, 0));
  }
  EXPECT_NEAR(srgb_to_linear({0.5, 0, 1})[0], 0.21404114, 1e-8);
}

/// The spline is continuous at its control points: a step across one is not larger than other steps.
TEST(ColormapTest, HasNoJumps) {
  for (const Colormap map : all_maps())
    for (int i = 0; i < 4096; ++i)
      EXPECT_LT((colormap_srgb(map, (i + 1) / 4096.0) - colormap_srgb(map, i / 4096.0)).norm(), 8 / 4096.0)
          << name_of(map) << " at " << i;
}

TEST(ColormapTest, TheReferenceDifferenceIsTheOneOfSharmaWuAndDalal) {
  EXPECT_NEAR(color_difference({50, 2.6772, -79.7751}, {50, 0, -82.7485}), 2.0425, 5e-5);
  EXPECT_NEAR(color_difference({50, 2.5, 0}, {61, -5, 29}), 22.8977, 5e-5);
  EXPECT_NEAR(color_difference({90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}), 1.5381, 5e-5);
}

struct Steps {
  double least, mean, greatest;
};

/// CIEDE2000 differences between neighbours of 33 colours. `color_at` returns linear Rec.709.
template <class Color>
Steps steps_of(const Color& color_at) {
  constexpr int count = 32;
  Steps steps{INFINITY, 0, 0};
  for (int i = 0; i < count; ++i) {
    const double step = color_difference(to_lab(color_at(i / 32.0)), to_lab(color_at((i + 1) / 32.0)));
    steps.least = std::min(steps.least, step);
    steps.mean += step / count;
    steps.greatest = std::max(steps.greatest, step);
  }
  return steps;
}

// No map is designed to be uniform in this formula (viridis and its relatives are uniform in CAM02-UCS), so the steps
// differ. A plain rainbow map would exceed these limits.
constexpr double least_step = 0.4, greatest_step = 2;  // Relative to the mean step.

TEST(ColormapTest, EqualStepsLookEqual) {
  for (const Colormap map : all_maps()) {
    const Steps steps = steps_of([&](double x) { return colormap_linear(map, x); });
    EXPECT_GT(steps.least, least_step * steps.mean) << name_of(map);
    EXPECT_LT(steps.greatest, greatest_step * steps.mean) << name_of(map);
    EXPECT_GT(steps.mean, 2) << name_of(map) << " uses little of what can be told apart";
  }
  const Steps rainbow = steps_of([](double x) {
    const auto channel = [&](double middle) { return std::clamp(2 - 6 * std::abs(0.8 * x - middle), 0.0, 1.0); };
    return srgb_to_linear({std::max(channel(0), channel(1)), channel(1.0 / 3), channel(2.0 / 3)});
  });
  EXPECT_LT(rainbow.least, least_step * rainbow.mean);
  EXPECT_GT(rainbow.greatest, greatest_step * rainbow.mean);
}

TEST(ColormapTest, LightnessRisesAlongSequentialMaps) {
  for (const Colormap map : all_maps()) {
    if (map == Colormap::cool_warm || map == Colormap::twilight) continue;
    for (int i = 0; i < 256; ++i)
      EXPECT_LT(lab(map, i / 256.0)[0], lab(map, (i + 1) / 256.0)[0]) << name_of(map) << " at " << i;
  }
  for (int i = 0; i <= 100; ++i) EXPECT_NEAR(lab(Colormap::grey, i / 100.0)[0], i, 1e-3);
}

TEST(ColormapTest, DivergingAndCyclicMapsAreBalanced) {
  for (int i = 0; i < 128; ++i) {
    const double x = i / 256.0, next = (i + 1) / 256.0;
    EXPECT_LT(lab(Colormap::cool_warm, x)[0], lab(Colormap::cool_warm, next)[0]);
    EXPECT_LT(lab(Colormap::cool_warm, 1 - x)[0], lab(Colormap::cool_warm, 1 - next)[0]);
    EXPECT_NEAR(lab(Colormap::cool_warm, x)[0], lab(Colormap::cool_warm, 1 - x)[0], 5);
    EXPECT_NEAR(lab(Colormap::twilight, x)[0], lab(Colormap::twilight, 1 - x)[0], 5);
  }
  EXPECT_EQ(colormap_srgb(Colormap::twilight, 0), colormap_srgb(Colormap::twilight, 1));
  const double h = 1e-4;  // The map has no kink where it closes.
  const Eigen::Vector3d before = colormap_srgb(Colormap::twilight, 1) - colormap_srgb(Colormap::twilight, 1 - h);
  const Eigen::Vector3d after = colormap_srgb(Colormap::twilight, h) - colormap_srgb(Colormap::twilight, 0);
  EXPECT_LT((before - after).norm(), 0.05 * after.norm());
}

std::vector<double> zero_to(int last) {
  std::vector<double> values;
  for (int i = last; i >= 0; --i) values.push_back(i);
  return values;
}

RangeChoice all_values(bool logarithmic = false) { return {0, 100, logarithmic, false}; }

TEST(ValueRangeTest, PercentilesLeaveStrayValuesOut) {
  std::vector<double> values = zero_to(100);
  EXPECT_DOUBLE_EQ(choose_range(values).low, 1);
  EXPECT_DOUBLE_EQ(choose_range(values).high, 99);
  values[0] = 1e9;
  values.insert(values.end(), {nan_value, INFINITY, -INFINITY});
  EXPECT_DOUBLE_EQ(choose_range(values).high, 99);
  EXPECT_DOUBLE_EQ(choose_range(values, all_values()).high, 1e9);
  EXPECT_DOUBLE_EQ(choose_range(values, all_values()).low, 0);
}

TEST(ValueRangeTest, DegenerateDataHaveARangeAboutThem) {
  const auto expect = [](const ValueRange& range, double low, double high) {
    EXPECT_DOUBLE_EQ(range.low, low);
    EXPECT_DOUBLE_EQ(range.high, high);
  };
  expect(choose_range({}), 0, 1);
  expect(choose_range({nan_value}), 0, 1);
  expect(choose_range({0, 0, 0}), 0, 1);
  expect(choose_range({1e-320}), 0, 1);
  expect(choose_range({4, 4}), 2, 6);
  expect(choose_range({-4, -4}), -6, -2);
  expect(choose_range({4, 4 + 1e-15}), 2, 6);
  expect(choose_range({-1, 0}, all_values(true)), 1, 10);
  expect(choose_range({4}, all_values(true)), 2, 8);
  std::vector<double> mostly_zero(1000, 0.0);
  mostly_zero[7] = 5;
  expect(choose_range(mostly_zero), 0, 5);
}

TEST(ValueRangeTest, SymmetricRangesHaveZeroInTheMiddle) {
  const ValueRange range = choose_range({-1, 0, 3}, {0, 100, false, true});
  EXPECT_EQ(range.low, -3);
  EXPECT_EQ(range.high, 3);
  EXPECT_EQ(range.position(0), 0.5);
  EXPECT_EQ(choose_range({}, {0, 100, false, true}).low, -1);
}

TEST(ValueRangeTest, PositionsAndValuesAreInverse) {
  const ValueRange linear = choose_range({-2, 6}, all_values());
  const ValueRange logarithmic = choose_range({-5, 0, 0.01, 100}, all_values(true));
  EXPECT_DOUBLE_EQ(linear.position(0), 0.25);
  EXPECT_DOUBLE_EQ(logarithmic.position(1), 0.5);
  for (double x = 0; x <= 1; x += 0.125)
    for (const ValueRange& range : {linear, logarithmic}) EXPECT_NEAR(range.position(range.value(x)), x, 1e-12);
  for (const ValueRange& range : {linear, logarithmic}) {
    EXPECT_EQ(range.position(-1e9), 0);
    EXPECT_EQ(range.position(1e9), 1);
    EXPECT_EQ(range.position(nan_value), 0);
  }
}

TEST(ValueRangeTest, RefusesPercentilesThatDoNotRise) {
  EXPECT_THROW(choose_range({1}, {50, 50, false, false}), std::invalid_argument);
  EXPECT_THROW(choose_range({1}, {-1, 50, false, false}), std::invalid_argument);
  EXPECT_THROW(choose_range({1}, {0, nan_value, false, false}), std::invalid_argument);
  EXPECT_THROW(choose_range({1}, {0, 100, true, true}), std::invalid_argument);
}

}  // namespace
}  // namespace tensorray
