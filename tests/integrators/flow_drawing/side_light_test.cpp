// Light that leaves the volume by its side faces, which a flow map may leave out (FlowSettings::side_light).

#include <cmath>

#include <gtest/gtest.h>

#include "tests/integrators/flow_support.h"

namespace tensorray {
namespace {

using namespace test;

/// Turns all light alike, to the right and upwards.
Eigen::Matrix3d turning(const Eigen::Vector3d&) {
  Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();
  tensor(0, 2) = tensor(2, 0) = -0.3;
  tensor(1, 2) = tensor(2, 1) = -0.15;
  return tensor;
}

/// In a constant field all light has the same path. If it is displaced by (x, y) through a cube of edge 2, the part
/// (1 − |x| / 2) (1 − |y| / 2) leaves by the face behind, and the rest by the sides.
TEST(SideLight, IsThatWhichIsDisplacedBeyondTheFaceBehind) {
  const FlowBench bench = make_bench(turning, plate_at(1.2, 8, 1024));
  for (const double flexibility : {0.3, 1.0}) {
    const FlowBench at_face = make_bench(turning, plate_at(1, 2, 16));
    const Eigen::Vector3d way =
        trace_one(at_face.field, at_face.geometry, {}, {0, 0, 2}, {0, 0, -1}, flexibility).position;
    const double expected = 1 - (1 - std::abs(way.x()) / 2) * (1 - std::abs(way.y()) / 2);
    ASSERT_GT(expected, 0.1);
    FlowSettings settings = single(flexibility);
    const Caustic with = caustic_of(bench, map_of(bench, settings));
    settings.side_light = false;
    const Caustic without = caustic_of(bench, map_of(bench, settings));
    EXPECT_EQ(power_of(with, RayEnd::side), 0);
    EXPECT_NEAR(power_of(without, RayEnd::side), expected, 0.005) << flexibility;
    EXPECT_NEAR(power_of(without, RayEnd::plate), 1 - expected, 0.005) << flexibility;
    EXPECT_NEAR(all_power(without), 1, 1e-9);
  }
}

TEST(SideLight, OfARangeIsLeftOutAtEachWavelength) {
  const FlowBench bench = make_bench(turning, plate_at(1.2, 8, 256));
  FlowSettings settings = range(0, 1);
  settings.side_light = false;
  const FlowMap map = map_of(bench, settings);
  double last = -1;
  for (std::size_t sample = 0; sample < map.wavelengths; sample += 8) {  // Light bends more and more.
    CausticBand band;
    band.sample = static_cast<double>(sample);
    const double side = power_of(caustic_of(bench, map, {band}), RayEnd::side);
    EXPECT_GT(side, last) << sample;
    last = side;
  }
}

}  // namespace
}  // namespace tensorray
