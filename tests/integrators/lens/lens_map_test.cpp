#include <complex>

#include "base/constants.h"
#include "integrators/lens/lens.h"
#include "tests/tracing/support.h"
#include "volumes/making/generators.h"

namespace tensorray {
namespace {

const Vector3d down(0, 0, -1), up(0, 0, 1);

/// A plane across z whose axes are x and y.
Plate plane_at(double z) {
  Plate plate;
  plate.center = {0, 0, z};
  return plate;
}

Plate tilted_plane(const Vector3d& center, const Vector3d& normal) {
  Plate plate;
  plate.center = center;
  plate.up = upright(normal, Vector3d::UnitY());
  plate.right = plate.up.cross(normal.normalized());
  return plate;
}

/// Steps must also be short: error control considers the ray, which is straight on the axis of a lens, but not its
/// derivatives.
BendingSettings precise() {
  BendingSettings settings = settings_of(BendingMethod::dopri5, 0.25);
  settings.tolerance = 1e-9;
  return settings;
}

LensMap make_map(const TensorField& field, const Plate& from, const Plate& to, const Vector3d& direction,
                 const BendingSettings& settings = precise()) {
  return LensMap(field, surfaces_of(field), settings, from, to, direction);
}

/// The landing of light, which must have this end.
LensLanding land(const LensMap& map, const Vector2d& start, double flexibility, RayEnd end = RayEnd::plate) {
  LensLanding landing;
  map.trace({start}, {flexibility}, &landing);
  EXPECT_EQ(landing.end, end) << start.transpose() << ", s " << flexibility;
  return landing;
}

/// T V = axis × V.
TensorField turning_field(const Vector3d& axis) {
  Matrix3d T;
  T << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  return constant_field(T);
}

/// T V is k (x, y, 0) for V = +z: linear in position, so that the grid holds it exactly.
TensorField spreading_field(double k) {
  return cube_field(9, [k](const Vector3d& p) { return Matrix3d(Vector3d(k * p.x(), k * p.y(), 0) * up.transpose()); });
}

/// Light that turns at `rate` per length through a slab of `depth`, then goes straight over `distance`.
struct Arc {
  double aside = 0, length = 0;

  Arc(double depth, double rate, double distance) {
    const double angle = std::asin(depth * rate);
    aside = (1 - std::cos(angle)) / rate + distance * std::tan(angle);
    length = angle / rate + distance / std::cos(angle);
  }
};

TEST(LensMap, WithoutFieldLightIsProjected) {
  const TensorField field = constant_field(Matrix3d::Zero());
  const Vector3d direction = Vector3d(0.3, -0.2, -1).normalized();
  const Plate from = tilted_plane({0.2, 0.1, 1.8}, {0.2, 0.1, -1}), to = tilted_plane({-0.1, 0, -2}, {-0.3, 0.2, -1});
  for (const BendingMethod method : {BendingMethod::splitting, BendingMethod::dopri5}) {
    // Adaptive methods with a tight tolerance keep to double precision.
    const LensMap map =
        make_map(field, from, to, direction, method == BendingMethod::dopri5 ? precise() : settings_of(method, 0));
    const Vector3d normal = to.normal();
    Eigen::Matrix<double, 3, 2> from_axes, to_axes;
    from_axes << from.right, from.up;
    to_axes << to.right, to.up;
    const Matrix3d projection = Matrix3d::Identity() - direction * normal.transpose() / normal.dot(direction);
    for (const Vector2d& start : {Vector2d(0, 0), Vector2d(0.4, -0.3), Vector2d(3, 2)}) {  // The last: beside it.
      const Vector3d point = from.center + from_axes * start;
      const double distance = normal.dot(to.center - point) / normal.dot(direction);
      const LensLanding landing = land(map, start, 0.4);
      const double tolerance = method == BendingMethod::splitting ? single_precision : 1e-9;
      EXPECT_LT((plane_point(to, landing.at) - (point + distance * direction)).norm(), tolerance);
      EXPECT_LT((landing.jacobian - to_axes.transpose() * projection * from_axes).norm(), tolerance);
      EXPECT_NEAR(landing.length, distance, tolerance);
    }
  }
}

TEST(LensMap, NoPlaneStopsTheLightThatStartsOnIt) {
  const TensorField field = constant_field(Matrix3d::Zero());
  const double size = 2 * std::sqrt(3.0);
  for (const double tilt : {0.0, 60.0, 75.0, 85.0})
    for (const double distance : {0.0, 0.5, 1.0, 3.0, 1000 * size}) {  // In the volume, touching it, and far away.
      const double angle = tilt * pi / 180;
      const Plate from = tilted_plane({0, 0, distance}, {std::sin(angle), 0, -std::cos(angle)});
      const LensMap map = make_map(field, from, plane_at(-2), down);
      SCOPED_TRACE(testing::Message() << "tilt " << tilt << ", distance " << distance);
      for (int i = 0; i < 200; ++i) land(map, {0.5 * std::sin(1.7 * i), 0.5 * std::cos(2.9 * i)}, 1);
    }
}

/// The Jacobian of `spreading_field` on its axis: light obeys x'' = ±s k x there, + for light along +z.
double magnification(double curvature, double depth, double distance) {
  const std::complex<double> root = std::sqrt(std::complex<double>(curvature));
  return (std::cosh(root * depth) + root * std::sinh(root * depth) * distance).real();
}

TEST(LensMap, LinearLensMagnifiesByItsClosedForm) {
  const double k = 1.5;
  const TensorField field = spreading_field(k);
  for (const Vector3d& direction : {up, down})
    for (const double s : {0.4, -0.4})
      for (const double distance : {0.0, 0.8}) {
        const Plate from = plane_at(-1.25 * direction.z()), to = plane_at((1 + distance) * direction.z());
        const LensLanding landing = land(make_map(field, from, to, direction), {0, 0}, s);
        EXPECT_LT(landing.at.norm(), 1e-9);
        const double expected = magnification(s * k * direction.z(), 2, distance);
        EXPECT_LT((landing.jacobian - expected * Matrix2d::Identity()).norm(), 1e-6) << s << " " << direction.z();
      }
}

TEST(LensMap, SplittingsJacobianIsOfSecondOrder) {
  const TensorField field = spreading_field(1.5);
  double error[2];
  for (const int i : {0, 1}) {
    const BendingSettings settings = settings_of(BendingMethod::splitting, i == 0 ? 0.5 : 0.25);
    const LensLanding landing = land(make_map(field, plane_at(-1), plane_at(1.5), up, settings), {0, 0}, 0.4);
    error[i] = std::abs(landing.jacobian(0, 0) - magnification(0.6, 2, 0.5));
  }
  EXPECT_LT(error[0], 0.01);
  EXPECT_NEAR(error[0] / error[1], 4, 0.4);
}

TEST(LensMap, JacobianIsThatOfTheLandings) {
  const TensorField field = cube_field(9, linear_tensor);
  const Vector3d direction = Vector3d(0.1, 0.2, -1).normalized();
  const Plate planes[] = {tilted_plane({0, 0, 1.6}, {0.2, 0, -1}), tilted_plane({0, 0, 0.6}, {0.1, 0.2, -1}),
                          tilted_plane({0, 0, -0.5}, {-0.2, 0.1, -1}), tilted_plane({0, 0, -1.7}, {0, 0.3, -1})};
  const Vector2d start(0.05, -0.1);
  const double delta = 1e-3;
  for (int from : {0, 1})
    for (int to : {2, 3}) {
      const LensMap map = make_map(field, planes[from], planes[to], direction);
      const LensLanding landing = land(map, start, 0.3);
      for (int i = 0; i < 2; ++i) {
        const Vector2d step = delta * Vector2d::Unit(i);
        const Vector2d difference = (land(map, start + step, 0.3).at - land(map, start - step, 0.3).at) / (2 * delta);
        EXPECT_LT((landing.jacobian.col(i) - difference).norm(), 1e-4) << from << " " << to;
      }
    }
}

TEST(LensMap, PlanesCutTheVolume) {
  const double s = 0.5, rate = 0.7;
  const TensorField field = turning_field(rate * Vector3d::UnitX());
  const Vector2d start(0, -0.9);
  for (const double above : {1.5, 0.9, 0.3})
    for (const double below : {-0.2, 0.0, 0.4, 0.8, 1.6}) {  // Distance below the middle; the last one is outside.
      const double depth = std::min(1.0, above) + std::min(1.0, below);
      const Arc arc(depth, s * rate, std::max(0.0, below - 1));
      const LensLanding landing = land(make_map(field, plane_at(above), plane_at(-below), down), start, s);
      EXPECT_LT((landing.at - start - Vector2d(0, arc.aside)).norm(), 1e-6) << above << " " << below;
      EXPECT_LT((landing.jacobian - Matrix2d::Identity()).norm(), 1e-6);
      EXPECT_NEAR(landing.length, std::max(0.0, above - 1) + arc.length, 1e-6);
    }
}

TEST(LensMap, TurningLightReachesNeitherBeyondThePlaneNorBehindItsStart) {
  const double radius = 0.4;
  const TensorField field = turning_field(1 / radius * Vector3d::UnitX());
  const Vector2d start(0, -0.4);
  const Plate from = plane_at(0.5);
  const LensLanding reached = land(make_map(field, from, plane_at(0.2), down), start, 1);
  EXPECT_LT((reached.at - start - Vector2d(0, Arc(0.3, 1 / radius, 0).aside)).norm(), 1e-6);
  // The ray turns back 0.4 below its start, and stops where it meets the plane from which it came.
  for (const double beyond : {0.0, 0.8, 1.5}) {
    SCOPED_TRACE(beyond);
    const LensLanding landing = land(make_map(field, from, plane_at(beyond), down), start, 1, RayEnd::obstacle);
    EXPECT_NEAR(landing.length, pi * radius, 1e-3);
  }
}

TEST(LensMap, LandingsAreOrderedByStartThenFlexibility) {
  const TensorField field = cube_field(9, linear_tensor);
  const LensMap map = make_map(field, plane_at(1.5), plane_at(-1.5), down, {});
  const std::vector<Vector2d> starts = {{0.1, 0.2}, {-0.3, 0.1}, {0.2, -0.2}};
  const std::vector<double> flexibilities = {0, 0.2, -0.1};
  std::vector<LensLanding> landings(9);
  const TraceCounts counts = map.trace(starts, flexibilities, landings.data());
  TraceCounts sum;
  for (std::size_t i = 0; i < 9; ++i) {
    LensLanding alone;
    sum += map.trace({starts[i / 3]}, {flexibilities[i % 3]}, &alone);
    EXPECT_EQ(landings[i].at, alone.at);
    EXPECT_EQ(landings[i].jacobian, alone.jacobian);
  }
  EXPECT_EQ(counts.ray_steps, sum.ray_steps);
  // Rays of one start share the sample that is taken there.
  EXPECT_LE(counts.tensor_samples, sum.tensor_samples);
  EXPECT_GE(counts.tensor_samples + 6, sum.tensor_samples);
  EXPECT_GT(counts.ray_steps, 0u);
  EXPECT_LT((landings[3].at - starts[1]).norm(), single_precision);  // s = 0: straight.
}

}  // namespace
}  // namespace tensorray
