// How bright scene-linear light is shown: the view and the exposure that are chosen where the scene names none.

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/process/progress.h"
#include "integrators/methods/read_scene.h"
#include "scenes/outputs/picture_outputs.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {
namespace {

Scene scene_of(const std::string& method, const Json& output) {
  const Json json{{"field", {{"generate", {{"kind", "helix"}, {"resolution", 5}}}, {"scale", 0.6}}},
                  {"integrator", {{"type", method}}},
                  {"output", output}};
  return load_scene(read_scene_json(json, "scene.json"), Progress());
}

/// Pixels of these values, a hundred of each.
Render light_of(const std::vector<float>& values) {
  Render render;
  render.linear = Image(100, static_cast<int>(values.size()), {"R", "G", "B"});
  for (std::size_t i = 0; i < render.linear.pixels.size(); ++i) render.linear.pixels[i] = values[i / 300];
  return render;
}

double srgb(double linear) { return 1.055 * std::pow(linear, 1 / 2.4) - 0.055; }

TEST(Exposure, UndisturbedLightIsLightGreyAndBrightLightIsBelowWhite) {
  const Scene scene = scene_of("photon_distribution", Json::object());
  const std::vector<float> light{0, 0.25f, 1, 2, 6};
  const Image shown = display_image(scene, light_of(light), true);
  for (std::size_t i = 1; i < light.size(); ++i)
    EXPECT_NEAR(shown.pixels[300 * i], srgb(1 - std::exp(-light[i])), 1e-3) << light[i];
}

TEST(Exposure, IsChosenWhereLightIsDarkOrMuchIsBright) {
  const Scene scene = scene_of("photon_distribution", Json::object());
  EXPECT_EQ(display_exposure(scene, light_of({0, 0, 0})), 0);
  EXPECT_EQ(display_exposure(scene, light_of({0, 0.5f, 1})), 0);
  EXPECT_EQ(display_exposure(scene, light_of({1, 8})), 0);
  EXPECT_NEAR(display_exposure(scene, light_of({0, 0.1f, 0.25f})), 2, 1e-12);
  EXPECT_NEAR(display_exposure(scene, light_of({1, 32})), -2, 1e-12);
}

TEST(Exposure, OfOtherViewsHasTheBrightestHundredthBelowWhite) {
  const Scene scene = scene_of("photon_distribution", {{"view", "Un-tone-mapped"}});
  EXPECT_NEAR(display_exposure(scene, light_of({1, 3.6f})), -2, 1e-6);
}

TEST(Exposure, IsTheScenesIfItNamesOne) {
  EXPECT_EQ(display_exposure(scene_of("photon_distribution", {{"exposure", -1.5}}), light_of({1, 32})), -1.5);
}

}  // namespace
}  // namespace tensorray
