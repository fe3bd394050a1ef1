#include "tracing/scale/auto_scale.h"

#include <cmath>

#include "tests/tracing/support.h"

namespace tensorray {
namespace {

AutoScale scale_of(const TensorField& field, const Progress& progress = Progress()) {
  return choose_scale(field, Geometry(surfaces_of(field)),
                      silhouette_beam(field.corners(), -Vector3d::UnitZ(), Vector3d::UnitY()), progress);
}

/// Of the field and of length. Squares of these lengths, or of their inverses, are beyond single precision.
TEST(AutoScale, CancelsTheUnits) {
  for (const Interpolant& interpolant : {Interpolant{}, Interpolant{Interpolation::cubic, Border::fade}}) {
    const auto scale_with = [&](double size, double strength) {
      const Affine3d placement(Eigen::Scaling(size));
      const auto tensor = [&](const Vector3d& p) { return Matrix3d(strength * linear_tensor(p / size)); };
      return scale_of(TensorField(cube_grid({9, 9, 9}, tensor, placement), interpolant));
    };
    const AutoScale one = scale_with(1, 1);
    EXPECT_GT(one.shown, 0.3);
    EXPECT_GT(one.bent_fraction, 0.99);
    for (const auto& [size, strength] : {std::pair(1e-12, 1.0), {1e19, 1.0}, {1e26, 1.0}, {1.0, 1e-6}, {1.0, 1e6}}) {
      const AutoScale scaled = scale_with(size, strength);
      EXPECT_NEAR(scaled.scale * size * strength / one.scale, 1, 1e-3) << size;
      EXPECT_NEAR(scaled.shown, one.shown, 1e-3) << size;
    }
  }
}

/// A lens with x'' = −ω²x along the light, ω² = 0.2 · scale. Light converges to |cos 2ω − ω/2 sin 2ω| of its width on
/// the plane, at a distance of half a unit behind a depth of 2.
TEST(AutoScale, AgreesWithTheClosedFormOfALens) {
  const AutoScale chosen = scale_of(cube_field(
      17, [](const Vector3d& p) -> Matrix3d { return Vector3d(p.x(), p.y(), 0) * Vector3d::UnitZ().transpose(); }));
  const double omega = std::sqrt(0.2 * chosen.scale);
  const double change = -2 * std::log(std::cos(2 * omega) - omega / 2 * std::sin(2 * omega));
  const double shown = change * std::exp(1 - change);
  // The best of scales a factor of 2 apart shows 0.9 to 1. The closed form is that of small angles: here 0.2, so that
  // the turn is known to 4%, and so is the change.
  EXPECT_NEAR(shown, chosen.shown, 0.05);
  EXPECT_GT(chosen.shown, 0.84 * 0.9);
  EXPECT_LT(chosen.shown, 0.88);
}

/// A structure that fills 2% of the cross section gets the scale that it has where it fills all of it.
TEST(AutoScale, SmallStructuresAreSeen) {
  const auto waves = [](double half_width) {
    return scale_of(cube_field(65, [&](const Vector3d& p) {
      Matrix3d T = Matrix3d::Zero();
      if (p.head<2>().cwiseAbs().maxCoeff() < half_width) T.col(2).head<2>() = (20 * p.head<2>()).array().sin();
      return T;
    }));
  };
  const AutoScale all = waves(2), small = waves(0.16);
  EXPECT_LT(small.bent_fraction, 0.05);
  EXPECT_NEAR(small.scale / all.scale, 1, 0.4);
}

TEST(AutoScale, LightThatOnlyTurnsTurnsVisibly) {
  Matrix3d T = Matrix3d::Zero();  // About the light's right axis.
  T(1, 2) = -3;
  T(2, 1) = 3;
  const AutoScale chosen = scale_of(constant_field(T));
  EXPECT_LT(chosen.shown, 0.2);  // Only light that passes the volume's sides changes.
  EXPECT_GT(chosen.median_turn, 0.1);
  EXPECT_LE(chosen.median_turn, 0.4);
}

TEST(AutoDirection, IsTheOneThatShowsMost) {
  for (int axis = 0; axis < 3; ++axis) {
    const int next = (axis + 1) % 3;
    const TensorField field = cube_field(9, [&](const Vector3d& p) -> Matrix3d {  // Bends light along one axis only.
      return std::sin(3 * p[next]) * Vector3d::Unit(next) * Vector3d::Unit(axis).transpose();
    });
    const AutoDirection chosen = choose_direction(field, Geometry(surfaces_of(field)), Vector3d::UnitZ(), Progress());
    EXPECT_GT(std::abs(chosen.direction[axis]), 0.5);  // Along it, or along a diagonal that has a part of it.
    EXPECT_GT(chosen.scale.shown, 0.2);
  }
  const TensorField nothing = constant_field(Matrix3d::Identity());
  EXPECT_EQ(choose_direction(nothing, Geometry(surfaces_of(nothing)), Vector3d::UnitZ(), Progress()).direction,
            -Vector3d::UnitZ());
}

/// A plate in plane stress: light along its normal, which is a principal direction, goes straight, and light along its
/// edges makes a strip.
TEST(AutoDirection, OfAPlateIsADiagonalThatFillsThePicture) {
  const TensorGrid grid = dense_grid(AlignedBox3i(Vector3i::Zero(), Vector3i(40, 20, 2)), Affine3d(Eigen::Scaling(0.1)),
                                     [](const Vector3i& at) -> Matrix3d {
                                       return std::sin(0.3 * at.x()) * Vector3d(1, 0.2, 0).asDiagonal().toDenseMatrix();
                                     });
  const TensorField field(grid, {Interpolation::cubic, Border::extend});
  const auto ranked = rank_directions(field, Geometry(surfaces_of(field)), Vector3d::UnitZ(), Progress());
  EXPECT_EQ(ranked.size(), 26u);
  for (std::size_t i = 1; i < ranked.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) EXPECT_LT(ranked[i].direction.dot(ranked[k].direction), 0.95);
  const Vector3d V = ranked.front().direction;
  EXPECT_GT(std::min(std::abs(V.x()), std::abs(V.z())), 0.5);
  EXPECT_GT(ranked.front().worth, 0.1);
  EXPECT_EQ(ranked.back().worth, 0);
}

TEST(AutoScale, AGivenScaleIsJudgedAsTheChosenOneWas) {
  const TensorField field = cube_field(17, [](const Vector3d& p) -> Matrix3d {
    return std::sin(3 * p.x()) * Vector3d(1, 0, 2).asDiagonal().toDenseMatrix() + Matrix3d::Ones() * p.y();
  });
  const Geometry geometry(surfaces_of(field));
  const Beam beam = silhouette_beam(field.corners(), -Vector3d::UnitZ(), Vector3d::UnitY());
  const AutoScale chosen = choose_scale(field, geometry, beam, Progress());
  const auto judged = [&](double scale, double s) { return judge_scale(field, geometry, beam, scale, s, Progress()); };
  EXPECT_DOUBLE_EQ(judged(chosen.scale, 0.2).shown, chosen.shown);
  EXPECT_DOUBLE_EQ(judged(2 * chosen.scale, 0.1).median_turn, chosen.median_turn);
  EXPECT_GT(chosen.greatest_turn, chosen.median_turn);
  EXPECT_LT(judged(1e-4 * chosen.scale, 0.2).shown, 0.01);
  EXPECT_LT(judged(1e4 * chosen.scale, 0.2).shown, 0.5 * chosen.shown);
}

TEST(AutoScale, FieldsThatTurnNoLightKeepTheirScale) {
  for (const double c : {0.0, 5.0}) {
    const AutoScale chosen = scale_of(constant_field(c * Matrix3d::Identity()));
    EXPECT_EQ(chosen.scale, 1);
    EXPECT_EQ(chosen.median_turn, 0);
  }
  // An eigenvector as direction.
  EXPECT_EQ(scale_of(constant_field(Vector3d(1, 2, 3).asDiagonal().toDenseMatrix())).median_turn, 0);
}

TEST(AutoScale, StopsWhenCancelled) {
  Progress progress;
  progress.cancelled = true;
  EXPECT_THROW(scale_of(cube_field(9, linear_tensor), progress), Cancelled);
}

}  // namespace
}  // namespace tensorray
