// Light that leaves a volume by its side faces (integrator.side_light).

#include <cmath>
#include <numeric>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/process/progress.h"
#include "integrators/methods/read_scene.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {
namespace {

using ::testing::HasSubstr, ::testing::IsEmpty;

/// Light of one colour on a plate that catches all of it. @param s  Its flexibility. @param side_light  Null: default.
Render light_of(const std::string& density, double s, const Json& side_light) {
  Json json{{"field",
             {{"generate", {{"kind", "constant"}, {"resolution", 9}, {"tensor", {{0, 0, 1}, {0, 0, 0}, {1, 0, 0}}}}},
              {"eigenvalues", "raw"},
              {"scale", 1}}},
            {"bending", {{"rgb", {s, s, s}}}},
            {"light", {{"direction", {0, 0, -1}}, {"photons", 60000}}},
            {"receiver", {{"distance", 0.1}, {"size", {8, 8}}, {"resolution", {256, 256}}}},
            {"integrator", {{"type", "photon_distribution"}, {"density", {{"kind", density}}}}}};
  if (!side_light.is_null()) json["integrator"]["side_light"] = side_light;
  return render(load_scene(read_scene_json(json, "scene.json"), Progress()), Progress());
}

/// Power by end, as a part of what is emitted.
double share(const Render& render, RayEnd which) {
  double power = 0, all = 0, emitted = render.statistics.beam_power;
  for (std::size_t channel = 0; channel < render.statistics.ends.size(); ++channel)
    for (int end = 0; end < ray_end_count; ++end) {
      const double each = render.statistics.power.empty() ? static_cast<double>(render.statistics.ends[channel][end])
                                                          : render.statistics.power[channel][end];
      all += each;
      if (end == static_cast<int>(which)) power += each;
    }
  for (const std::uint64_t count : render.statistics.emitted)
    emitted += render.statistics.power.empty() ? static_cast<double>(count) : 0;
  EXPECT_NEAR(all / emitted, 1, 1e-6);
  return power / emitted;
}

/// In this field V = (sin θ, 0, −cos θ) turns by θ' = −s cos 2θ. All light is displaced alike, by x on its way from
/// z = 1 to z = −1, and the part |x| / 2 leaves by the sides.
double displaced_part(double s) {
  double angle = 0, x = 0, z = 1;
  for (const double h = 1e-5; z > -1; x += h * std::sin(angle), z -= h * std::cos(angle))
    angle -= h * s * std::cos(2 * angle);
  return std::abs(x) / 2;
}

/// What is left out is what the plate lacks: no power is lost, with photons and with the mesh.
TEST(SideLight, IsLeftOutAndCounted) {
  const double s = 0.3;
  for (const std::string density : {"mesh", "histogram"}) {
    const Render with = light_of(density, s, true), without = light_of(density, s, false);
    const double side = share(without, RayEnd::side);
    EXPECT_NEAR(side, displaced_part(s), 0.01) << density;
    EXPECT_NEAR(share(with, RayEnd::plate), 1, 1e-3) << density;
    EXPECT_NEAR(share(without, RayEnd::plate), 1 - side, 1e-3) << density;
    const double lit_with = std::accumulate(with.linear.pixels.begin(), with.linear.pixels.end(), 0.0);
    const double lit_without = std::accumulate(without.linear.pixels.begin(), without.linear.pixels.end(), 0.0);
    // The volume is 64 pixels wide; the mesh knows the edge of the light that is left to one of them.
    EXPECT_NEAR(lit_without / lit_with, 1 - side, 1.0 / 64) << density;
    ASSERT_EQ(without.warnings.size(), 1u) << density;
    EXPECT_THAT(without.warnings[0], HasSubstr("side faces")) << density;
  }
}

}  // namespace
}  // namespace tensorray
