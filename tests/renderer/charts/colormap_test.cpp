#include "renderer/charts/colormap.h"

#include <limits>

#include "tests/names.h"

namespace tensorray {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

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

}  // namespace
}  // namespace tensorray
