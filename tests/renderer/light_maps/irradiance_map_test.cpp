#include <gtest/gtest.h>

#include "renderer/light_maps/photon_map.h"

namespace tensorray {
namespace {

IrradianceMap map_of(const std::vector<float>& irradiance, int width, int height) {
  IrradianceMap map;
  map.plate.size = {2, 1};
  map.plate.resolution = {width, height};
  map.bands = 1;
  map.irradiance = irradiance;
  return map;
}

double irradiance_at(const IrradianceMap& map, double x, double y) {
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(1);
  add_irradiance(map, map.plate.to_world({x, y}), sum);
  return sum[0];
}

TEST(IrradianceMapTest, AUniformPlateIsUniformToItsEdge) {
  for (const auto& [width, height] : {std::pair(8, 4), std::pair(1, 1), std::pair(1, 5)}) {
    const IrradianceMap map = map_of(std::vector<float>(static_cast<std::size_t>(width * height), 3), width, height);
    for (double x = 0; x <= width; x += 0.125)
      for (double y = 0; y <= height; y += 0.125) EXPECT_NEAR(irradiance_at(map, x, y), 3, 1e-12) << x << " " << y;
    EXPECT_EQ(irradiance_at(map, -0.1, height / 2.0) + irradiance_at(map, width + 0.1, height / 2.0), 0);
  }
}

TEST(IrradianceMapTest, IsLinearBetweenPixelsAndEvenBeyondTheOutermostCentres) {
  const IrradianceMap map = map_of({1, 2, 4}, 3, 1);
  for (const auto& [x, value] : {std::pair(0.0, 1.0), {0.5, 1.0}, {0.75, 1.25}, {1.5, 2.0}, {2.25, 3.5}, {3.0, 4.0}})
    EXPECT_NEAR(irradiance_at(map, x, 0.2), value, 1e-6) << x;
}

}  // namespace
}  // namespace tensorray
