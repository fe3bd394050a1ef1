// Rays in cubic fields of one level and of several: against rays through the formula that the voxels were sampled from,
// several levels against level 0 alone, and packets against the reference.

#include <unsupported/Eigen/MatrixFunctions>

#include "tests/tracing/packet_support.h"
#include "tests/volumes/level_support.h"
#include "tracing/paths/paths.h"
#include "tracing/trace/trace.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

/// Chooses bricks by their middle, in voxels of level 0.
using Place = std::function<bool(const Vector3d&)>;

/// Adds a level to a grid, in the chosen bricks of the level before.
void refine(TensorGrid& grid, const Place& is_refined, const Formula& tensor) {
  const double brick = std::ldexp(8, -static_cast<int>(grid.finer.size()));
  const auto refines = [&](const Vector3i& at) { return is_refined(brick * (at.cast<double>().array() + 0.5)); };
  add_level(grid, grid.active_box(), refines, tensor);
}

/// The box without an octant: an L in each section.
bool in_l(const Vector3d& p) { return (p.array() > 16).count() < 2; }
bool near_corner(const Vector3d& p) { return in_l(p) && (p.array() < 20).all(); }

/// Waves of 24 to 64 voxels, and in finer levels of half and of a quarter of these lengths, too.
Matrix3d waves(const Vector3d& p, int level) {
  static const TensorFunction smooth[] = {smooth_tensor(41), smooth_tensor(42), smooth_tensor(43)};
  Matrix3d T = smooth[0](p);
  if (level > 0) T += 0.3 * smooth[1](2 * p);
  if (level > 1) T += 0.2 * smooth[2](4 * p);
  return T / mean_edge;
}

TensorGrid waves_grid(const AlignedBox3i& box, const Lattice& lattice, int levels) {
  TensorGrid grid =
      dense_grid(box, lattice.to_world, [](const Vector3i& index) { return waves(index.cast<double>(), 0); });
  for (int level = 1; level < levels; ++level)
    refine(grid, level == 1 ? in_l : near_corner, [&](const Vector3d& p) { return waves(p, level); });
  return grid;
}

AlignedBox3i usual_box() { return index_box({0, 0, 0}, {33, 33, 33}); }

/// Of three levels in the usual box, in cubic voxels.
const TensorGrid& usual_grid() {
  static const TensorGrid grid = waves_grid(usual_box(), lattices()[0], 3);
  return grid;
}

TensorField waves_field(const Lattice& lattice) { return placed(usual_grid(), lattice); }

std::vector<Lattice> two_lattices() { return {lattices().front(), lattices().back()}; }

/// Light along axes, diagonals and faces of bricks of all levels, exactly and nearly; and at random.
RayBatch rays_of_all_kinds(const TensorField& field, const std::vector<double>& flexibilities) {
  RayBatch rays = random_rays(field, 24, flexibilities, 49);
  const Vector3d ways[] = {{1, 0, 0}, {0, 1, 0},  {0, 0, -1},   {1, 1, 0},        {0, 1, -1},
                           {1, 1, 1}, {1, -1, 1}, {1, 1e-3, 0}, {1e-3, 1, -1e-3}, {3, 1, 2}};
  for (const Vector3d& way : ways)
    for (const double at : {2.0, 4.0, 8.0, 16.0, 17.3})
      for (const double beside : {0.0, 1e-4})
        add_bundle(rays, field, Vector3d::Constant(at + beside) - 70 * way.normalized(), way, flexibilities);
  return rays;
}

using RaysThroughLevels = EveryInstructionSet;
INSTANTIATE_TEST_SUITE_P(All, RaysThroughLevels, test::instruction_sets(), instruction_set_name);

TEST_P(RaysThroughLevels, PacketsAreTheReference) {
  for (const Lattice& lattice : two_lattices()) {
    const TensorField field = waves_field(lattice);
    ASSERT_EQ(field.levels(), 3);
    const auto expect = [&](double step, double kick, double length) {
      Scene scene = make_scene(lattice.name + ", step " + std::to_string(step) + ", kick " + std::to_string(kick),
                               field, {}, step, rays_of_all_kinds(field, {0.5 * kick, -kick}));
      scene.settings.max_length = length;
      expect_as_exact_as_reference(scene);
    };
    for (const double step : {1.0, 4.0}) expect(step, 0.02, Geometry::infinite);
    for (const double kick : {1e-3, 0.05}) expect(0, kick, Geometry::infinite);
    expect(0, 1, 20 * mean_edge);
  }
}

TEST_P(RaysThroughLevels, OneVoxelAlongAnAxisAndExtentsOfAnySize) {
  for (const Lattice& lattice : two_lattices())
    for (const AlignedBox3i& box :
         {index_box({7, -1, 0}, {1, 30, 20}), index_box({0, 3, 8}, {30, 1, 1}), index_box({-5, -3, -1}, {28, 11, 7})}) {
      TensorField field = cubic_field(waves_grid(box, lattice, 2));
      RayBatch rays = random_rays(field, 24, {0.02, 0.05}, 47);
      expect_as_exact_as_reference(make_scene(lattice.name, std::move(field), {}, 0, std::move(rays)));
    }
}

TEST_P(RaysThroughLevels, SurfacesAndCutsWithinFineBricks) {
  for (const Lattice& lattice : two_lattices())
    for (const bool with_cut : {false, true}) {
      Surfaces surfaces;
      if (with_cut) surfaces.cut = box_mesh({Vector3d(2.3, 3.1, 1.7), Vector3d(30.2, 22.9, 29)}, lattice.to_world);
      surfaces.obstacles.push_back(box_mesh({Vector3d(5.2, 6.3, 5.1), Vector3d(9.1, 9.9, 11.3)}, lattice.to_world));
      TensorField field = waves_field(lattice);
      RayBatch rays = random_rays(field, 48, {0.01, 0.02}, 51);
      expect_as_exact_as_reference(
          make_scene(lattice.name + (with_cut ? ", cut" : ""), std::move(field), surfaces, 0, std::move(rays)));
    }
}

/// Alone, in a batch, and in any order: what becomes of a ray does not depend on the others, nor on threads.
TEST_P(RaysThroughLevels, ARayDoesNotDependOnTheOthers) {
  for (const bool wants_radiance : {false, true}) {
    TensorField field = waves_field(lattices()[2]);
    RayBatch rays = rays_of_all_kinds(field, {0.02, 0.05});
    rays.wants_log_radiance_scale = wants_radiance;
    const Scene scene = make_scene("alone", std::move(field), {}, 0, rays);
    const RayBatch together = traced(scene, rays);
    for (std::size_t i = 0; i < rays.size(); i += 5) expect_identical(scene, together, {i});
  }
}

TEST_P(RaysThroughLevels, DifferentialsAreThoseOfTheReference) {
  TensorField field = waves_field(lattices()[2]);
  RayBatch rays = with_differentials(random_rays(field, 60, {0.03}, 52));
  expect_differentials(make_scene("differentials", std::move(field), {}, 0.5, std::move(rays)), 3e-4);
}

/// Light reaches no end in fields that cannot be followed, but it stops.
TEST_P(RaysThroughLevels, NothingHangs) {
  for (const double value : {double{NAN}, double{INFINITY}, 1e30}) {
    TensorGrid grid = usual_grid();
    grid.finer[0][20].values[100](1, 2) = static_cast<float>(value);
    TensorField field = cubic_field(grid);
    RayBatch rays = rays_of_all_kinds(field, {0.05, 1e30, std::nan("")});
    rays.add({std::nan(""), 0, 0}, Vector3d::UnitX(), 0.1);
    Scene scene = make_scene("bad", std::move(field), {}, 0, rays);
    scene.settings.tolerance = 1e-3;
    const RayBatch ends = traced(scene, rays);
    EXPECT_EQ(ends.end.back(), RayEnd::degenerate);
    for (const std::uint32_t steps : ends.steps) EXPECT_LE(steps, 1001u);
  }
}

/// Level 0 alone, and refined with its own values.
struct Redundant {
  TensorGrid grid = dense_grid(usual_box(), lattices()[0].to_world,
                               [](const Vector3i& index) { return waves(index.cast<double>(), 0); });
  TensorField alone = cubic_field(grid), refined = cubic_field(with_levels());

  TensorGrid with_levels() const {
    TensorGrid all = grid;
    const auto same = [&](const Vector3d& p) { return TensorSampler(alone).at(alone.to_world() * p); };
    refine(all, in_l, same);
    refine(all, near_corner, same);
    return all;
  }
};

TEST(LevelsThatAddNothing, RaysAndDifferentialsAreThoseOfLevelZero) {
  const Redundant fields;
  ASSERT_EQ(fields.refined.levels(), 3);
  const RayBatch plain = random_rays(fields.alone, 60, wavelengths(0.02), 53);
  const std::pair<BendingMethod, double> ways[] = {{BendingMethod::splitting4, 0.25},
                                                   {BendingMethod::rk4, 0.125},
                                                   {BendingMethod::dopri5, 0},
                                                   {BendingMethod::splitting4, 0}};
  for (const RayBatch& rays : {plain, with_differentials(plain)})
    for (const auto& [method, step] : ways) {
      Scene scene = make_scene("alone", fields.alone, {}, step, rays);
      scene.settings.method = method;
      scene.settings.tolerance = 1e-8;
      scene.settings.max_steps = 100000;
      const RayBatch expected = traced_by_reference(scene, rays);
      scene.field = fields.refined;
      const RayBatch exact = traced_by_reference(scene, rays);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(exact.end[i], expected.end[i]);
        EXPECT_LT(distance_in_voxels(exact.position[i], expected.position[i]), 1e-6) << i << ", " << step;
        if (rays.differentials.empty()) continue;
        const double apart = (exact.differentials[i].position - expected.differentials[i].position).norm();
        EXPECT_LT(apart, 1e-5 * expected.differentials[i].position.norm()) << i;
      }
    }
}

/// Each step of a packet rounds to 5e-7 of a voxel, and turns the ray by 1e-7.
TEST(LevelsThatAddNothing, PacketsAreThoseOfLevelZeroUpToRounding) {
  const Redundant fields;
  const RayBatch rays = random_rays(fields.alone, 60, wavelengths(0.02), 53);
  for (const double tolerance : {1e-5, 1e-3}) {
    Scene scene = make_scene("alone", fields.alone, {}, 0, rays);
    scene.settings.tolerance = tolerance;
    const RayBatch expected = traced(scene, rays);
    scene.field = fields.refined;
    const std::vector<double> apart = distances(traced(scene, rays), expected);
    EXPECT_LT(apart[apart.size() / 2], 5e-6 + 0.01 * tolerance);
    EXPECT_LT(apart[apart.size() * 9 / 10], 5e-5 + 0.1 * tolerance);
  }
}

/// Tubes are made of the tensors along paths.
TEST(LevelsThatAddNothing, PathsHaveTheSameTensors) {
  const Redundant fields;
  std::vector<PathSeed> seeds;
  Numbers numbers(54);
  for (int i = 0; i < 20; ++i)
    seeds.push_back({fields.alone.to_world() * numbers.in(fields.alone.index_bounds()), numbers.direction(), 0.02});
  const Geometry geometry(surfaces_of(fields.alone));
  BendingSettings settings = settings_of(BendingMethod::splitting4, 0);
  settings.tolerance = 1e-5;
  const auto paths_in = [&](const TensorField& field) {
    return trace_paths(field, geometry, settings, seeds, PathSettings(), Progress());
  };
  const std::vector<Path> expected = paths_in(fields.alone), paths = paths_in(fields.refined);
  const double greatest = fields.alone.max_norm();
  for (std::size_t i = 0; i < seeds.size(); ++i)
    for (const bool is_last : {false, true}) {
      const auto end_of = [&](const Path& path) { return is_last ? path.points.back() : path.points.front(); };
      const PathPoint a = end_of(expected[i]), b = end_of(paths[i]);
      EXPECT_LT(distance_in_voxels(a.position, b.position), 1e-4);
      EXPECT_LT((a.tensor - b.tensor).norm(), 1e-4 * greatest);
      EXPECT_LT((a.change - b.change).norm(), 1e-4 * 0.02 * greatest);
    }
}

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

constexpr double usual_length = 1, usual_flexibility = 0.6;  // Within the field.

std::vector<Ray> starts() {
  std::vector<Ray> result;
  for (int i = 0; i < 6; ++i)
    result.push_back({Vector3d(-0.4 + 0.15 * i, 0.3 - 0.13 * i, -0.6), Vector3d(0.1 * i - 0.3, 0.1, 1).normalized()});
  return result;
}

BendingSettings settings_for(BendingMethod method, double step) {
  BendingSettings settings = settings_of(method, step);
  settings.max_length = usual_length;
  return settings;
}

std::vector<Ray> true_rays(const TensorFunction& T, const std::vector<Ray>& from = starts()) {
  std::vector<Ray> rays;
  for (const Ray& start : from)
    rays.push_back(through_formula(T, usual_flexibility, start.position, start.direction, usual_length));
  return rays;
}

/// The greatest distance of rays' ends, one unit further along their directions, from those of other rays.
double distance(const TensorField& field, const BendingSettings& settings, const std::vector<Ray>& truth,
                const std::vector<Ray>& from = starts()) {
  const Geometry geometry(surfaces_of(field));
  double greatest = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Ray ray = trace_one(field, geometry, settings, from[i].position, from[i].direction, usual_flexibility);
    const Vector3d apart = ray.position + ray.direction - truth[i].position - truth[i].direction;
    greatest = std::max(greatest, apart.norm());
  }
  return greatest;
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
                              start.position, start.direction, usual_flexibility));
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

/// For constant T, directions are exact at any step length and strength, up to rounding in the voxels.
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
}

/// Smooth, with a bump where the field is refined.
Matrix3d bump(const Vector3d& p) {
  Matrix3d T = 0.6 * std::sin(1.3 * p.x() + 0.5 * p.z()) * general_tensor();
  const Vector3d axis(0.6, -0.48, 0.64);
  return T + 1.2 * std::exp(-8 * (p - Vector3d(0.5, -0.1, 0.1)).squaredNorm()) * axis * axis.transpose();
}

/// The cube [-1, 1]³, refined where x > 0.
TensorField half_refined(int voxels, int levels) {
  TensorGrid grid = cube_grid(Vector3i::Constant(voxels), bump);
  for (int level = 1; level < levels; ++level)
    refine(
        grid, [&](const Vector3d& p) { return p.x() > (voxels - 1) / 2; },
        [&](const Vector3d& p) { return bump(grid.to_world * p); });
  return cubic_field(grid);
}

/// Rays within the refined half, or across the face between the halves.
std::vector<Ray> rays_of_halves(bool cross) {
  std::vector<Ray> rays;
  for (int i = cross; i < 12; i += 2) {
    const Vector3d from = cross ? Vector3d(-0.5, -0.4 + 0.07 * i, 0.1) : Vector3d(0.35 + 0.03 * i, -0.1, -0.5);
    rays.push_back({from, Vector3d(cross ? 1 : 0.02 * i, 0.1, cross ? 0.03 * i : 1).normalized()});
  }
  return rays;
}

TEST(LevelsOfAFormula, ErrorsAreOfOrderFourInTheLocalVoxel) {
  for (const bool cross : {false, true}) {
    const std::vector<Ray> from = rays_of_halves(cross), truth = true_rays(bump, from);
    const auto error = [&](int voxels, int levels) {
      const BendingSettings settings = settings_for(BendingMethod::splitting4, 0.25);
      return distance(half_refined(voxels, levels), settings, truth, from);
    };
    const double half = error(17, 2);
    EXPECT_GT(std::log2(half / error(33, 2)), 3) << cross;
    if (cross) continue;
    EXPECT_GT(std::log2(error(17, 1) / half), 3);
    EXPECT_GT(std::log2(half / error(17, 3)), 3);
    EXPECT_LT(half, 2 * error(33, 1)) << "as voxels of this size everywhere";
  }
}

/// Steps are long where voxels are coarse, and pass over nothing where they are fine: behind the face there is a sheet
/// of few fine voxels.
TEST(LevelsOfAFormula, StepsFollowTheVoxels) {
  const Matrix3d weak = 0.02 * general_tensor() / mean_edge;
  const auto sheet = [&](const Vector3d& p) {
    Matrix3d T = weak;
    T(1, 0) += std::exp(-2 * std::pow(p.x() - 34, 2)) / mean_edge;
    return T;
  };
  const auto field_of_levels = [&](const Place& is_refined) {
    TensorGrid grid =
        dense_grid(index_box({0, 0, 0}, {65, 17, 17}), lattices()[0].to_world, [&](const Vector3i&) { return weak; });
    for (int level = 0; level < 2; ++level) refine(grid, is_refined, sheet);
    return cubic_field(grid);
  };
  const TensorField all = field_of_levels([](const Vector3d&) { return true; });
  const TensorField some = field_of_levels([](const Vector3d& p) { return p.x() > 32 && p.x() < 40; });
  RayBatch rays;
  for (int i = 0; i < 50; ++i) add_bundle(rays, all, {-1 - 0.13 * i, 8, 4 + 0.1 * i}, {1, 0.01, 0}, {0.1, 0.3});
  Scene scene = make_scene("all", all, {}, 0, rays);
  scene.settings.tolerance = 1e-3;
  const RayBatch expected = traced(scene, rays);
  scene.field = some;
  const RayBatch fast = traced(scene, rays), exact = traced_by_reference(scene, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_LT(distance_in_voxels(fast.position[i], expected.position[i]), 0.02) << i;
    EXPECT_LT(distance_in_voxels(exact.position[i], expected.position[i]), 0.02) << i;
  }
  EXPECT_LT(1.5 * static_cast<double>(fast.tensor_samples), static_cast<double>(expected.tensor_samples));
  EXPECT_LT(1.5 * static_cast<double>(exact.tensor_samples), static_cast<double>(expected.tensor_samples));
}

}  // namespace
}  // namespace tensorray
