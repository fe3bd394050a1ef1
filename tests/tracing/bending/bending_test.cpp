#include "tracing/bending/bending.h"

#include <fstream>
#include <sstream>

#include <unsupported/Eigen/MatrixFunctions>

#include "tests/data_folder.h"
#include "tests/tracing/support.h"
#include "tests/volumes/grid_support.h"
#include "tracing/trace/trace.h"
#include "volumes/making/generators.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {
namespace {

constexpr BendingMethod all_methods[] = {BendingMethod::euler, BendingMethod::splitting, BendingMethod::splitting4,
                                         BendingMethod::rk4,   BendingMethod::bs23,      BendingMethod::dopri5};

/// Diagonal, symmetric, general, a turn, and a shear.
std::vector<Matrix3d> constant_tensors() {
  const Matrix3d general = general_tensor();
  return {Vector3d(1.5, -0.75, 0.25).asDiagonal().toDenseMatrix(), general + general.transpose(), general,
          general - general.transpose(), 2 * Vector3d::UnitX() * Vector3d::UnitZ().transpose()};
}

TEST(Bending, ZeroAndIsotropicFieldsLeaveLightStraight) {
  for (const auto& [c, between] :
       {std::pair(0.0, Interpolation::linear), {3.0, Interpolation::linear}, {7.0, Interpolation::cubic}}) {
    const auto tensor = [c = c](const Vector3d&) { return Matrix3d(c * Matrix3d::Identity()); };
    const TensorField field(cube_grid({9, 9, 9}, tensor), {between, Border::fade});
    const Geometry geometry = geometry_with(field, plate_across({0, 0, -1}, 2));
    for (const BendingMethod method : all_methods) {
      SCOPED_TRACE(testing::Message() << c << " I, method " << static_cast<int>(method));
      const Vector3d V = Vector3d(0.1, -0.2, -1).normalized();
      const Ray ray = trace_one(field, geometry, settings_of(method, 0), {0.3, 0.1, 3}, V, 0.3);
      EXPECT_EQ(ray.end, RayEnd::plate);
      EXPECT_LT((ray.position - (Vector3d(0.3, 0.1, 3) + 5 / -V.z() * V)).norm(), 1e-12);
      EXPECT_LT((ray.direction - V).norm(), 1e-14);
      EXPECT_NEAR(ray.length, 5 / -V.z(), 1e-12);
    }
  }
}

/// P of constant T, by composite Gauss–Legendre quadrature of V(t) = normalize(exp(s t T) V₀).
Vector3d exact_position(const Matrix3d& T, double s, const Vector3d& P, const Vector3d& V, double length) {
  const double nodes[3] = {-std::sqrt(0.6), 0, std::sqrt(0.6)}, weights[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  Vector3d position = P;
  constexpr int pieces = 400;
  for (int i = 0; i < pieces; ++i)
    for (int k = 0; k < 3; ++k) {
      const double at = (i + 0.5 + nodes[k] / 2) * length / pieces;
      position += length / pieces * weights[k] * (Matrix3d((s * at * T).exp()) * V).normalized();
    }
  return position;
}

/// V = normalize(M V₀) with M = exp(s ℓ T). Λ: L_end / L_start = |M V₀|³ / det M, and −Λ is its logarithm.
TEST(Bending, PathsAndRadianceOfConstantTensorsHaveTheirClosedForms) {
  const Vector3d P(-0.2, 0.1, -0.5), V = Vector3d(0.3, -0.4, 1).normalized();
  const double s = 0.5;
  for (const Matrix3d& T : constant_tensors()) {
    const TensorField field = constant_field(T);
    const double length = 4 * voxel_size(field);
    const Vector3d landing = exact_position(T, s, P, V, length);
    const Matrix3d M = Matrix3d(s * length * T).exp();
    const auto expect_errors = [&](BendingMethod method, double step, double of_path, double of_turn,
                                   double of_radiance) {
      BendingSettings settings = settings_of(method, step);
      settings.max_steps = static_cast<int>(4 / step);
      RayBatch rays;
      rays.wants_log_radiance_scale = true;
      rays.add(P, V, s);
      trace_reference(field, Geometry(surfaces_of(field)), settings, rays);
      EXPECT_EQ(rays.end[0], RayEnd::step_limit);
      EXPECT_NEAR(rays.length[0], length, 1e-12);
      const double turn = (rays.direction[0] - (M * V).normalized()).norm();
      EXPECT_LT(turn, of_turn) << T << "\nstep " << step;
      EXPECT_LT((rays.position[0] - landing).norm() + turn, of_path) << T << "\nstep " << step;
      const double change = std::log(std::pow((M * V).norm(), 3) / M.determinant());
      EXPECT_NEAR(rays.log_radiance_scale[0], -change, of_radiance) << T << "\nstep " << step;
    };
    // ‖s T h‖ is about 0.02, and Λ at most 1. The error is the former to the power of the order, times the path's
    // length and a constant.
    expect_errors(BendingMethod::euler, 1.0 / 16, 0.04, 0.04, 0.04);
    expect_errors(BendingMethod::rk4, 1.0 / 16, 1e-7, 1e-7, 1e-7);
    // Every step has the exact direction.
    expect_errors(BendingMethod::splitting, 1.0 / 16, 4e-4, 2e-12, 1e-11);
    for (const double step : {1, 4}) expect_errors(BendingMethod::splitting, step, INFINITY, 2e-12, 1e-11);
  }
}

TEST(Bending, PathsAreRetracedWithTheOppositeSign) {
  const TensorField field = cube_field(9, linear_tensor);
  const Geometry geometry(surfaces_of(field));
  const Vector3d P(-0.3, 0.2, -0.6), V = Vector3d(0.1, 0.2, 1).normalized();
  const auto there_and_back = [&](BendingMethod method, double back) {
    BendingSettings settings = settings_of(method, 0.25);
    settings.max_steps = 16;
    const Ray there = trace_one(field, geometry, settings, P, V, 0.5);
    const Ray again = trace_one(field, geometry, settings, there.position, -there.direction, back);
    for (const Ray& ray : {there, again}) EXPECT_EQ(ray.end, RayEnd::step_limit);
    return (again.position - P).norm();
  };
  for (const BendingMethod symmetric : {BendingMethod::splitting, BendingMethod::splitting4})
    EXPECT_LT(there_and_back(symmetric, -0.5), 1e-10);  // Exact but for rounding.
  EXPECT_LT(there_and_back(BendingMethod::rk4, -0.5), 1e-6);
  EXPECT_GT(there_and_back(BendingMethod::splitting, 0.5), 0.05);
}

TEST(Bending, TheScaleIsAFactorOnTheFlexibility) {
  const TensorField field = cube_field(9, linear_tensor);
  const Geometry geometry(surfaces_of(field));
  const TensorField strong = cube_field(9, [](const Vector3d& p) { return Matrix3d(8 * linear_tensor(p)); });
  for (const BendingMethod method : all_methods)
    for (const double step : {0.0, 0.25}) {  // Automatic steps follow the scale.
      BendingSettings scaled = settings_of(method, step), plain = scaled;
      scaled.scale = 8;
      const Vector3d P(0.1, 0.2, -2), V(0, 0.1, 1);
      const Ray ray = trace_one(field, geometry, scaled, P, V, 0.4);
      for (const Ray& same :
           {trace_one(field, geometry, plain, P, V, 3.2), trace_one(strong, geometry, plain, P, V, 0.4)}) {
        EXPECT_EQ(ray.position, same.position);
        EXPECT_EQ(ray.direction, same.direction);
        EXPECT_EQ(ray.steps, same.steps);
      }
      scaled.scale = -2.9;
      const Ray other = trace_one(field, geometry, scaled, P, V, 0.4);
      EXPECT_LT((other.position - trace_one(field, geometry, plain, P, V, 0.4 * -2.9).position).norm(), 1e-12);
      EXPECT_GT((other.position - ray.position).norm(), 0.1);
    }
}

TEST(Bending, EntryExitAndPlateKeepTheOrder) {
  const TensorField field = cube_field(9, linear_tensor);
  for (const double plate_at : {1.5, 0.37}) {  // Behind the volume, and inside.
    const Geometry geometry = geometry_with(field, plate_across(Vector3d(0.1, 0.2, -1), plate_at));
    const auto land = [&](BendingMethod method, double step) -> Eigen::Vector4d {  // Where, and after which length.
      const Ray ray = trace_one(field, geometry, settings_of(method, step), {0.2, -0.1, 2}, {0, 0, -1}, 0.5);
      EXPECT_EQ(ray.end, RayEnd::plate);
      return {ray.position.x(), ray.position.y(), ray.position.z(), ray.length};
    };
    const Eigen::Vector4d exact = land(BendingMethod::rk4, 1.0 / 256);
    const auto order = [&](BendingMethod method, double step) {
      return std::log2((land(method, step) - exact).norm() / (land(method, step / 8) - exact).norm()) / 3;
    };
    EXPECT_NEAR(order(BendingMethod::euler, 0.25), 1, 0.15);
    EXPECT_NEAR(order(BendingMethod::splitting, 0.5), 2, 0.15);
    EXPECT_NEAR(order(BendingMethod::rk4, 1), 4, 0.5);
  }
}

TEST(Bending, AdaptiveMethodsKeepTheirTolerance) {
  const TensorField field = cube_field(17, linear_tensor);
  const Geometry geometry = geometry_with(field, plate_across({0, 0, -1}, 1.5));
  const auto land = [&](BendingMethod method, double tolerance) {
    BendingSettings settings = settings_of(method, 0);
    settings.tolerance = tolerance;
    return trace_one(field, geometry, settings, {0.2, -0.1, 2}, {0, 0, -1}, 2.0);
  };
  const Vector3d exact = land(BendingMethod::dopri5, 1e-12).position;
  for (const BendingMethod method : {BendingMethod::bs23, BendingMethod::dopri5}) {
    double last = 1;
    for (const double tolerance : {1e-3, 1e-5, 1e-7}) {
      const Ray ray = land(method, tolerance);
      const double error = (ray.position - exact).norm() / voxel_size(field);
      // The error of each step is `tolerance` voxels and radians, and the plate is about 20 voxels from the first step.
      EXPECT_LT(error, (1 + 20) * tolerance * ray.steps);
      EXPECT_LT(error, last);
      last = error;
    }
  }
  EXPECT_LT(land(BendingMethod::dopri5, 1e-7).steps, land(BendingMethod::bs23, 1e-7).steps);
}

TEST(Bending, AThinVoxelAcrossTheRayDoesNotShortenItsSteps) {
  // Not zero, because a brick of zeros is crossed in one step.
  const auto weak = [](const Vector3d&) { return Matrix3d(1e-9 * general_tensor()); };
  const TensorField flat(cube_grid({9, 9, 4001}, weak));
  const auto steps = [&](const Vector3d& direction) {
    return trace_one(flat, Geometry(surfaces_of(flat)), {}, -2 * direction, direction, 0.3).steps;
  };
  EXPECT_EQ(steps({1, 0, 0}), 17u);
  EXPECT_NEAR(steps({0, 0, 1}), 8000, 1);
}

TEST(Bending, EveryEndIsToldApart) {
  const TensorField field = constant_field(general_tensor());
  Surfaces surfaces = surfaces_of(field);
  surfaces.plate = plate_across({0, 0, -1}, 3);
  surfaces.plate->size = {1, 1};
  surfaces.obstacles.push_back(box_between({-0.9, -0.9, -0.9}, {-0.6, -0.6, -0.6}));
  const Geometry geometry(std::move(surfaces));
  const auto end = [&](const Vector3d& from, double s, BendingSettings settings = {}) {
    return trace_one(field, geometry, settings, from, {0, 0, -1}, s).end;
  };
  EXPECT_EQ(end({0, 0, 2}, 0), RayEnd::plate);
  EXPECT_EQ(end({0.9, 0, 2}, 0), RayEnd::missed);
  EXPECT_EQ(end({3, 0, 2}, 0), RayEnd::missed);
  EXPECT_EQ(end({-0.75, -0.75, 2}, 0), RayEnd::obstacle);  // Inside the volume.
  BendingSettings few;
  few.max_steps = 3;
  EXPECT_EQ(end({0, 0, 2}, 0, few), RayEnd::step_limit);
  EXPECT_EQ(end({0, 0, 2}, std::nan("")), RayEnd::degenerate);
  EXPECT_EQ(end({0, 0, 2}, 1e308), RayEnd::degenerate);
  // Euler's method, where the field annihilates the direction: V + s h T V = 0.
  const TensorField inwards = constant_field(-Matrix3d::Identity());
  const BendingSettings euler = settings_of(BendingMethod::euler, 0.5);
  EXPECT_EQ(trace_one(inwards, geometry, euler, {0, 0, 2}, {0, 0, -1}, 1 / (0.5 * voxel_size(inwards))).end,
            RayEnd::degenerate);
}

TEST(Bending, ACutActsAsASmallerVolume) {
  const TensorField whole = cube_field(9, linear_tensor);
  const TensorField part = cube_field(9, linear_tensor, Affine3d(Eigen::Scaling(0.5)));
  const auto land = [](const TensorField& field, Surfaces surfaces, const Vector3d& from) {
    surfaces.bounds = surfaces_of(field).bounds;
    surfaces.plate = plate_across({0, 0, -1}, 1.5);
    const BendingSettings settings = settings_of(BendingMethod::rk4, 0.25 * 0.25 / voxel_size(field));
    return trace_one(field, Geometry(std::move(surfaces)), settings, from, {0, 0, -1}, 0.5);
  };
  for (const Vector3d& from : {Vector3d(0.2, -0.1, 2), Vector3d(0.7, 0, 2)}) {
    const Ray cut = land(whole, cut_between(Vector3d::Constant(-0.5), Vector3d::Constant(0.5)), from);
    EXPECT_EQ(cut.end, RayEnd::plate);
    EXPECT_LT((cut.position - land(part, {}, from).position).norm(), 1e-8);
  }
}

TEST(Bending, APlateThatTouchesTheVolumeCatchesLight) {
  const TensorField field = constant_field(general_tensor());
  const Geometry geometry =
      geometry_with(field, plate_across({0, 0, -1}, 1));  // In the plane of the face where light leaves.
  for (int i = 0; i < 100; ++i) {
    const Ray ray = trace_one(field, geometry, {}, {-0.5 + 0.01 * i, 0.003 * i - 0.2, 2}, {0, 0, -1}, 0.1);
    EXPECT_EQ(ray.end, RayEnd::plate);
    EXPECT_NEAR(ray.position.z(), -1, 1e-9);
  }
}

/// To whatever end: it comes back.
TEST(Bending, LightMayStartAnywhere) {
  const TensorField field = constant_field(general_tensor());
  const Geometry geometry = geometry_with(field, plate_across({0, 0, -1}, 2));
  RayBatch batch;
  for (const double far : {3.0, 1e3, 1e6, 1e9}) batch.add({0.3, 0.1, far}, {0, 0, -1}, 0.2);
  for (const double far : {1e12, 1e15, 1e17, 1e19, 1e40, 1e300, double{INFINITY}, double{NAN}})
    for (const Vector3d& from : {Vector3d(0.3, 0.1, far), Vector3d(-far, 0.3 * far, 0.7 * far)})
      batch.add(from, Vector3d(1, -0.3, -0.7).normalized(), 0.2);
  trace(field, geometry, {}, batch);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    EXPECT_EQ(batch.end[i] == RayEnd::degenerate, i >= batch.size() - 4) << i;
    if (i < 4) {
      EXPECT_LT((batch.position[i] - batch.position[0]).norm(), 1e-6);
    }
  }
}

TEST(Bending, RejectsSettingsOutOfRange) {
  const TensorField field = constant_field(general_tensor());
  const Geometry geometry(surfaces_of(field));
  std::vector<BendingSettings> wrong(5);
  wrong[0].step = -1;
  wrong[1].tolerance = 0;
  wrong[2].max_steps = 0;
  wrong[3].scale = std::numeric_limits<double>::infinity();
  wrong[4].max_length = 0;
  RayBatch batch;
  for (const BendingSettings& settings : wrong)
    EXPECT_THROW(trace(field, geometry, settings, batch), std::invalid_argument);
}

// Compares rays through sampled fields with single rays through the analytic stress of a point load, which were
// computed independently.

struct Reference {
  Eigenvalues mode = Eigenvalues::raw;
  Vector3d direction, origin, landing, exit;
  double flexibility = 0, plate = 0;
};

std::filesystem::path reference_file() { return data_folder() / "../reference/point_load_rays.csv"; }

std::vector<Reference> read_references() {
  std::vector<Reference> references;
  std::ifstream file(reference_file());
  std::string line, mode;
  std::getline(file, line);  // The names of the columns.
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream numbers(line);
    Reference& r = references.emplace_back();
    const auto read = [&](Vector3d& v) { numbers >> v.x() >> v.y() >> v.z(); };
    numbers >> mode;
    r.mode = mode == "absolute" ? Eigenvalues::absolute : Eigenvalues::raw;
    read(r.direction);
    numbers >> r.flexibility;
    read(r.origin);
    numbers >> r.plate;
    read(r.landing);
    read(r.exit);
    EXPECT_TRUE(numbers) << line;
  }
  return references;
}

/// −1 ≤ x, y ≤ 1, −2 ≤ z ≤ −0.02, T multiplied by 5, `voxels` along each axis.
TensorField sampled(int voxels, Eigenvalues mode) {
  const auto tensor = [](const Vector3d& p) { return Matrix3d(5 * point_load_stress(p, 1, 0.3)); };
  const Affine3d placement = Eigen::Translation3d(0, 0, -1.01) * Eigen::Scaling(1.0, 1.0, 0.99);
  TensorGrid grid = cube_grid(Vector3i::Constant(voxels), tensor, placement);
  apply_eigenvalues(grid, mode);
  return TensorField(grid);
}

/// How far a ray through the sampled field lands, and leaves, from the reference.
double error_of(const TensorField& field, const Reference& reference) {
  const Plate plate = plate_across(reference.direction, std::abs(reference.plate));
  const BendingSettings settings = settings_of(BendingMethod::rk4, 0.25);
  const Ray ray = trace_one(field, geometry_with(field, plate), settings, reference.origin - reference.direction,
                            reference.direction, reference.flexibility);
  EXPECT_EQ(ray.end, RayEnd::plate);
  return (ray.position - reference.landing).norm() + (ray.direction - reference.exit).norm();
}

TEST(PointLoad, SampledRaysConvergeToTheAnalyticOnesAtSecondOrder) {
  const std::vector<Reference> references = read_references();
  if (references.empty()) GTEST_SKIP() << "no reference rays at " << reference_file();
  ASSERT_EQ(references.size(), 12u);
  for (const Eigenvalues mode : {Eigenvalues::raw, Eigenvalues::absolute}) {
    std::vector<double> errors;  // The greatest error, for each grid.
    for (const int voxels : {41, 81, 161}) {
      const TensorField field = sampled(voxels, mode);
      double& greatest = errors.emplace_back(0);
      for (const Reference& reference : references)
        if (reference.mode == mode) greatest = std::max(greatest, error_of(field, reference));
    }
    EXPECT_LT(errors.back(), 1e-3);
    // Errors fall by a factor of 4 when voxels are halved. In `absolute` an eigenvalue that changes its sign causes a
    // kink, and the errors scatter.
    EXPECT_GT(std::log2(errors.front() / errors.back()) / 2, 1.6) << "errors " << ::testing::PrintToString(errors);
  }
}

}  // namespace
}  // namespace tensorray
