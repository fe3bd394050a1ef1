// Rays in cubic fields, against rays through the formula that the voxels were sampled from.

#include <unsupported/Eigen/MatrixFunctions>

#include "tests/tracing/support.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

constexpr Interpolant cubic{Interpolation::cubic, Border::fade}, linear{Interpolation::linear, Border::fade};

/// A field that no generator makes: a rotation that varies like waves, and a stretch along a bump.
Matrix3d formula(const Vector3d& p) {
  Matrix3d T = 0.8 * std::sin(2.1 * p.x() + 0.5 * p.z()) * general_tensor();
  const Vector3d axis(0.6, -0.48, 0.64);
  T += 1.2 * std::exp(-2 * (p - Vector3d(0.1, -0.2, 0.15)).squaredNorm()) * axis * axis.transpose();
  T(0, 1) += 0.5 * std::cos(1.7 * p.y() - p.z());
  T(1, 0) -= 0.4 * std::cos(1.7 * p.y() - p.z());
  return T;
}

/// A polynomial of degree 3 along each axis, which a cubic field is everywhere.
Matrix3d cubic_polynomial(const Vector3d& p) {
  Matrix3d T = linear_tensor(p);
  T += 0.5 * p.x() * p.x() * p.y() * general_tensor().transpose();
  T(2, 0) += 0.3 * p.z() * p.z() * p.z() - 0.4 * p.x() * p.x() * p.x();
  T(1, 2) += 0.2 * p.y() * p.y() * p.y() * p.z() * p.z();
  return T;
}

std::vector<Ray> starts() {
  std::vector<Ray> result;
  for (int i = 0; i < 6; ++i)
    result.push_back({Vector3d(-0.4 + 0.15 * i, 0.3 - 0.13 * i, -0.6), Vector3d(0.1 * i - 0.3, 0.1, 1).normalized()});
  return result;
}

constexpr double way = 1, flexibility = 0.6;  // Within the field.

BendingSettings settings_for(BendingMethod method, double step) {
  BendingSettings settings = settings_of(method, step);
  settings.max_length = way;
  return settings;
}

/// The greatest distance of rays' ends, one unit further along their directions, from those of other rays.
double distance(const TensorField& field, const BendingSettings& settings, const std::vector<Ray>& truth) {
  const Geometry geometry(surfaces_of(field));
  double greatest = 0;
  const std::vector<Ray> from = starts();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Ray ray = trace_one(field, geometry, settings, from[i].position, from[i].direction, flexibility);
    const Vector3d apart = ray.position + ray.direction - truth[i].position - truth[i].direction;
    greatest = std::max(greatest, apart.norm());
  }
  return greatest;
}

std::vector<Ray> true_rays(const TensorFunction& T) {
  std::vector<Ray> rays;
  for (const Ray& start : starts())
    rays.push_back(through_formula(T, flexibility, start.position, start.direction, way));
  return rays;
}

TensorField field_of(const TensorFunction& T, int voxels, const Interpolant& interpolant) {
  return TensorField(cube_grid(Vector3i::Constant(voxels), T), interpolant);
}

/// Halving the step divides the error by 2⁴ where the field is one polynomial.
TEST(CubicRays, StepsAreOfOrderFour) {
  const TensorField field = field_of(cubic_polynomial, 9, cubic);
  const std::vector<Ray> truth = true_rays(cubic_polynomial);
  // Voxels of 1/4: one and two steps. The error that single precision leaves in the voxels is below 1e-6.
  const double coarse = distance(field, settings_for(BendingMethod::splitting4, 4), truth),
               fine = distance(field, settings_for(BendingMethod::splitting4, 2), truth);
  EXPECT_GT(fine, 3e-6);
  EXPECT_GT(std::log2(coarse / fine), 3.6);
  EXPECT_LT(distance(field, settings_for(BendingMethod::splitting4, 0.25), truth), 1e-6);
}

/// Halving the voxels divides the error by 2⁴ where the field is smooth: a cubic spline is of order 4.
TEST(CubicRays, VoxelsAreOfOrderFour) {
  const std::vector<Ray> truth = true_rays(formula);
  const auto error = [&](int voxels, const Interpolant& interpolant) {
    return distance(field_of(formula, voxels, interpolant), settings_for(BendingMethod::splitting4, 0.25), truth);
  };
  const double coarse = error(9, cubic), middle = error(17, cubic), fine = error(33, cubic);
  EXPECT_GT(std::log2(coarse / middle), 3);
  EXPECT_GT(std::log2(middle / fine), 3);
  EXPECT_LT(fine, 0.05 * error(33, linear));
  EXPECT_LT(fine, 0.5 * error(129, linear)) << "64 times fewer voxels";
}

TEST(CubicRays, TheErrorFollowsTheTolerance) {
  const TensorField field = field_of(formula, 33, cubic);
  const double voxel = voxel_size(field);
  std::vector<Ray> truth;
  for (const Ray& start : starts())
    truth.push_back(trace_one(field, Geometry(surfaces_of(field)), settings_for(BendingMethod::splitting4, 0.1),
                              start.position, start.direction, flexibility));
  double last = 1;
  for (const double tolerance : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5}) {
    BendingSettings settings = settings_for(BendingMethod::automatic, 0);
    settings.tolerance = tolerance;
    const double error = distance(field, settings, truth) / voxel;
    EXPECT_LT(error, 10 * tolerance) << "some ten steps, whose errors add up";
    EXPECT_LE(error, last);
    last = error;
  }
}

/// For constant T, directions are exact at any step length and strength, up to rounding in the voxels; and the rays of
/// any multiple of I are straight.
TEST(CubicRays, ConstantTensors) {
  const Vector3d direction = Vector3d(0.3, -0.2, 1).normalized();
  constexpr double length = 0.4;
  for (const double strength : {0.5, 5.0, 50.0})
    for (const double step : {0.25, 1.0, 1.6}) {
      const Matrix3d T = strength * general_tensor();
      const TensorField field = field_of([&](const Vector3d&) { return T; }, 9, cubic);
      BendingSettings settings = settings_for(BendingMethod::splitting4, step);
      settings.max_length = length;
      const Ray ray = trace_one(field, Geometry(surfaces_of(field)), settings, {0, 0, -0.2}, direction, 0.2);
      const Vector3d expected = (0.2 * length * T).exp() * direction;
      EXPECT_LT((ray.direction - expected.normalized()).norm(), 1e-6 * (1 + strength)) << strength << ", step " << step;
    }
  const TensorField isotropic = field_of([](const Vector3d&) { return Matrix3d(7 * Matrix3d::Identity()); }, 9, cubic);
  const Ray ray = trace_one(isotropic, Geometry(surfaces_of(isotropic)), settings_for(BendingMethod::automatic, 0),
                            {0, 0, -0.2}, direction, 0.2);
  EXPECT_LT((ray.direction - direction).norm(), 1e-12);
}

}  // namespace
}  // namespace tensorray
