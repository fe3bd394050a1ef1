// The method photon_distribution: colours, places and statistics of light on a plate.

#include <fmt/format.h>

#include "tests/scenes/pictures/pictures.h"
#include "tests/scenes/small_scene.h"

namespace tensorray {
namespace {

using namespace test;

class PlatePicture : public Pictures {
 protected:
  PlatePicture() { write("scene.json", small_scene()); }
  /// Light that goes straight.
  void remove_field() const {
    write("scene.json",
          small_scene(
              R"({"generate": {"kind": "constant", "resolution": 9, "tensor": [[0, 0, 0], [0, 0, 0], [0, 0, 0]]}})"));
  }
};

TEST_F(PlatePicture, WithoutAFieldItIsNeutralAndUniform) {
  remove_field();
  for (const std::string illuminant : {"D65", "A", "blackbody 3000"}) {
    const Image image = render({"light.pattern=grid", "light.photons=40000", "receiver.size=[1.5,1.5]",
                                "light.spectrum=" + illuminant, "receiver.resolution=[64,64]"});
    double sum = 0, least = 1e9, most = 0;
    for (int y = 12; y < 52; ++y)  // Six standard deviations of the estimate away from the edge of the plate.
      for (int x = 12; x < 52; ++x)
        for (int c = 0; c < 3; ++c) {
          const double value = image.pixel(x, y)[c];
          sum += value / (40 * 40 * 3);
          least = std::min(least, value);
          most = std::max(most, value);
        }
    EXPECT_NEAR(sum, 1, 0.02) << illuminant;
    // Light starts every 0.427 pixels. The spline of the estimate leaves 2 sinc(2.34)^4 = 4e-4 of this lattice along
    // each axis, and the blur 2e-4 of that: 3e-7 from the darkest pixel to the brightest. Others are of rounding.
    EXPECT_LT((most - least) / sum, 2e-6) << illuminant;
  }
}

TEST_F(PlatePicture, WithoutWhiteBalanceItHasTheLightsColour) {
  remove_field();
  const Image image = render(
      {"light.spectrum=A", "output.white_balance=false", R"(light.wavelengths={"min":360,"max":830,"count":4})"});
  const float* rgb = image.pixel(16, 16);
  // Illuminant A, x = 0.4476, y = 0.4074, in linear Rec. 709 (IEC 61966-2-1) at Y = 1.
  const double X = 0.4476 / 0.4074, Z = (1 - 0.4476 - 0.4074) / 0.4074;
  const double red = 3.2406 * X - 1.5372 - 0.4986 * Z, green = -0.9689 * X + 1.8758 + 0.0415 * Z;
  const double blue = 0.0557 * X - 0.2040 + 1.0570 * Z;
  EXPECT_NEAR(rgb[0] / rgb[1], red / green, 3e-3);
  EXPECT_NEAR(rgb[2] / rgb[1], blue / green, 3e-3);
}

TEST_F(PlatePicture, RgbModeIsThePapers) {
  EXPECT_EQ(render({"bending.rgb=[0.1,0.2,0.3]"}).channels.size(), 3u);
  const Image grey = render({"bending.rgb=[0.2,0.2,0.2]"});  // Equal flexibilities give no colour at all.
  for (int i = 0; i < 32 * 32; ++i) {
    const float* rgb = grey.pixel(i % 32, i / 32);
    ASSERT_NEAR(rgb[0], rgb[1], 1e-5);
    ASSERT_NEAR(rgb[0], rgb[2], 1e-5);
  }
}

TEST_F(PlatePicture, IsSeenAlongTheLightAnywhere) {
  remove_field();
  const auto column_of_light = [&](Settings receiver) {
    receiver.push_back(R"(light.aperture={"center":[0.5,0,0],"size":[0.5,0.5]})");
    const Image image = render(receiver);
    double sum = 0, moment = 0;
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 32; ++x) {
        sum += image.pixel(x, y)[1];
        moment += image.pixel(x, y)[1] * (x + 0.5);
      }
    return moment / sum;
  };
  const std::string size = "receiver.size=[2,2]";
  EXPECT_NEAR(column_of_light({size}), 24, 0.2);
  EXPECT_NEAR(column_of_light({size, "receiver.normal=[0,0,-1]"}), 24, 0.2);  // The opposite normal.
  EXPECT_NEAR(column_of_light({size, "receiver.center=[0,0,5]"}), 24, 0.2);   // A plate before the volume.
  EXPECT_NEAR(column_of_light({size, "receiver.center=[0,0,0]"}), 24, 0.2);   // A plate in the volume.
  EXPECT_NEAR(column_of_light({"receiver.size=[4000,4000]", "receiver.distance=1e4"}), 16, 0.2);
}

/// Light is counted where it starts and where it ends.
TEST_F(PlatePicture, BalancesWithEveryMethodAndEnd) {
  const auto sum_of_ends = [](const nlohmann::json& counts) {
    double sum = counts["deposited"].get<double>() + counts["missed"].get<double>() + counts.value("side", 0.0);
    for (const auto& [reason, stopped] : counts["stopped"].items()) sum += stopped.get<double>();
    return sum;
  };
  const std::vector<Settings> cases{{"integrator.density.kind=mesh"},
                                    {"integrator.density.kind=mesh", "integrator.side_light=false"},
                                    {"integrator.density.kind=gaussian", "integrator.side_light=false"},
                                    {"integrator.density.kind=histogram", "bending.max_steps=20"},
                                    {"integrator.type=lens"}};
  for (Settings settings : cases) {
    settings.push_back("field.scale=20");
    render(settings);
    const double emitted = statistics_["photons"]["emitted"].get<double>();
    EXPECT_GT(emitted, 0) << settings[0];
    EXPECT_EQ(sum_of_ends(statistics_["photons"]), emitted) << settings[0];
    for (const auto& channel : statistics_["channels"])
      EXPECT_EQ(sum_of_ends(channel["rays"]), channel["rays"]["emitted"].get<double>()) << settings[0];
    if (!statistics_.contains("power")) continue;
    const double power = statistics_["power"]["emitted"].get<double>();
    EXPECT_NEAR(sum_of_ends(statistics_["power"]), power, 1e-6 * power) << settings[0];
  }
}

TEST_F(PlatePicture, HasStatisticsThatBalance) {
  render({"field.scale=20"});
  const nlohmann::json& stats = statistics_;
  const auto count = [&](const char* key) { return stats["photons"][key].get<std::uint64_t>(); };
  EXPECT_EQ(count("emitted"), 4 * stats["positions"].get<std::uint64_t>());
  std::uint64_t ended = count("deposited") + count("missed");
  for (const auto& [reason, stopped] : stats["photons"]["stopped"].items()) ended += stopped.get<std::uint64_t>();
  EXPECT_EQ(ended, count("emitted"));
  EXPECT_GT(count("deposited"), 0u);
  ASSERT_EQ(stats["channels"].size(), 4u);
  for (const auto& channel : stats["channels"]) {
    EXPECT_EQ(channel["rays"]["emitted"], stats["positions"]);
    EXPECT_GT(channel["ray_power"], 0);
  }
  EXPECT_NEAR(stats["power"]["emitted"], 4, 1e-3);  // Irradiance 1 times the area of the beam's cross section.
  for (const char* key : {"ray_steps", "tensor_samples", "peak_memory_bytes"}) EXPECT_GT(stats[key], 0) << key;
  for (const char* phase : {"load", "trace", "density", "color", "write"})
    EXPECT_GE(stats["seconds"][phase], 0) << phase;
}

}  // namespace
}  // namespace tensorray
