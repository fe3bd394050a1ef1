#include "renderer/light_maps/photon_tracer.h"

#include <numeric>
#include <tuple>

#include <tbb/global_control.h>

#include "base/constants.h"
#include "base/geometry/box.h"
#include "base/process/job.h"
#include "renderer/light_maps/photon_map.h"
#include "renderer/sampling/random.h"
#include "tests/renderer/lit_world.h"

namespace tensorray {
namespace {

constexpr int traced_bands = 2;

/// A floor at `height`, of a size, and perhaps a roof above everything.
SurfaceScene floor_at(double height, double size, bool roof = false) {
  std::vector<ShadedSurface> surfaces{surface_of(rectangle_mesh({0, 0, height}, {1, 0, 0}, {0, 1, 0}, {size, size}))};
  if (roof) surfaces.push_back(surface_of(rectangle_mesh({0.25, 0, 0.8}, {1, 0, 0}, {0, 1, 0}, {0.5, 4})));
  return SurfaceScene(std::move(surfaces));
}

DirectionalLight sun(const Vector3d& direction, double angle = 0) { return {direction, {2, 3}, angle}; }

PhotonMaps traced(const BendingRegion& region, const SurfaceScene& surfaces, const std::vector<Light>& lights,
                  const PhotonTracerSettings& settings, const Progress& progress = {}) {
  return trace_photons(region, corners_of({Vector3d::Constant(-0.5), Vector3d::Constant(0.5)}), surfaces, lights,
                       settings, progress);
}

/// The part of the photons that end there.
double part_of(const PhotonCounts& counts, PhotonEnd end) {
  return static_cast<double>(counts.ends[static_cast<std::size_t>(end)]) / static_cast<double>(counts.emitted);
}

SurfaceHit floor_point(const SurfaceScene& surfaces, double x, double y) {
  return *surfaces.intersect({x, y, 0.49}, {0, 0, -1});
}

double power_in(const PhotonMaps& photons, int band) {
  double sum = 0;
  for (const PhotonMap& pass : photons.passes)
    for (const Photon& photon : pass.photons())
      if (photon.band == band) sum += photon.power;
  return sum / static_cast<double>(photons.passes.size());
}

TEST(PhotonTracerTest, TheSunsPowerIsThatOfTheSilhouette) {
  const SurfaceScene floor = floor_at(-0.8, 40);
  const Vector3d direction = Vector3d(0.4, 0.3, -1).normalized();
  const double silhouette = direction.cwiseAbs().sum();
  const PhotonMaps photons = traced(TurningCube(0, 0.5), floor, {sun(3 * direction)}, photon_settings(1000, 2));
  EXPECT_EQ(photons.counts, std::vector<PhotonCounts>(2, {1000 * traced_bands, {0, 1000 * traced_bands, 0, 0}}));
  EXPECT_NEAR(power_in(photons, 0), 0.5 * 2 * silhouette, 1e-6);
  EXPECT_NEAR(power_in(photons, 1), 0.5 * 3 * silhouette, 1e-6);
}

/// A band, a surface or a light that is not there would be an index beyond all memory.
TEST(PhotonTracerTest, KeptPhotonsThatAreNoneAreRefused) {
  const SurfaceScene floor = floor_at(-0.8, 40);
  PhotonTracerSettings settings = photon_settings(100);
  const auto trace = [&](Results results) {
    Job job({}, std::move(results));
    job.interval = 1e-9;
    job.is_shard = true;  // Checkpoints keep only what took long.
    settings.job = &job;
    traced(TurningCube(), floor, {sun({0.4, 0.3, -1})}, settings);
    return job.results();
  };
  const Results kept = trace({});
  ASSERT_EQ(kept.size(), 1u);
  constexpr std::size_t first = sizeof(std::size_t);  // How many photons the first chunk has stands before them.
  const auto trace_with = [&](const auto& change) {
    std::string bytes = *kept.begin()->second;
    Photon photon;
    std::memcpy(static_cast<void*>(&photon), &bytes[first], sizeof photon);
    change(photon);
    std::memcpy(&bytes[first], &photon, sizeof photon);
    trace({{kept.begin()->first, std::make_shared<const std::string>(bytes)}});
  };
  EXPECT_NO_THROW(trace_with([](Photon&) {}));
  for (const int band : {-1, traced_bands})
    EXPECT_THROW(trace_with([&](Photon& photon) { photon.band = band; }), DamagedArchive) << band;
  EXPECT_THROW(trace_with([](Photon& photon) { photon.surface = 1; }), DamagedArchive);
  EXPECT_THROW(trace_with([](Photon& photon) { photon.light = 1; }), DamagedArchive);
}

TEST(PhotonTracerTest, IsCancelledBetweenPhotons) {
  struct CancellingCube : TurningCube {
    void trace_importance(std::vector<BentRay>& rays) const override {
      TurningCube::trace_importance(rays);
      progress.cancelled = ++positions == 10;
    }
    mutable int positions = 0;
    mutable Progress progress;
  };
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const CancellingCube cube;
  EXPECT_THROW(traced(cube, floor_at(-0.8, 4), {sun({0, 0, -1})}, photon_settings(4000), cube.progress), Cancelled);
  EXPECT_EQ(cube.positions, 10);
}

/// A roof is above half of the cube, which loses one of two bands. The floor is behind a quarter of the cube.
TEST(PhotonTracerTest, EveryPhotonEnds) {
  TurningCube cube;
  cube.lost_band = 1;
  const PhotonMaps photons = traced(cube, floor_at(-0.8, 0.5, true), {sun({0, 0, -1})}, photon_settings(4000, 3));
  ASSERT_EQ(photons.counts.size(), 3u);
  for (const PhotonCounts& counts : photons.counts) {
    EXPECT_EQ(counts.emitted, 4000u * traced_bands);
    EXPECT_EQ(std::accumulate(counts.ends.begin(), counts.ends.end(), std::uint64_t{0}), counts.emitted);
    EXPECT_NEAR(part_of(counts, PhotonEnd::before), 0.5, 0.02);
    EXPECT_NEAR(part_of(counts, PhotonEnd::stopped), 0.5 / 2, 0.01);
    EXPECT_NEAR(part_of(counts, PhotonEnd::landed), 0.5 / 2 * 0.25, 0.01);
    EXPECT_NEAR(part_of(counts, PhotonEnd::escaped), 0.5 / 2 * 0.75, 0.01);
  }
  const PhotonMaps open = traced(TurningCube(), floor_at(-0.8, 0.5), {sun({0, 0, -1})}, photon_settings(4000));
  EXPECT_NEAR(part_of(open.counts[0], PhotonEnd::landed), 0.25, 0.01);
  EXPECT_NEAR(part_of(open.counts[0], PhotonEnd::escaped), 0.75, 0.01);
}

TEST(PhotonTracerTest, StraightLightHasItsClosedForm) {
  const Vector3d slanted(0.2, -0.1, -1);
  const PointLight point{{0.3, 0.2, 2}, {5, 7}};
  for (const double height : {-0.8, 0.1}) {
    const SurfaceScene floor = floor_at(height, 40);
    const SurfaceHit at = floor_point(floor, 0.05, -0.08);
    const Vector3d way = at.position - point.position;
    const std::vector<std::tuple<const char*, Light, double>> cases{
        {"sun", sun({0, 0, -1}), 3},
        {"slanted", sun(slanted), 3 / slanted.norm()},
        {"disk", sun(slanted, 0.1), 3 / slanted.norm()},
        {"point", point, 7 * -way.z() / std::pow(way.norm(), 3)}};
    for (const auto& [name, light, expected] : cases) {
      const PhotonMaps photons = traced(TurningCube(), floor, {light}, photon_settings(4000, 32, 0.1));
      const Mean mean = photon_irradiance(photons, at, 1);
      EXPECT_NEAR(mean.mean(), expected, 5 * mean.error()) << name << " " << height;
      EXPECT_LT(mean.error(), 0.04 * expected) << name << " " << height;
    }
  }
}

TEST(PhotonTracerTest, PlatesKeepTheirLightAtTheirEdges) {
  const SurfaceScene floor = floor_at(-0.8, 0.5);
  PhotonTracerSettings settings = photon_settings(3000, 4, 0.12);
  const auto mean_on_plate = [&] {
    const PhotonMaps photons = traced(TurningCube(), floor, {sun({0, 0, -1})}, settings);
    Mean mean;
    for (int i = 0; i < 1600; ++i)
      mean.add(photon_irradiance(photons, floor_point(floor, (i % 40 - 19.5) / 80, (i / 40 - 19.5) / 80), 0).mean());
    return mean.mean();
  };
  EXPECT_LT(mean_on_plate(), 0.9 * 2);
  Plate plate;
  plate.center = {0, 0, -0.8};
  plate.size = {0.5, 0.5};
  settings.plates = {plate};
  EXPECT_NEAR(mean_on_plate(), 2, 0.01 * 2);
}

/// The shading of photons is that of next-event estimation where nothing bends: one or the other, never both.
TEST(PhotonTracerTest, ShadingIsThatOfStraightLight) {
  const TurningCube cube;
  FloorWorld bent(two_bands(), cube, Diffuse{}, 0.6, {sun({0.2, -0.1, -1}), PointLight{{0.3, 0.2, 2}, {5, 7}}});
  const PhotonMaps photons = traced(cube, bent.surfaces, bent.light_list, photon_settings(4000, 16, 0.1));
  ShadedScene straight = bent.scene;
  straight.region = nullptr;
  bent.scene.photons = &photons;
  const auto mean_of = [](const ShadedScene& scene, double x) {
    return seen(scene, {}, {x, -3, 1}, {x, 0.05, -0.8}, 2000, 1);
  };
  const Mean with = mean_of(bent.scene, 0.1), without = mean_of(straight, 0.1), beside = mean_of(bent.scene, 2);
  EXPECT_NEAR(with.mean(), without.mean(), 0.03 * without.mean());
  EXPECT_GT(without.mean(), 0.1);
  EXPECT_NEAR(beside.mean(), mean_of(straight, 2).mean(), 5 * beside.error() + 1e-9);
}

TEST(PhotonTracerTest, VisitsAllPhotonsInReach) {
  std::vector<Photon> photons(3000);
  for (std::size_t i = 0; i < photons.size(); ++i) {
    const auto number = [&](std::uint32_t dimension) { return static_cast<float>(random_uniform(1, i, dimension)); };
    photons[i].position = {number(0), number(1), 0.1f * number(2)};
    photons[i].normal = number(3) < 0.8f ? Eigen::Vector3f(0, 0, 1) : Eigen::Vector3f(1, 0, 0);
    photons[i].surface = number(4) < 0.8f ? 0 : 1;
    photons[i].band = number(5) < 0.5f ? 0 : 1;
    photons[i].power = 1;
  }
  const double radius = 0.13;
  const PhotonMap pass(photons, radius);
  for (int i = 0; i < 60; ++i) {
    SurfaceHit point;
    point.position = {1.4 * random_uniform(2, i, 0) - 0.2, 1.4 * random_uniform(2, i, 1) - 0.2, 0.05};
    point.normal = {0, 0, 1};
    for (const int band : {-1, 0, 1}) {
      double found = 0, expected = 0;
      pass.visit(point, band, [&](const Photon&, double density) { found += density; });
      for (const Photon& photon : photons) {
        const Vector3d way = photon.position.cast<double>() - point.position;
        const double squared = way.head<2>().squaredNorm() / (radius * radius);
        if (photon.surface == 0 && photon.normal.z() == 1 && (band < 0 || photon.band == band) && squared < 1 &&
            std::abs(way.z()) <= radius / 4)
          expected += 2 * (1 - squared) / (pi * radius * radius);
      }
      EXPECT_NEAR(found, expected, 1e-9 * (1 + expected)) << i << " " << band;
    }
  }
}

/// Within the region, and so near to it that it is on all sides: the floor has the irradiance I cos θ / r², and
/// (1 − cos θ) / 2 of the photons, where θ is the angle of its inscribed circle, or a little more. The radius blurs by
/// half a percent.
TEST(PhotonTracerTest, APointWithinTheRegionShinesAllAround) {
  for (const double z : {0.2, 0.505}) {
    const PointLight point{{0.1, 0, z}, {5, 7}};
    const double height = z + 0.8, part = (1 - height / std::hypot(height, 40 / 2)) / 2;
    const SurfaceScene floor = floor_at(-0.8, 40);
    const PhotonMaps photons = traced(TurningCube(), floor, {point}, photon_settings(60000, 8, 0.1));
    EXPECT_EQ(photons.counts[0].emitted, 60000u * traced_bands);
    const double landed = part_of(photons.counts[0], PhotonEnd::landed);
    if (z < 0.5) {  // From above, light that passes the cube is left to others.
      EXPECT_GT(landed, part - 0.006);
      EXPECT_LT(landed, 0.5);
    }
    for (const double x : {0.1, 0.4}) {
      const double squared = height * height + (x - 0.1) * (x - 0.1);
      const Mean found = photon_irradiance(photons, floor_point(floor, x, 0), 1);
      EXPECT_NEAR(found.mean(), 7 * height / std::pow(squared, 1.5), 4.5 * found.error() + 0.01 * found.mean()) << z;
    }
  }
  EXPECT_TRUE(
      traced(TurningCube(), floor_at(-0.8, 40), {PointLight{{0, 0, 0.2}, {5, 7}}}, photon_settings(0)).passes.empty());
}

// Photons of area lights, and their weights beside the other techniques that find this light.

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
    scene.bands_per_view = scene.bands_per_bounce = traced_bands;
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
/// photons in each pass that no technique has all the weight; with 50, the others have most of it. Their noise is
/// common to all samples: without weights 7% of the light (by seeds), with them less. Photons of a lamp within the
/// region start in all directions, as it shines.
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
    const auto expect_truth = [&](bool with_photons) {
      for (const DirectLight direct : {DirectLight::both, DirectLight::lights, DirectLight::material}) {
        const Mean mean = stage.radiance(direct, with_photons);
        const double noise = with_photons ? 0.05 * truth.mean() : 0;
        EXPECT_NEAR(mean.mean(), truth.mean(), 4.5 * std::hypot(mean.error(), truth.error()) + noise)
            << static_cast<int>(direct) << with_photons;
      }
    };
    for (const bool with_photons : {false, true}) expect_truth(with_photons);
    stage.photons = Stage(plane, floor, 50, 6144, light).photons;
    expect_truth(true);
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
  const PhotonMaps photons = trace_photons(BendingPlane(0.3), region_corners, floor_at(-2, 400),
                                           {lamp_at({0, 0, height}, {side, side})}, photon_settings(40000), {});
  const double power = power_in(photons, 1);
  const double h = height - half_height, root = std::sqrt(half_size * half_size + h * h);
  const double projected = 4 * half_size / root * std::atan(half_size / root);  // Four quarters of the upper face.
  EXPECT_NEAR(power, 7 * side * side * projected, 0.02 * power);
  const auto& [emitted, ends] = photons.counts[0];
  EXPECT_EQ(emitted, 40000u * traced_bands);
  EXPECT_EQ(ends[0] + ends[1] + ends[2] + ends[3], emitted);
  ASSERT_TRUE(photons.areas[0]);
  EXPECT_EQ(photons.areas[0]->count, 40000);
  EXPECT_DOUBLE_EQ(PhotonEmitter(inner_lamp, region_corners, {}).power(), pi * 0.3 * 0.2);
}

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
