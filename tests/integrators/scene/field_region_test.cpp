#include "integrators/scene/field_region.h"

#include <array>
#include <utility>

#include "renderer/light_maps/photon_tracer.h"
#include "renderer/lights/lights.h"
#include "renderer/sampling/random.h"
#include "renderer/sampling/sampling.h"
#include "renderer/surfaces/surface_scene.h"
#include "tests/renderer/shapes.h"
#include "tests/tracing/support.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

FieldViewSettings view(Conserve conserve, double flexibility) {
  FieldViewSettings settings;
  settings.conserve = conserve;
  settings.flexibility = [flexibility](int, double) { return flexibility; };
  return settings;
}

BentRay ray_of(const Vector3d& position, const Vector3d& direction) {
  BentRay ray;
  ray.position = position;
  ray.direction = direction;
  return ray;
}

/// A ray that enters the cube [−1, 1]³: positions are uniform on its surface, directions have the density cos θ / π.
BentRay sample_entry(std::uint64_t index) {
  PathSampler sampler{5, index, 0, 0};
  const int face = static_cast<int>(6 * sampler.next_1d());
  const Eigen::Vector2d at = 2 * sampler.next_2d() - Eigen::Vector2d(1, 1);
  const double side = face % 2 == 0 ? 1 : -1;
  const int axis = face / 2;
  Vector3d position;
  position[axis] = side;
  position[(axis + 1) % 3] = at.x();
  position[(axis + 2) % 3] = at.y();
  return ray_of(position, frame_about(-side * Vector3d::Unit(axis)) * square_to_cosine_hemisphere(sampler.next_2d()));
}

Geometry geometry_among(const TensorField& field, std::vector<TriangleMesh> obstacles) {
  Surfaces surfaces = surfaces_of(field);
  surfaces.obstacles = std::move(obstacles);
  return Geometry(std::move(surfaces));
}

/// Mean and standard error.
struct Average {
  double sum = 0, squares = 0, count = 0;
  void add(double x) {
    sum += x;
    squares += x * x;
    ++count;
  }
  double mean() const { return sum / count; }
  double error() const { return std::sqrt((squares / count - mean() * mean()) / count); }
};

TEST(FieldRegionTest, EntersWhereStraightLightMeetsTheBox) {
  const TensorField field = constant_field(general_tensor());
  const Geometry geometry(surfaces_of(field));
  const FieldRegion region(field, geometry, view(Conserve::power, 0.1));
  EXPECT_NEAR(region.entry({0, 0, 3}, {0, 0, -1}), 2, 1e-12);
  EXPECT_EQ(region.entry({0, 0, 0}, {0, 0, -1}), 0);
  EXPECT_EQ(region.entry({0, 0, 3}, {0, 0, 1}), INFINITY);
  EXPECT_EQ(region.entry({0, 0, 1}, {0, 0, 1}), INFINITY);  // Leaves.
  EXPECT_EQ(region.entry({2, 0, 3}, {0, 0, -1}), INFINITY);
}

/// Ways that start on a surface, within the volume and before it, leave it: they do not end where they start.
TEST(FieldRegionTest, WaysStartOnSurfaces) {
  const TensorField field = constant_field(general_tensor());
  for (const double height : {-0.4, -1.0, -1.7}) {
    const TriangleMesh floor = rectangle_mesh({0, 0, height}, {1, 0, 0}, {0, 1, 0}, {4, 4});
    const TriangleMesh roof = rectangle_mesh({0, 0, 0.4}, {1, 0, 0}, {0, 1, 0}, {4, 4});
    const Geometry geometry = geometry_among(field, {floor, roof});
    const FieldRegion region(field, geometry, view(Conserve::power, 1e-9));
    const SurfaceScene stage({surface_of(floor)});
    std::vector<BentRay> ways;
    for (std::uint64_t i = 0; i < 200; ++i) {
      PathSampler sampler{7, i, 0, 0};
      const Vector2d at = 1.6 * sampler.next_2d() - Vector2d(0.8, 0.8);
      const Vector3d direction = square_to_cosine_hemisphere(sampler.next_2d());
      const auto hit = stage.intersect({at.x(), at.y(), 0}, {0, 0, -1});
      const Vector3d start = stage.start(*hit, hit->lifted_position, 1);
      if (!std::isinf(region.entry(start, direction))) ways.push_back(ray_of(start, direction));
    }
    EXPECT_GT(ways.size(), 50u);
    region.trace_radiance(ways);
    for (const BentRay& way : ways) {
      SCOPED_TRACE(testing::Message() << height << ", way " << &way - ways.data());
      ASSERT_TRUE(way.arrives);
      EXPECT_GT(way.position.z(), height + 1e-3);
      EXPECT_TRUE(!way.on_surface || std::abs(way.position.z() - 0.4) < 1e-5);
    }
  }
}

/// What leaves a convex boundary fills it once, so that the mean of the radiance_scale is 1.
TEST(FieldRegionTest, TheMeanGainOverAConvexBoundaryIsOne) {
  const TensorField field = cube_field(17, linear_tensor);
  const Geometry geometry(surfaces_of(field));
  const FieldRegion region(field, geometry, view(Conserve::power, 0.5));
  std::vector<BentRay> ways;
  for (std::uint64_t i = 0; i < 60000; ++i) ways.push_back(sample_entry(i));
  region.trace_radiance(ways);
  Average radiance_scale;
  for (const BentRay& way : ways) radiance_scale.add(way.radiance_scale);
  EXPECT_NEAR(radiance_scale.mean(), 1, 5 * radiance_scale.error());
  EXPECT_LT(radiance_scale.error(), 0.01);
}

/// Light from a textured Lambertian plate below the field to a sensor above it, once as photons and once as rays that
/// are followed back from the sensor.
struct Sensor {
  TensorField field;
  Plate emitter, sensor;

  Sensor(TensorField field_, double tilt) : field(std::move(field_)) {
    emitter.center = {0, 0, -1.5};
    emitter.size = {4, 4};
    sensor.center = {0, 0, 1.4};
    sensor.up = Vector3d(0, std::cos(tilt), std::sin(tilt));
    sensor.size = {1.2, 1.2};
  }

  static double radiance(const Vector3d& point) { return 1 + std::sin(2 * point.x()) * std::cos(point.y()); }

  /// A point of the plate and a direction on the side of its normal, with the density cos θ / π.
  static BentRay start(const Plate& plate, double side, std::uint64_t index) {
    PathSampler sampler{7, index, 0, 0};
    const Vector3d position = plate.to_world(sampler.next_2d().cwiseProduct(plate.resolution.cast<double>()));
    return ray_of(position, frame_about(side * plate.normal()) * square_to_cosine_hemisphere(sampler.next_2d()));
  }

  /// Flux on the sensor by photons.
  Average forwards(double s, std::uint64_t photons) const {
    RayBatch rays;
    std::vector<double> emitted;
    for (std::uint64_t i = 0; i < photons; ++i) {
      const BentRay photon = start(emitter, 1, i);
      rays.add(photon.position, photon.direction, s);
      emitted.push_back(radiance(photon.position));
    }
    trace(field, geometry_with(field, sensor), {}, rays);
    Average flux;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      // The sensor sees one side.
      const bool arrives = rays.end[i] == RayEnd::plate && rays.direction[i].dot(sensor.normal()) > 0;
      flux.add(arrives ? pi * emitter.size.prod() * emitted[i] : 0);
    }
    return flux;
  }

  /// The same, followed back. @param s  Of the light; the region takes −s.
  Average backwards(double s, std::uint64_t rays) const {
    const Geometry geometry(surfaces_of(field));
    const FieldRegion region(field, geometry, view(Conserve::power, s));
    std::vector<BentRay> straight, ways;
    for (std::uint64_t i = 0; i < rays; ++i) {
      const BentRay way = start(sensor, -1, i);
      (region.entry(way.position, way.direction) < INFINITY ? ways : straight).push_back(way);
    }
    region.trace_radiance(ways);
    ways.insert(ways.end(), straight.begin(), straight.end());
    Average flux;
    for (const BentRay& way : ways) {
      const double distance = (emitter.center.z() - way.position.z()) / way.direction.z();
      const Vector3d hit = way.position + distance * way.direction;
      const bool arrives = way.direction.z() < 0 && (hit.head<2>().array().abs() < emitter.size.array() / 2).all();
      flux.add(arrives ? pi * sensor.size.prod() * way.radiance_scale * radiance(hit) : 0);
    }
    return flux;
  }
};

/// Random linear fields of general tensors, sensors and flexibilities of both signs.
TEST(FieldRegionTest, SensorsSeeTheSameForwardsAndBackwardsInRandomScenes) {
  double squares = 0, wrong_squares = 0;
  constexpr int scenes = 6;
  for (std::uint64_t scene = 0; scene < scenes; ++scene) {
    std::array<Matrix3d, 4> T;
    for (std::uint32_t i = 0; i < 36; ++i) T[i / 9](i % 9) = 2 * random_uniform(11, scene, i) - 1;
    const auto linear = [&](const Vector3d& p) -> Matrix3d {
      return T[0] + 0.5 * (p.x() * T[1] + p.y() * T[2] + p.z() * T[3]);
    };
    const Sensor sensor(cube_field(9, linear), 0.8 * random_uniform(11, scene, 36) - 0.4);
    const double s = (scene % 2 == 0 ? 1 : -1) * (0.2 + 0.2 * random_uniform(11, scene, 37));
    const Average photons = sensor.forwards(s, 120000), rays = sensor.backwards(s, 40000);
    const Average wrong = sensor.backwards(-s, 40000);
    squares += std::pow((photons.mean() - rays.mean()) / std::hypot(photons.error(), rays.error()), 2);
    wrong_squares += std::pow((photons.mean() - wrong.mean()) / std::hypot(photons.error(), wrong.error()), 2);
  }
  // The sum of `scenes` squares of standard normal numbers is above 28 once in 10,000 times.
  EXPECT_LT(squares, 28);
  EXPECT_GT(wrong_squares, 100);  // The test can fail.
}

constexpr int bands = 32;

/// Ways of every fourth band, as a camera's ray has them.
std::vector<BentRay> ways_of(const Vector3d& position, const Vector3d& direction, double tolerance) {
  std::vector<BentRay> ways;
  for (int band = 1; band < bands; band += 4) {
    ways.push_back(ray_of(position, direction.normalized()));
    ways.back().band = band;
    ways.back().tolerance = tolerance;
  }
  return ways;
}

/// Ends that are polynomials of degree 2 in the band, seen from a distance of about 2.
std::vector<BentRay> parabolic_ends() {
  std::vector<BentRay> ways = ways_of({0, 0, 0}, {0, 0, 1}, 1e-6);
  for (BentRay& way : ways) {
    const double x = way.band / 32.0;
    way.position = {x, 1 - x * x, 2};
    way.direction = Vector3d(0, 0, 1);
    way.jacobian = std::exp(0.3 * x - x * x);
    way.arrives = true;
  }
  return ways;
}

TEST(BandInterpolationTest, TheCheckSeesWhatIsNotPredictable) {
  const BandGroup group = interpolation_groups(ways_of({0, 0, 0}, {0, 0, 1}, 1e-6))[0];
  for (const int what : {0, 1, 2}) {
    std::vector<BentRay> ways = parabolic_ends();
    BentRay& check = ways[group.check];
    if (what == 0) check.position.x() += 1e-5;  // The tolerance is 1e-6 at a distance of 2.
    if (what == 1) check.direction = Vector3d(1e-5, 0, 1).normalized();
    if (what == 2) check.jacobian *= 1.02;
    EXPECT_FALSE(is_predictable(group, ways, {0, 0, 0})) << what;
  }
}

/// A smooth field that turns light of the last band by about 0.2 radians.
class InterpolatedRegion : public testing::Test {
 protected:
  static FieldViewSettings settings(Conserve conserve = Conserve::power) {
    FieldViewSettings each = view(conserve, 0);
    each.flexibility = [](int band, double place) { return 0.2 * (band + place) / bands; };
    return each;
  }

  static std::vector<BentRay> random_ways(double tolerance) {
    std::vector<BentRay> ways;
    for (std::uint64_t i = 0; i < 40; ++i) {
      const auto number = [i](int dimension) { return random_uniform(8, i, dimension) - 0.5; };
      const Vector3d from(3, number(0), number(1)), to(0, number(2), number(3));
      const std::vector<BentRay> more = ways_of(from, to - from, tolerance);
      ways.insert(ways.end(), more.begin(), more.end());
    }
    return ways;
  }

  static std::uint64_t followed(const FieldRegion& region) {
    std::uint64_t sum = 0;
    for (int end = 0; end < ray_end_count; ++end) sum += region.ways(static_cast<RayEnd>(end));
    return sum;
  }

  const TensorField field_ = cube_field(33, focusing_tensor);
  const Geometry geometry_{surfaces_of(field_)};
};

TEST_F(InterpolatedRegion, IsWithinTheTolerance) {
  constexpr double tolerance = 2e-4;
  for (const Conserve conserve : {Conserve::power, Conserve::radiance}) {
    const FieldRegion region(field_, geometry_, settings(conserve)), exact(field_, geometry_, settings(conserve));
    std::vector<BentRay> ways = random_ways(tolerance), truth = random_ways(0);
    const std::vector<BentRay> starts = truth;
    region.trace_radiance(ways);
    exact.trace_radiance(truth);
    for (std::size_t i = 0; i < ways.size(); ++i) {
      ASSERT_TRUE(truth[i].arrives && ways[i].arrives);
      const double distance = (truth[i].position - starts[i].position).norm();
      EXPECT_LT((ways[i].position - truth[i].position).norm(), tolerance * distance);
      EXPECT_LT((ways[i].direction - truth[i].direction).norm(), tolerance);
      EXPECT_NEAR(ways[i].radiance_scale, truth[i].radiance_scale, 0.01 * truth[i].radiance_scale);
      EXPECT_NEAR(ways[i].jacobian, truth[i].jacobian, 0.01 * truth[i].jacobian);
    }
    EXPECT_EQ(followed(exact), truth.size());
    EXPECT_LT(followed(region), 0.7 * static_cast<double>(truth.size()));
    EXPECT_GE(followed(region), truth.size() / 2);
  }
}

/// With a tolerance that no interpolation reaches, or an obstacle that only some bands might meet, all bands are
/// followed, with the same results as alone.
TEST_F(InterpolatedRegion, FollowsAllBandsWhereItMust) {
  const Geometry with_obstacle = geometry_among(field_, {rectangle_mesh({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0.1, 0.1})});
  for (const bool has_obstacle : {false, true}) {
    const Geometry& geometry = has_obstacle ? with_obstacle : geometry_;
    const FieldRegion region(field_, geometry, settings()), exact(field_, geometry, settings());
    std::vector<BentRay> ways = random_ways(has_obstacle ? 1e-3 : 1e-12), truth = random_ways(0);
    region.trace_radiance(ways);
    exact.trace_radiance(truth);
    for (std::size_t i = 0; i < ways.size(); ++i) {
      EXPECT_EQ(ways[i].position, truth[i].position);
      EXPECT_EQ(ways[i].direction, truth[i].direction);
      EXPECT_EQ(ways[i].radiance_scale, truth[i].radiance_scale);
    }
    EXPECT_EQ(followed(region), truth.size());
  }
}

using Squares = Eigen::Array<double, 8, 8>;

/// A floor within the volume, in light from above. Powers are those on squares of 0.25 × 0.25 about the origin.
class SunnyFloor : public testing::Test {
 protected:
  static void add(Squares& squares, const Vector3d& position, double power) {
    const Eigen::Array2i square = ((position.head<2>().array() + 1) / 0.25).floor().cast<int>();
    if ((square >= 0).all() && (square < 8).all()) squares(square.x(), square.y()) += power;
  }

  /// By photons.
  Squares by_photons(double flexibility, Conserve conserve) const {
    const FieldRegion region(field_, geometry_, view(conserve, flexibility));
    PhotonTracerSettings settings;
    settings.per_pass = 60000;
    settings.radius = 0.01;
    settings.serves = [](int, std::uint32_t) { return true; };
    const SurfaceScene scene({surface_of(floor_)});
    const PhotonMaps maps =
        trace_photons(region, field_.corners(), scene, {DirectionalLight{along_, {1}}}, settings, {});
    Squares squares = Squares::Zero();
    for (const Photon& photon : maps.passes[0].photons()) add(squares, photon.position.cast<double>(), photon.power);
    return squares;
  }

  /// By rays of the sun from random positions of a square above the volume, one by one in double precision.
  /// @return the light if power is conserved, and if radiance is.
  std::pair<Squares, Squares> by_rays(double flexibility) const {
    constexpr int count = 120000;
    constexpr double side = 2.6;
    RayBatch rays;
    for (int i = 0; i < count; ++i) {
      const Vector3d at(side * (random_uniform(1, i, 0) - 0.5), side * (random_uniform(1, i, 1) - 0.5), 1);
      rays.add(at - 0.5 * along_, along_, flexibility);
    }
    rays.wants_log_radiance_scale = true;
    trace_reference(field_, geometry_, {}, rays);
    std::pair<Squares, Squares> light(Squares::Zero(), Squares::Zero());
    const double power = side * side * std::abs(along_.z()) / count;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      // Only light that meets the cube: it has gone through it, or past its upper edge.
      if (rays.end[i] != RayEnd::obstacle || rays.steps[i] == 0) continue;
      add(light.first, rays.position[i], power);
      add(light.second, rays.position[i], std::exp(rays.log_radiance_scale[i]) * power);
    }
    return light;
  }

  const Vector3d along_ = Vector3d(0.15, -0.1, -1).normalized();
  const TriangleMesh floor_ = rectangle_mesh({0, 0, -0.3}, {1, 0, 0}, {0, 1, 0}, {6, 6});
  const TensorField field_ = cube_field(17, focusing_tensor);
  const Geometry geometry_ = geometry_among(field_, {floor_});
};

/// The greatest difference, of the mean.
double difference(const Squares& a, const Squares& b) { return (a - b).abs().maxCoeff() / b.mean(); }

/// A square has about 1000 rays: 3% noise each, 64 squares.
TEST_F(SunnyFloor, WithinTheVolumeHasTheLightOfForwardRays) {
  constexpr double flexibility = 0.6;
  const auto [power, radiance] = by_rays(flexibility);
  EXPECT_LT(difference(by_photons(flexibility, Conserve::power), power), 0.2);
  EXPECT_LT(difference(by_photons(flexibility, Conserve::radiance), radiance), 0.2);
  // The wrong sign, and the wrong law.
  EXPECT_GT(difference(by_photons(-flexibility, Conserve::power), power), 0.5);
  EXPECT_GT(difference(radiance, power), 0.3);
}

}  // namespace
}  // namespace tensorray
