// Photons of area lights, and their weights beside the other techniques that find this light.

#include "base/constants.h"
#include "base/geometry/box.h"
#include "renderer/light_maps/photon_tracer.h"
#include "tests/renderer/lit_world.h"

namespace tensorray {
namespace {

constexpr int bands = 2;
constexpr double half_size = 1, half_height = 0.3;

/// A flat box about the plane z = 0. Light that crosses the plane turns about z by an angle for each band, and its
/// slope is multiplied by `steeper`. Photons keep their power, so that radiance changes by cos⁴ θ / (steeper² cos⁴ θ').
class BendingPlane : public BendingRegion {
 public:
  explicit BendingPlane(double angle, double steeper = 1) : angle_(angle), steeper_(steeper) {}

  double entry(const Vector3d& origin, const Vector3d& direction) const override {
    return box_entry({half_size, half_size, half_height}, origin, direction);
  }

  void trace_radiance(std::vector<BentRay>& rays) const override {
    for (BentRay& ray : rays) bend(-1, ray);
  }

  void trace_importance(std::vector<BentRay>& rays) const override {
    for (BentRay& ray : rays) bend(1, ray);
  }

 private:
  /// @param sign  1: light; −1: followed back.
  void bend(double sign, BentRay& ray) const {
    ray.arrives = true;
    ray.jacobian = 1;
    const Vector3d crossing = ray.position - ray.position.z() / ray.direction.z() * ray.direction;
    if (!(crossing.head<2>().cwiseAbs().maxCoeff() < half_size)) return;  // Through the sides.
    const double before = ray.direction.z();
    const double slope = sign > 0 ? steeper_ : 1 / steeper_;
    Vector3d turned = Eigen::AngleAxisd(sign * angle_ * (1 + ray.band), Vector3d::UnitZ()) * ray.direction;
    turned.head<2>() *= slope;
    ray.direction = turned.normalized();
    ray.position = crossing;
    const double volume = slope * slope * std::pow(ray.direction.z() / before, 4);  // Of phase space, by that before.
    ray.jacobian = sign > 0 ? 1 / volume : volume;
    if (sign < 0) ray.radiance_scale = ray.jacobian;
  }

  double angle_, steeper_;
};

const std::vector<Vector3d> region_corners =
    corners_of({Vector3d(-half_size, -half_size, -half_height), Vector3d(half_size, half_size, half_height)});

AreaLight lamp_at(const Vector3d& place, const Vector2d& size) {
  return {rectangle_mesh(place, {1, 0, 0}, {0, -1, 0}, size), {5, 7}};
}

const AreaLight outer_lamp = lamp_at({1.8, 0.2, 3}, {1.2, 0.9}), inner_lamp = lamp_at({0.2, 0.2, 0.2}, {0.3, 0.2});

/// A floor below the plane, a lamp above it, and the lamp's photons on the floor.
struct Stage : FloorWorld {
  Stage(const BendingRegion& region, const MaterialSettings& floor, std::uint64_t per_pass, int passes,
        const AreaLight& light)
      : FloorWorld(two_bands(), region, floor, 0.6, {light}) {
    scene.bands_per_view = scene.bands_per_bounce = bands;
    photons = trace_photons(region, region_corners, surfaces, light_list, photon_settings(per_pass, passes, 0.12), {});
  }

  /// Radiance of a point of the floor in the second band. @param with_photons  Whether photons are a technique, too.
  Mean radiance(DirectLight direct, bool with_photons) {
    ShadingSettings settings;
    settings.direct = direct;
    settings.max_depth = 1;
    scene.photons = with_photons ? &photons : nullptr;
    return seen(scene, settings, {0.4, -2.9, -0.6}, {0.3, -0.1, -0.8}, 60000, 1);
  }

  PhotonMaps photons;
};

/// Of a diffuse floor, all photons together, without weights.
double by_photons_alone(const Stage& stage) {
  const auto point = *stage.surfaces.intersect({0.3, -0.1, -0.5}, {0, 0, -1});
  return 0.6 / pi * photon_irradiance(stage.photons, point, 1).mean();
}

struct LampCase {
  const char* name;
  MaterialSettings floor;
  double steeper;  ///< See BendingPlane.
  AreaLight light;
};

/// Aim and material find the light with each other's weights or alone; each with photons and without. There are so few
/// photons in each pass that no technique has all the weight. Their noise is common to all samples: without weights 7%
/// of the light (by seeds), with them less. Photons of a lamp within the region start in all directions, as it shines.
TEST(AreaPhotonsTest, EverySubsetOfTechniquesHasTheSameMean) {
  Principled glossy;
  glossy.roughness = 0.3;
  for (const auto& [name, floor, steeper, light] : {LampCase{"turned", Diffuse{}, 1, outer_lamp},
                                                    {"steeper", Diffuse{}, 1.6, outer_lamp},
                                                    {"steeper, glossy", glossy, 1.6, outer_lamp},
                                                    {"lamp within", Diffuse{}, 1.3, inner_lamp}}) {
    SCOPED_TRACE(name);
    const BendingPlane plane(0.15, steeper), wrong(-0.15, 1 / steeper);
    Stage stage(plane, floor, 300, 1024, light);
    const Mean truth = stage.radiance(DirectLight::both, false);
    EXPECT_LT(truth.error(), 0.03 * truth.mean());
    for (const DirectLight direct : {DirectLight::both, DirectLight::lights, DirectLight::material})
      for (const bool with_photons : {false, true}) {
        const Mean mean = stage.radiance(direct, with_photons);
        const double noise = with_photons ? 0.05 * truth.mean() : 0;
        EXPECT_NEAR(mean.mean(), truth.mean(), 4.5 * std::hypot(mean.error(), truth.error()) + noise)
            << static_cast<int>(direct) << with_photons;
      }
    if (std::holds_alternative<Diffuse>(floor)) {
      const double alone = by_photons_alone(Stage(plane, floor, 30000, 32, light));
      EXPECT_NEAR(alone, truth.mean(), 4.5 * truth.error() + 0.06 * truth.mean());
    }
    if (steeper == 1) continue;
    // Photons that bend the wrong way do not add up with rays that bend the right way.
    stage.photons = Stage(wrong, floor, 300, 1024, light).photons;
    const double difference = stage.radiance(DirectLight::both, true).mean() - truth.mean();
    EXPECT_GT(std::abs(difference), 0.15 * truth.mean());
  }
}

TEST(AreaPhotonsTest, PhotonsRemoveNoiseWhereAimMisses) {
  const BendingPlane plane(0.8);
  Stage stage(plane, Diffuse{}, 30000, 32, outer_lamp);
  const Mean without = stage.radiance(DirectLight::both, false), with = stage.radiance(DirectLight::both, true);
  EXPECT_NEAR(with.mean(), without.mean(), 4.5 * without.error() + 0.06 * without.mean());
  EXPECT_LT(with.error(), 0.3 * without.error());
}

/// All light of the lamp that meets the box lands on a large floor: the lamp is small, so that its light is that of its
/// middle, radiance × area × ∫ cos θ dω.
TEST(AreaPhotonsTest, PowerIsThatOfTheLampTowardsTheVolume) {
  const double height = 4, side = 0.02;
  const std::vector<Light> lights{lamp_at({0, 0, height}, {side, side})};
  const SurfaceScene floor({surface_of(rectangle_mesh({0, 0, -2}, {1, 0, 0}, {0, 1, 0}, {400, 400}))});
  const PhotonMaps photons =
      trace_photons(BendingPlane(0.3), region_corners, floor, lights, photon_settings(40000), {});
  double power = 0;
  for (const Photon& photon : photons.passes[0].photons()) power += photon.band == 1 ? photon.power : 0;
  const double h = height - half_height, root = std::sqrt(half_size * half_size + h * h);
  const double projected = 4 * half_size / root * std::atan(half_size / root);  // Four quarters of the upper face.
  EXPECT_NEAR(power, 7 * side * side * projected, 0.02 * power);
  const auto& [emitted, ends] = photons.counts[0];
  EXPECT_EQ(emitted, 40000u * bands);
  EXPECT_EQ(ends[0] + ends[1] + ends[2] + ends[3], emitted);
  ASSERT_TRUE(photons.areas[0]);
  EXPECT_EQ(photons.areas[0]->count, 40000);
  EXPECT_DOUBLE_EQ(PhotonEmitter(inner_lamp, region_corners, {}).power(), pi * 0.3 * 0.2);
}

}  // namespace
}  // namespace tensorray
