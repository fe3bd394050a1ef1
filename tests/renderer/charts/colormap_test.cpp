#include "renderer/charts/colormap.h"

#include <numeric>

#include "tests/names.h"

namespace tensorray {
namespace {

/// Compares entries of the published table that lie between the control points.
/// @param name  Of the map. @param last  The number of the last entry. @param colors  Numbers of entries, and their
/// values from 0 to 255.
void expect_published(const char* name, Colormap map, int last, double tolerance,
                      const std::vector<std::pair<int, Vector3d>>& colors) {
  for (const auto& [entry, color] : colors)
    EXPECT_LE((255 * colormap_srgb(map, 1.0 * entry / last) - color).cwiseAbs().maxCoeff(), tolerance)
        << name << " at " << entry;
}

TEST(ColormapTest, AgreesWithThePublishedTables) {
  expect_published("viridis", Colormap::viridis, 255, 1.5,
                   {{3, {69, 5, 89}}, {42, {68, 57, 131}}, {128, {33, 145, 140}}, {213, {144, 215, 67}}});
  expect_published("magma", Colormap::magma, 255, 1.5,
                   {{42, {44, 17, 95}}, {128, {183, 55, 121}}, {252, {252, 247, 185}}});
  expect_published("inferno", Colormap::inferno, 255, 1.5,
                   {{42, {50, 10, 94}}, {213, {251, 182, 26}}, {252, {248, 251, 154}}});
  expect_published("plasma", Colormap::plasma, 255, 1.5,
                   {{3, {22, 7, 138}}, {128, {204, 71, 120}}, {213, {253, 180, 47}}});
  expect_published("cividis", Colormap::cividis, 255, 3.5,
                   {{42, {42, 63, 109}}, {128, {125, 124, 120}}, {213, {210, 192, 96}}});
  expect_published("twilight", Colormap::twilight, 509, 1.5, {{84, {124, 162, 194}}, {426, {198, 139, 110}}});
  expect_published("twilight", Colormap::twilight, 509, 2.5, {{255, {47, 20, 54}}});  // A corner.
  expect_published("cool_warm", Colormap::cool_warm, 32, 1e-9,
                   {{0, {59, 76, 192}}, {16, {221, 221, 221}}, {24, {244, 154, 123}}, {32, {180, 4, 38}}});
}

TEST(ColormapTest, LightIsTheDecodedColorAndOtherArgumentsAreClamped) {
  for (int i = 0; i <= static_cast<int>(Colormap::grey); ++i) {
    SCOPED_TRACE(i);
    const auto map = static_cast<Colormap>(i);
    for (double x = 0; x <= 1; x += 0.01) {
      const Vector3d srgb = colormap_srgb(map, x);
      EXPECT_TRUE((srgb.array() >= 0).all() && (srgb.array() <= 1).all());
      EXPECT_LT((srgb_to_linear(srgb) - colormap_linear(map, x)).norm(), 1e-6);
    }
    EXPECT_EQ(colormap_srgb(map, -3), colormap_srgb(map, 0));
    EXPECT_EQ(colormap_srgb(map, INFINITY), colormap_srgb(map, 1));
    EXPECT_EQ(colormap_linear(map, NAN), colormap_linear(map, 0));
  }
  EXPECT_NEAR(srgb_to_linear({0.5, 0, 1})[0], 0.21404114, 1e-8);
}

RangeChoice all_values(bool logarithmic = false) { return {0, 100, logarithmic, false}; }

void expect_range(const ValueRange& range, double low, double high) {
  EXPECT_DOUBLE_EQ(range.low, low);
  EXPECT_DOUBLE_EQ(range.high, high);
}

TEST(ValueRangeTest, PercentilesLeaveStrayValuesOut) {
  std::vector<double> values(101);
  std::iota(values.rbegin(), values.rend(), 0.0);
  expect_range(choose_range(values), 1, 99);
  values[0] = 1e9;
  values.insert(values.end(), {NAN, INFINITY, -INFINITY});
  expect_range(choose_range(values), 1, 99);
  expect_range(choose_range(values, all_values()), 0, 1e9);
}

TEST(ValueRangeTest, DegenerateDataHaveARangeAboutThem) {
  expect_range(choose_range({}), 0, 1);
  expect_range(choose_range({NAN}), 0, 1);
  expect_range(choose_range({0, 0, 0}), 0, 1);
  expect_range(choose_range({1e-320}), 0, 1);
  expect_range(choose_range({4, 4}), 2, 6);
  expect_range(choose_range({-4, -4}), -6, -2);
  expect_range(choose_range({4, 4 + 1e-15}), 2, 6);
  expect_range(choose_range({-1, 0}, all_values(true)), 1, 10);
  expect_range(choose_range({4}, all_values(true)), 2, 8);
  std::vector<double> mostly_zero(1000, 0.0);
  mostly_zero[7] = 5;
  expect_range(choose_range(mostly_zero), 0, 5);
}

TEST(ValueRangeTest, SymmetricRangesHaveZeroInTheMiddle) {
  const ValueRange range = choose_range({-1, 0, 3}, {0, 100, false, true});
  expect_range(range, -3, 3);
  EXPECT_EQ(range.position(0), 0.5);
  expect_range(choose_range({}, {0, 100, false, true}), -1, 1);
}

TEST(ValueRangeTest, PositionsAndValuesAreInverse) {
  const ValueRange linear = choose_range({-2, 6}, all_values());
  const ValueRange logarithmic = choose_range({-5, 0, 0.01, 100}, all_values(true));
  EXPECT_DOUBLE_EQ(linear.position(0), 0.25);
  EXPECT_DOUBLE_EQ(logarithmic.position(1), 0.5);
  for (const ValueRange& range : {linear, logarithmic}) {
    for (double x = 0; x <= 1; x += 0.125) EXPECT_NEAR(range.position(range.value(x)), x, 1e-12);
    EXPECT_EQ(range.position(-1e9), 0);
    EXPECT_EQ(range.position(1e9), 1);
    EXPECT_EQ(range.position(NAN), 0);
  }
}

}  // namespace
}  // namespace tensorray
