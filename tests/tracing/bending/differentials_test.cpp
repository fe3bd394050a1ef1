// Ray differentials against finite differences of the rays themselves, and against closed forms.

#include "tests/tracing/support.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

/// The start of a ray as a function of two parameters: its position moves across, and its direction turns.
struct Start {
  Vector3d position, direction, across[2];
  double turn = 0;  // Radians per unit of either parameter.

  Vector3d position_at(double u, double v) const { return position + u * across[0] + v * across[1]; }
  Vector3d direction_at(double u, double v) const {
    return (direction + turn * (u * across[0] + v * across[1])).normalized();
  }
};

Start make_start(const Vector3d& position, const Vector3d& direction, double turn) {
  Start start{position, direction.normalized(), {}, turn};
  start.across[0] = upright(start.direction, Vector3d::UnitX());
  start.across[1] = start.direction.cross(start.across[0]);
  return start;
}

/// One ray with its derivatives along the two axes across its direction.
RayBatch trace_with_differential(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                                 const Start& start, double flexibility) {
  RayBatch batch;
  batch.add(start.position, start.direction, flexibility);
  RayDifferential differential;
  for (int i = 0; i < 2; ++i) {
    differential.position.col(i) = start.across[i];
    differential.direction.col(i) = start.turn * start.across[i];
  }
  batch.differentials.push_back(differential);
  trace_reference(field, geometry, settings, batch);
  return batch;
}

/// Central differences of the rays' ends.
RayDifferential finite_differences(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                                   const Start& start, double flexibility, double delta, RayEnd end = RayEnd::plate) {
  RayDifferential result;
  for (int i = 0; i < 2; ++i) {
    const auto side = [&](double d) {
      const double u = i == 0 ? d : 0, v = i == 1 ? d : 0;
      return trace_one(field, geometry, settings, start.position_at(u, v), start.direction_at(u, v), flexibility);
    };
    const Ray above = side(delta), below = side(-delta);
    for (const Ray& ray : {above, below}) EXPECT_EQ(ray.end, end);
    result.position.col(i) = (above.position - below.position) / (2 * delta);
    result.direction.col(i) = (above.direction - below.direction) / (2 * delta);
  }
  return result;
}

void expect_equal(const RayDifferential& a, const RayDifferential& b, double tolerance) {
  for (int i = 0; i < 2; ++i) {
    const double position = b.position.col(i).norm(), direction = b.direction.col(i).norm();
    EXPECT_LT((a.position - b.position).col(i).norm(), tolerance * position) << a.position << "\n" << b.position;
    EXPECT_LT((a.direction - b.direction).col(i).norm(), tolerance * (direction + 0.1 * position))
        << a.direction << "\n"
        << b.direction;
  }
}

class RayDifferentials : public ::testing::TestWithParam<BendingMethod> {
 protected:
  // Linear in position, so that interpolation is exact and has no kinks at the faces of cells.
  const TensorField field_ = cube_field(17, linear_tensor);
  const Vector3d direction_ = Vector3d(0.2, -0.3, -1).normalized();
  const Start outside_ = make_start(Vector3d(0.1, 0.2, 2), direction_, 0.3);

  // Differentials are the derivatives of the steps. They are exact between surfaces; at a surface they have the
  // method's order.
  BendingSettings settings() const {
    BendingSettings settings = settings_of(GetParam(), GetParam() == BendingMethod::euler ? 1.0 / 128 : 0.25);
    settings.tolerance = 1e-7;
    return settings;
  }
  double tolerance() const { return GetParam() == BendingMethod::euler ? 1e-2 : 2e-3; }

  void expect_finite_differences(const Geometry& geometry, const Start& start, double flexibility) {
    const RayBatch traced = trace_with_differential(field_, geometry, settings(), start, flexibility);
    ASSERT_EQ(traced.end[0], RayEnd::plate);
    const Ray alone = trace_one(field_, geometry, settings(), start.position, start.direction, flexibility);
    EXPECT_LT((traced.position[0] - alone.position).norm(), 1e-9) << "differentials must not change the ray";
    expect_equal(traced.differentials[0], finite_differences(field_, geometry, settings(), start, flexibility, 1e-4),
                 tolerance());
  }
};

TEST_P(RayDifferentials, MatchFiniteDifferences) {
  Surfaces behind = surfaces_of(field_), tilted = behind;
  behind.plate = plate_across(direction_, 3);
  tilted.plate = plate_across(Vector3d(0.5, 0.1, -1), 0.4);  // Inside the volume.
  Surfaces cut = behind;
  const Affine3d turned(Eigen::AngleAxisd(0.5, Vector3d(1, 2, 3).normalized()));
  cut.cut = box_between(Vector3d::Constant(-0.5), Vector3d::Constant(0.5), turned);
  for (const Surfaces& surfaces : {behind, tilted, cut}) expect_finite_differences(Geometry(surfaces), outside_, 0.5);
  expect_finite_differences(Geometry(behind), make_start({0.1, 0.05, 0.3}, direction_, 0), -0.5);
}

INSTANTIATE_TEST_SUITE_P(EveryMethod, RayDifferentials,
                         ::testing::Values(BendingMethod::euler, BendingMethod::splitting, BendingMethod::splitting4,
                                           BendingMethod::rk4, BendingMethod::bs23, BendingMethod::dopri5));

/// T = diag(a, b, 0): light along the z axis stays on it, and a beam near the axis spreads by δV' = s diag(a, b) δV.
/// For parallel light δV begins at 0, so that it stays parallel. A beam that is not parallel is magnified.
TEST(RayDifferential, ParallelLightAlongAnEigenvectorStaysParallel) {
  const TensorField field = constant_field(Vector3d(0.75, -0.5, 0).asDiagonal());
  const Geometry geometry = geometry_with(field, plate_across(-Vector3d::UnitZ(), 2));
  for (const double turn : {0.0, 0.1}) {
    const Start start = make_start({0, 0, 2}, -Vector3d::UnitZ(), turn);
    const RayBatch spread = trace_with_differential(field, geometry, {}, start, 1);
    // Within the volume, of depth 2, turns grow by exp(0.75 · 2) along x and by exp(-0.5 · 2) along y. The former moves
    // the ray sideways by the turn times ∫ exp(0.75 t) dt. The light is straight for one unit before the volume and for
    // one unit behind it. The error of the drift, with a step of ½ voxel (1/8), is of second order: h²/24 times the
    // integral of the second derivative.
    const double expected = 1 + turn * (1 + (std::exp(1.5) - 1) / 0.75 + std::exp(1.5));
    EXPECT_NEAR(spread.differentials[0].position.col(0).norm(), expected, turn * 1e-2 + 1e-9);
    EXPECT_NEAR(spread.differentials[0].direction.col(0).norm(), turn * std::exp(1.5), 1e-9);
    EXPECT_NEAR(spread.differentials[0].direction.col(1).norm(), turn * std::exp(-1), 1e-9);
  }
}

/// Strong kicks use another branch of the exponential.
TEST(RayDifferential, MatchesFiniteDifferencesWhereKicksAreStrong) {
  const TensorField field = cube_field(17, linear_tensor);
  const Geometry geometry(surfaces_of(field));
  BendingSettings settings = settings_of(BendingMethod::splitting, 4);  // One step of 0.5: ‖h s T‖ is about 8.
  settings.max_steps = 1;
  const Start start = make_start({0.1, -0.2, 0.3}, {0, 0, -1}, 0);
  const RayBatch traced = trace_with_differential(field, geometry, settings, start, 8);
  ASSERT_EQ(traced.end[0], RayEnd::step_limit);
  // Both take the same steps, so that only the error of the finite differences remains.
  expect_equal(traced.differentials[0],
               finite_differences(field, geometry, settings, start, 8, 1e-5, RayEnd::step_limit), 1e-6);
}

}  // namespace
}  // namespace tensorray
