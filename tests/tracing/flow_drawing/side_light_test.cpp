// Light that leaves the volume by its side faces, which a flow map may leave out (FlowSettings::side_light). Its closed
// form is in tests/scenes/side_light_test.cpp.

#include <gtest/gtest.h>

#include "tests/tracing/flow_support.h"

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
