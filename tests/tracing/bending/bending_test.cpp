#include "tracing/bending/bending.h"

#include <fstream>
#include <map>
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

constexpr BendingMethod all_methods[] = {BendingMethod::euler, BendingMethod::splitting, BendingMethod::rk4,
                                         BendingMethod::bs23, BendingMethod::dopri5};

Matrix3d rotation_about(const Vector3d& axis) {
  Matrix3d T;
  T << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  return T;
}

/// V(t) = normalize(exp(s T t) V₀), and P(t) by composite Gauss–Legendre quadrature: the exact path for constant T.
Ray exact_path(const Matrix3d& T, double s, const Vector3d& P, const Vector3d& V, double t) {
  const auto direction = [&](double at) -> Vector3d { return (Matrix3d((s * at * T).exp()) * V).normalized(); };
  const double nodes[3] = {-std::sqrt(0.6), 0, std::sqrt(0.6)}, weights[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  Vector3d position = P;
  constexpr int pieces = 400;
  for (int i = 0; i < pieces; ++i)
    for (int k = 0; k < 3; ++k) position += t / pieces * weights[k] * direction((i + 0.5 + nodes[k] / 2) * t / pieces);
  return {position, direction(t)};
}

std::vector<Matrix3d> constant_tensors() {
  const Matrix3d general = general_tensor();
  Matrix3d shear = Matrix3d::Zero();
  shear(0, 2) = 2;
  return {Vector3d(1.5, -0.75, 0.25).asDiagonal().toDenseMatrix(), general + general.transpose(), general,
          rotation_about({1, -2, 0.5}), shear};
}

TEST(Bending, ZeroAndIsotropicFieldsLeaveLightStraight) {
  for (const double c : {0.0, 3.0}) {
    const TensorField field = constant_field(c * Matrix3d::Identity());
    const Geometry geometry = geometry_with(field, plate_across({0, 0, -1}, 2));
    for (const BendingMethod method : all_methods) {
      const Vector3d V = Vector3d(0.1, -0.2, -1).normalized();
      const Ray ray = trace_one(field, geometry, settings_of(method, 0), {0.3, 0.1, 3}, V, 0.3);
      EXPECT_EQ(ray.end, RayEnd::plate);
      EXPECT_LT((ray.position - (Vector3d(0.3, 0.1, 3) + 5 / -V.z() * V)).norm(), 1e-12);
      EXPECT_LT((ray.direction - V).norm(), 1e-14);
    }
  }
}

TEST(Bending, SplittingIsExactInDirectionForConstantTensorsAtAnyStep) {
  const Vector3d P(-0.2, 0.1, 0.3), V = Vector3d(0.3, -0.4, 1).normalized();
  for (const Matrix3d& T : constant_tensors())
    for (const double step : {0.1, 0.5, 2.0}) {
      const TensorField field = constant_field(T);
      const double h = step * voxel_size(field);
      const Ray ray = trace_steps(field, settings_of(BendingMethod::splitting, step), 1, P, V, 0.8);
      EXPECT_LT((ray.direction - exact_path(T, 0.8, P, V, h).direction).norm(), 2e-12) << T << "\nstep " << step;
    }
}

/// Λ of light of constant T: L_end / L_start = |M V₀|³ / det M with M = exp(s ℓ T), and −Λ is its logarithm.
TEST(Bending, PathsAndRadianceOfConstantTensorsHaveTheirClosedForms) {
  const Vector3d P(-0.2, 0.1, -0.5), V = Vector3d(0.3, -0.4, 1).normalized();
  const double s = 0.5;
  for (const Matrix3d& T : constant_tensors()) {
    const TensorField field = constant_field(T);
    const auto expect_errors = [&](BendingMethod method, double step, double of_path, double of_radiance) {
      BendingSettings settings = settings_of(method, step);
      settings.max_steps = static_cast<int>(4 / step);
      RayBatch rays;
      rays.wants_log_radiance_scale = true;
      rays.add(P, V, s);
      trace_reference(field, Geometry(surfaces_of(field)), settings, rays);
      EXPECT_EQ(rays.end[0], RayEnd::step_limit);
      const Ray exact = exact_path(T, s, P, V, 4 * voxel_size(field));
      EXPECT_LT((rays.position[0] - exact.position).norm() + (rays.direction[0] - exact.direction).norm(), of_path);
      const Matrix3d M = Matrix3d(s * rays.length[0] * T).exp();
      const double change = std::log(std::pow((M * V).norm(), 3) / M.determinant());
      EXPECT_NEAR(rays.log_radiance_scale[0], -change, of_radiance);
    };
    // ‖s T h‖ is about 0.02, and Λ at most 1. The error is the former to the power of the order, times the path's
    // length and a constant.
    expect_errors(BendingMethod::euler, 1.0 / 16, 0.04, 0.04);
    expect_errors(BendingMethod::splitting, 1.0 / 16, 4e-4, 1e-11);  // Every step has the exact direction.
    expect_errors(BendingMethod::splitting, 1, INFINITY, 1e-11);
    expect_errors(BendingMethod::rk4, 1.0 / 16, 1e-7, 1e-7);
  }
}

TEST(Bending, PathsAreRetracedWithTheOppositeSign) {
  const TensorField field = cube_field(9, linear_tensor);
  const Vector3d P(-0.3, 0.2, -0.6), V = Vector3d(0.1, 0.2, 1).normalized();
  const auto there_and_back = [&](BendingMethod method, double back) {
    const BendingSettings settings = settings_of(method, 0.25);
    const Ray there = trace_steps(field, settings, 16, P, V, 0.5);
    return (trace_steps(field, settings, 16, there.position, -there.direction, back).position - P).norm();
  };
  for (const BendingMethod symmetric :
       {BendingMethod::splitting, BendingMethod::splitting4})  // Exact but for rounding.
    EXPECT_LT(there_and_back(symmetric, -0.5), 1e-10);
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
    const auto land = [&](BendingMethod method, double step) {
      const Ray ray = trace_one(field, geometry, settings_of(method, step), {0.2, -0.1, 2}, {0, 0, -1}, 0.5);
      EXPECT_EQ(ray.end, RayEnd::plate);
      return ray.position;
    };
    const Vector3d exact = land(BendingMethod::rk4, 1.0 / 256);
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
}

TEST(Bending, EulerEndsWhereTheFieldAnnihilatesTheDirection) {
  const TensorField field = constant_field(-Matrix3d::Identity());
  const BendingSettings settings = settings_of(BendingMethod::euler, 0.5);
  const double s = 1 / (0.5 * voxel_size(field));  // V + s h T V = 0.
  EXPECT_EQ(trace_one(field, Geometry(surfaces_of(field)), settings, {0, 0, 2}, {0, 0, -1}, s).end, RayEnd::degenerate);
}

TEST(Bending, ACutActsAsASmallerVolume) {
  const Eigen::AlignedBox3d inner(Vector3d(-0.5, -0.5, -0.5), Vector3d(0.5, 0.5, 0.5));
  const TensorField whole = cube_field(9, linear_tensor);
  Eigen::Affine3d half = Eigen::Affine3d::Identity();
  half.linear() *= 0.5;
  const TensorField part = cube_field(9, linear_tensor, half);

  const auto land = [](const TensorField& field, std::optional<TriangleMesh> cut, const Vector3d& from) {
    Surfaces surfaces = surfaces_of(field);
    surfaces.cut = std::move(cut);
    surfaces.plate = plate_across({0, 0, -1}, 1.5);
    return trace_one(field, Geometry(std::move(surfaces)),
                     settings_of(BendingMethod::rk4, 0.25 * 0.25 / voxel_size(field)), from, {0, 0, -1}, 0.5);
  };
  for (const Vector3d& from : {Vector3d(0.2, -0.1, 2), Vector3d(0.7, 0, 2)}) {
    const Ray cut = land(whole, box_mesh(inner, Eigen::Affine3d::Identity()), from);
    EXPECT_EQ(cut.end, RayEnd::plate);
    EXPECT_LT((cut.position - land(part, std::nullopt, from).position).norm(), 1e-8);
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
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    std::string cell;
    std::getline(cells, cell, ',');
    Reference r;
    r.mode = cell == "absolute" ? Eigenvalues::absolute : Eigenvalues::raw;
    std::vector<double> v;
    while (std::getline(cells, cell, ',')) v.push_back(std::stod(cell));
    r.direction = {v[0], v[1], v[2]};
    r.flexibility = v[3];
    r.origin = {v[4], v[5], v[6]};
    r.plate = v[7];
    r.landing = {v[8], v[9], v[10]};
    r.exit = {v[11], v[12], v[13]};
    references.push_back(r);
  }
  return references;
}

/// −1 ≤ x, y ≤ 1, −2 ≤ z ≤ −0.02, T multiplied by 5, `voxels` along each axis.
TensorField sampled(int voxels, Eigenvalues mode) {
  const Vector3d min(-1, -1, -2), max(1, 1, -0.02);
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  to_world.linear() = ((max - min) / (voxels - 1)).asDiagonal();
  to_world.translation() = min;
  TensorGrid grid = dense_grid({Eigen::Vector3i::Zero(), Eigen::Vector3i::Constant(voxels - 1)}, to_world,
                               [&](const Eigen::Vector3i& index) {
                                 return Eigen::Matrix3d(5 * point_load_stress(to_world * index.cast<double>(), 1, 0.3));
                               });
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
  std::map<Eigenvalues, std::vector<double>> errors;  // The greatest error, by mode, for each grid.
  for (const Eigenvalues mode : {Eigenvalues::raw, Eigenvalues::absolute})
    for (const int voxels : {41, 81, 161}) {
      const TensorField field = sampled(voxels, mode);
      double greatest = 0;
      for (const Reference& reference : references)
        if (reference.mode == mode) greatest = std::max(greatest, error_of(field, reference));
      errors[mode].push_back(greatest);
    }
  for (const auto& [mode, by_grid] : errors) {
    EXPECT_LT(by_grid.back(), 1e-3);
    // Errors fall by a factor of 4 when voxels are halved. In `absolute` an eigenvalue that changes its sign causes a
    // kink, and the errors scatter.
    EXPECT_GT(std::log2(by_grid.front() / by_grid.back()) / 2, 1.6) << "errors " << ::testing::PrintToString(by_grid);
  }
}

}  // namespace
}  // namespace tensorray
