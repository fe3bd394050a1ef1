#include "tracing/paths/paths.h"

#include "tests/tracing/packet_support.h"
#include "tests/tracing/path_support.h"
#include "tracing/paths/path_thinning.h"
#include "tracing/steps/scalar_tracer.h"
#include "tracing/trace/trace.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

PathSettings everything() {
  PathSettings settings;
  settings.tolerance = settings.tensor_tolerance = 0;
  return settings;
}

Path trace_one_path(const TensorField& field, const PathSeed& seed, const PathSettings& settings = {},
                    const BendingSettings& bending = {}, Surfaces surfaces = {}) {
  surfaces.bounds = surfaces_of(field).bounds;
  return trace_paths(field, Geometry(std::move(surfaces)), bending, {seed}, settings, Progress()).at(0);
}

PathSeed seed_at(const Vector3d& position, double flexibility = 0.5, const Vector3d& direction = {0, 0, -1}) {
  return {position, direction.normalized(), flexibility};
}

/// The greatest distance of one of `points` from the polyline `other`.
double distance(const PathPoints& points, const PathPoints& other) {
  double greatest = 0;
  for (const PathPoint& point : points) {
    double least = INFINITY;
    for (std::size_t i = 1; i < other.size(); ++i) {
      const Vector3d &a = other[i - 1].position, side = other[i].position - a, way = point.position - a;
      const double t = std::clamp(way.dot(side) / side.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (t * side - way).norm());
    }
    greatest = std::max(greatest, least);
  }
  return greatest;
}

TEST(Paths, AnIsotropicFieldGivesStraightPathsOfTwoPoints) {
  const TensorField field = constant_field(3 * Matrix3d::Identity());
  const Vector3d V = Vector3d(0.1, -0.2, -1).normalized();
  const Path path = trace_one_path(field, seed_at({0.1, 0.2, 2}, 0.5, V));
  ASSERT_EQ(path.points.size(), 2u);
  EXPECT_NEAR(path.points[0].position.z(), 1, 1e-12);
  EXPECT_NEAR(path.points[1].position.z(), -1, 1e-9);
  EXPECT_EQ(path.points[0].length, 0);
  EXPECT_NEAR(path.points[1].length, 2 / -V.z(), single_precision);
  for (const PathPoint& point : path.points) {
    EXPECT_LT((point.direction - V).norm(), single_precision);
    EXPECT_LT((point.force() - 3 * V).norm(), 1e-6);
    EXPECT_LT(point.change.norm(), 1e-12);
  }
}

/// Packets take the steps of the reference, in single precision.
TEST(Paths, RecordsTheStepsOfTheReference) {
  const TensorField field = cube_field(33, linear_tensor);
  Surfaces surfaces = surfaces_of(field);
  surfaces.plate = plate_across({0, 0, -1}, 1.5);
  surfaces.obstacles.push_back(box_between({0.3, -1, -0.6}, {1, 1, -0.2}));
  const Geometry geometry(std::move(surfaces));
  RayBatch batch;
  for (int i = 0; i < 40; ++i) batch.add({0.05 * i - 1, 0.3, i % 4 == 0 ? 0.2 : 2.0}, {0, 0, -1}, 0.02 * i);
  const RayBatch starts = batch;
  const BendingSettings settings;
  RayBatch plain = batch;
  std::vector<RayRecord> records;
  trace(field, geometry, settings, batch, &records);
  trace(field, geometry, settings, plain);
  int on_obstacle = 0;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    EXPECT_EQ(plain.position[i], batch.position[i]) << "recorded rays are the same";
    PathPoints expected;
    Tracer<1> reference(field, geometry, settings);
    const RayEnd end = reference.trace({starts.position[i], starts.direction[i], 0}, starts.flexibility[i], &expected);
    ASSERT_EQ(batch.end[i], end);
    on_obstacle += end == RayEnd::obstacle;
    const PathPoints points = points_of(field, records[i]);
    ASSERT_EQ(points.size(), expected.size()) << i;
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_EQ(points[k].in_field, expected[k].in_field);
      EXPECT_LT((points[k].position - expected[k].position).norm(), 10 * single_precision);
      EXPECT_LT((points[k].direction - expected[k].direction).norm(), 10 * single_precision);
      EXPECT_NEAR(points[k].direction.norm(), 1, 1e-12);
      EXPECT_NEAR(points[k].length, expected[k].length, 10 * single_precision);
    }
  }
  EXPECT_GT(on_obstacle, 5);
}

TEST(Paths, PointsCarryTheTensorAndTheCurvature) {
  const TensorField field = cube_field(9, linear_tensor);
  const double s = 0.7;
  BendingSettings settings = settings_of(BendingMethod::rk4, 1.0 / 32);
  settings.scale = -2.5;  // The tensors of the points do not contain the scale.
  const Path path = trace_one_path(field, seed_at({0.2, -0.1, 2}, s / settings.scale), everything(), settings);
  ASSERT_GT(path.points.size(), 100u);
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    const PathPoint& point = path.points[i];
    const Matrix3d T = linear_tensor(point.position);
    const Vector3d V = point.direction;
    EXPECT_LT((point.tensor - T).norm(), 1e-6);
    EXPECT_LT((point.force() - T * V).norm(), 1e-6);
    EXPECT_LT((point.change - s * (T * V - V.dot(T * V) * V)).norm(), 1e-6);
    if (i == 0 || i + 2 >= path.points.size()) continue;
    // The curvature of the polyline itself: the error of a central difference with h = 1/128 is h² |V'''| / 6, about
    // 1e-5 · 10.
    const PathPoint &before = path.points[i - 1], &behind = path.points[i + 1];
    const Vector3d measured = (behind.direction - before.direction) / (behind.length - before.length);
    EXPECT_LT((measured - point.change).norm(), 2e-4);
  }
}

TEST(Paths, BackwardsAndForwardsIsThePathFromItsStart) {
  const TensorField field = cube_field(17, linear_tensor);
  const BendingSettings bending = settings_of(BendingMethod::rk4, 0.125);
  for (const double s : {0.8, -0.8}) {
    const Path whole = trace_one_path(field, seed_at({0.2, -0.1, 2}, s), everything(), bending);
    for (const double fraction : {0.0, 0.3, 0.5, 0.9}) {
      const PathPoint& middle = whole.points[static_cast<std::size_t>(fraction * double(whole.points.size()))];
      const Path joined = trace_one_path(field, seed_at(middle.position, s, middle.direction), everything(), bending);
      // rk4's error is far below the chords' h² |V'| / 8 = 1e-4.
      EXPECT_LT(distance(joined.points, whole.points), 3e-4);
      EXPECT_LT(distance(whole.points, joined.points), 3e-4);
      EXPECT_LT((joined.points.front().position - whole.points.front().position).norm(), 1e-5);
      EXPECT_LT((joined.points.front().direction - whole.points.front().direction).norm(), 1e-5);
      EXPECT_LT((joined.points.back().position - whole.points.back().position).norm(), 1e-5);
      EXPECT_NEAR(joined.points.back().length, whole.points.back().length, 1e-5);
      for (std::size_t i = 1; i < joined.points.size(); ++i) {
        EXPECT_GT(joined.points[i].length, joined.points[i - 1].length);
        EXPECT_GT(joined.points[i].direction.dot(joined.points[i - 1].direction), 0.9);
      }
    }
  }
}

TEST(Paths, WithoutTensorsFewerPointsHaveTheSamePositions) {
  const TensorField field =
      cube_field(65, [](const Vector3d& p) { return Matrix3d(std::exp(2 * p.z()) * linear_tensor(p)); });
  const PathSeed seed = seed_at({0.2, -0.1, 0.3}, 0.1);
  PathSettings settings;
  const Path with = trace_one_path(field, seed, settings), all = trace_one_path(field, seed, everything());
  settings.tensors = false;
  const Path without = trace_one_path(field, seed, settings);
  EXPECT_LT(without.points.size(), with.points.size());
  EXPECT_GT(without.points.size(), 3u);
  EXPECT_LE(distance(all.points, without.points), settings.tolerance * voxel_size(field));
  for (const PathPoint& point : without.points) EXPECT_TRUE(point.tensor.isZero(0) && point.change.isZero(0));
}

TEST(Paths, KeepsTheStraightPartsOnRequestAndSeparatesTheFaces) {
  const TensorField field = constant_field(general_tensor());
  Surfaces surfaces;
  surfaces.plate = plate_across({0, 0, -1}, 1.5);
  PathSettings settings;
  const Path inside = trace_one_path(field, seed_at({0, 0, 2}), settings, {}, surfaces);
  settings.outside = true;
  const Path whole = trace_one_path(field, seed_at({0, 0, 2}), settings, {}, surfaces);
  EXPECT_EQ(inside.end, RayEnd::plate);
  EXPECT_EQ(inside.backward_end, RayEnd::missed);
  for (const PathPoint& point : inside.points) EXPECT_TRUE(point.in_field);
  ASSERT_EQ(whole.points.size(), inside.points.size() + 4);
  const PathPoints& points = whole.points;
  const auto straight = [](const PathPoint& p) { return !p.in_field && p.tensor.isZero() && p.change.isZero(); };
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}, points.size() - 2, points.size() - 1})
    EXPECT_TRUE(straight(points[i])) << i;
  EXPECT_NEAR(points[0].position.z(), 2, 1e-12);
  EXPECT_NEAR(points[2].position.z(), 1, 1e-12);
  EXPECT_NEAR(points.back().position.z(), -1.5, 1e-9);
  const double gap = settings.tolerance * voxel_size(field);
  EXPECT_GT(points[2].length - points[1].length, 0);
  EXPECT_LT(points[2].length - points[1].length, gap);
  EXPECT_LT(points[points.size() - 2].length - points[points.size() - 3].length, gap);
}

TEST(Paths, ACutLeavesAStraightPieceWithin) {
  const TensorField field = constant_field(general_tensor());
  Surfaces surfaces;
  // Two boxes, so that light leaves one and enters the other.
  surfaces.cut = joined({box_between({-2, -2, 0.4}, {2, 2, 0.8}), box_between({-2, -2, -0.8}, {2, 2, -0.4})});
  const Path path = trace_one_path(field, seed_at({0, 0, 2}, 0.1), {}, {}, surfaces);
  ASSERT_GT(path.points.size(), 5u);
  EXPECT_NEAR(path.points.front().position.z(), 0.8, 1e-9);
  EXPECT_NEAR(path.points.back().position.z(), -0.8, 1e-9);
  int straight = 0;
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    EXPECT_TRUE(i == 0 || path.points[i].length > path.points[i - 1].length);
    EXPECT_EQ(path.points[i].in_field, std::abs(path.points[i].position.z()) > 0.4 - 1e-9);
    straight += !path.points[i].in_field;
  }
  EXPECT_EQ(straight, 2);
}

TEST(Paths, OnePathASeedInTheirOrder) {
  const TensorField field = cube_field(9, linear_tensor);
  const Geometry geometry(surfaces_of(field));
  std::vector<PathSeed> seeds;
  for (int i = 0; i < 50; ++i) seeds.push_back(seed_at({0.05 * i - 1.2, 0.1, 2}, 0.01 * i));
  PathSettings settings;
  settings.backwards = false;
  const std::vector<Path> paths = trace_paths(field, geometry, {}, seeds, settings, Progress());
  ASSERT_EQ(paths.size(), seeds.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    EXPECT_EQ(paths[i].flexibility, seeds[i].flexibility);
    EXPECT_FALSE(paths[i].backward_end.has_value());
    EXPECT_EQ(paths[i].end, RayEnd::missed);
    const bool meets = std::abs(seeds[i].position.x()) < 1;
    ASSERT_EQ(paths[i].points.size() >= 2, meets);
    if (!meets) continue;
    EXPECT_NEAR(paths[i].points[0].position.x(), seeds[i].position.x(), 1e-12);
  }
}

TEST(Paths, StopsWhenCancelledAndRefusesNegativeTolerances) {
  const TensorField field = constant_field(general_tensor());
  const Geometry geometry(surfaces_of(field));
  Progress progress;
  progress.cancelled = true;
  EXPECT_THROW(trace_paths(field, geometry, {}, {seed_at({0, 0, 2})}, {}, progress), Cancelled);
  std::vector<PathSettings> wrong(2);
  wrong[0].tolerance = -1;
  wrong[1].tensor_tolerance = NAN;
  for (const PathSettings& settings : wrong)
    EXPECT_THROW(trace_paths(field, geometry, {}, {}, settings, Progress()), std::invalid_argument)
        << settings.tolerance << " " << settings.tensor_tolerance;
}

class PathThinning : public EveryInstructionSet {};
INSTANTIATE_TEST_SUITE_P(All, PathThinning, instruction_sets(), instruction_set_name);

/// A ray that was traced from a seed within the field, in both directions.
struct TracedBothWays {
  TensorField field;
  std::vector<RayRecord> back, on;
  JoinedRay ray;
};

TracedBothWays bent_ray(double flexibility) {
  const TensorFunction smooth = smooth_tensor(3);
  const auto strong = [&](const Vector3d& p) { return Matrix3d(smooth(p) + 0.2 * Matrix3d::Identity()); };
  TracedBothWays traced{lattice_field(odd_box(), lattices()[2], strong), {}, {}, {}};
  const BendingSettings settings = settings_of(BendingMethod::splitting4, 0.5);  // In packets, with many points.
  for (const double sign : {1.0, -1.0}) {
    RayBatch batch;
    batch.add(traced.field.to_world() * Vector3d(3, 20, 5), sign * Vector3d(0.3, -0.2, 1).normalized(),
              sign * flexibility);
    trace(traced.field, Geometry(surfaces_of(traced.field)), settings, batch, sign > 0 ? &traced.on : &traced.back);
  }
  join(traced.field, traced.back[0], traced.on[0], traced.ray);
  return traced;
}

/// The error of each point between two that stay, in the tolerances' units, in double precision.
TEST_P(PathThinning, KeepsItsTolerances) {
  for (const double flexibility : {0.05, 0.2, 0.8}) {
    const TracedBothWays traced = bent_ray(flexibility);
    PathPoints points;
    for (const JoinedPoint& joined : traced.ray.points) {
      points.push_back(joined.point);
      for (std::size_t i = 0; i < joined.steps.count; ++i)
        points.push_back(path_point(traced.field, traced.ray, joined.steps, i));
    }
    PathSamples samples;
    sample_path(traced.field, traced.ray, true, samples);
    const std::vector<std::size_t> chosen = thinned(samples, 0.05, 0.02);
    EXPECT_LT(chosen.size(), points.size() / 2);
    TensorSampler sampler(traced.field);
    const auto tensor = [&](const PathPoint& p) {
      return p.in_field ? Matrix3d(sampler.at(p.position)) : Matrix3d::Zero();
    };
    for (std::size_t n = 1; n < chosen.size(); ++n)
      for (std::size_t k = chosen[n - 1] + 1; k < chosen[n]; ++k) {
        const PathPoint &a = points[chosen[n - 1]], &b = points[chosen[n]], &p = points[k];
        const double t = (p.length - a.length) / (b.length - a.length);
        const Matrix3d from = tensor(a), to = tensor(b), here = tensor(p);
        EXPECT_LT((a.position + t * (b.position - a.position) - p.position).norm(), 1.001 * 0.05 * mean_edge);
        EXPECT_LT((from + t * (to - from) - here).norm(),
                  1.001 * 0.02 * std::max({from.norm(), to.norm(), here.norm()}));
      }
  }
}

}  // namespace
}  // namespace tensorray
