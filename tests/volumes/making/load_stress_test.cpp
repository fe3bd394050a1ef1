#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "base/constants.h"
#include "volumes/making/generators.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Stress = std::function<Matrix3d(const Vector3d&)>;

/// Second differences of a function at p: the matrix of its second derivatives.
Matrix3d hessian(const std::function<double(const Vector3d&)>& value, const Vector3d& p, double h) {
  Matrix3d result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Vector3d a = h * Vector3d::Unit(i), b = h * Vector3d::Unit(j);
      result(i, j) = (value(p + a + b) - value(p + a - b) - value(p - a + b) + value(p - a - b)) / (4 * h * h);
    }
  return result;
}

struct Load {
  const char* name;
  double ratio;
  Stress stress;
};

std::vector<Load> loads() {
  std::vector<Load> result;
  for (const double ratio : {-0.5, 0.0, 0.3, 0.5}) {
    result.push_back({"point", ratio, [ratio](const Vector3d& p) { return point_load_stress(p, 1, ratio); }});
    result.push_back({"disc", ratio, [ratio](const Vector3d& p) { return disc_load_stress(p, 1, 0.6, ratio); }});
  }
  return result;
}

// Inside and outside the disc's cylinder and the unit ball, and on the axis.
const std::vector<Vector3d> positions{
    {0.3, -0.2, -0.5}, {0, 0, -1}, {1e-9, 0.4, -0.1}, {1, 0.2, -0.3}, {0.1, 0.1, -0.3}};

TEST(LoadStress, IsInEquilibrium) {
  const double h = 1e-4;
  for (const Load& load : loads())
    for (const Vector3d& p : positions) {
      Vector3d divergence = Vector3d::Zero();
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d step = h * Vector3d::Unit(axis);
        divergence += (load.stress(p + step) - load.stress(p - step)).col(axis) / (2 * h);
      }
      // The error of central differences is h²/6 times a third derivative, which is of the order of 60 σ / |p|³.
      const double scale = load.stress(p).norm() / std::pow(p.norm(), 3);
      EXPECT_LE(divergence.norm(), 60 * h * h * scale + 1e-10)
          << load.name << " " << load.ratio << " " << p.transpose();
    }
}

TEST(LoadStress, IsCompatible) {
  // Beltrami and Michell: ∇²σ + ∇∇ tr σ / (1 + ν) = 0. The error of second differences, which are over 2h, is (2h)²/12
  // times a fourth derivative, which is of the order of 360 σ / |p|⁴, for six terms.
  const double h = 1e-3;
  for (const Load& load : loads())
    for (const Vector3d& p : positions) {
      const Matrix3d trace = hessian([&](const Vector3d& q) { return load.stress(q).trace(); }, p, h);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const double laplacian = hessian([&](const Vector3d& q) { return load.stress(q)(i, j); }, p, h).trace();
          const double scale = load.stress(p).norm() / std::pow(p.norm(), 4);
          EXPECT_LE(std::abs(laplacian + trace(i, j) / (1 + load.ratio)), 6 * 360.0 / 12 * 4 * h * h * scale + 1e-8)
              << load.name << " " << load.ratio << " " << p.transpose() << " " << i << j;
        }
    }
}

TEST(LoadStress, PlaneBelowCarriesTheLoad) {
  // The force of the lower part on the upper part through z = −1, by quadrature in rings r = tan(θ). It balances the
  // load.
  for (const Load& load : loads()) {
    Vector3d force = Vector3d::Zero();
    const int rings = 2000, spokes = 8;
    for (int i = 0; i < rings; ++i) {
      const double angle = (i + 0.5) / rings * pi / 2, r = std::tan(angle);
      const double area = r / std::pow(std::cos(angle), 2) * (pi / 2 / rings) * (2 * pi / spokes);
      for (int j = 0; j < spokes; ++j) {
        const double turn = 2 * pi * j / spokes;
        force += area * load.stress({r * std::cos(turn), r * std::sin(turn), -1}) * -Vector3d::UnitZ();
      }
    }
    EXPECT_LE((force - Vector3d(0, 0, 1)).norm(), 1e-5) << load.name << " " << load.ratio;
  }
}

TEST(LoadStress, SurfaceHasTheTractionOfTheLoad) {
  const Matrix3d point = point_load_stress({0.3, 0.4, 0}, 2, 0.3);
  EXPECT_EQ(point.col(2), Vector3d(Vector3d::Zero()));
  EXPECT_GT(point.norm(), 0.1);
  EXPECT_LE((point - point.transpose()).norm(), 1e-15);

  const double radius = 0.6, greatest = 3 * 2 / (2 * pi * radius * radius);
  for (const double r : {0.0, 0.1, 0.5, 0.59999, 0.6, 0.7, 3.0}) {
    const Vector3d p(0.6 * r, 0.8 * r, 0);
    const Matrix3d disc = disc_load_stress(p, 2, radius, 0.3);
    const double pressure = greatest * std::sqrt(std::max(0.0, 1 - p.squaredNorm() / (radius * radius)));
    EXPECT_LE((disc.col(2) - Vector3d(0, 0, -pressure)).norm(), 1e-7 * greatest) << r;
    EXPECT_TRUE(disc == disc.transpose()) << r;
    // Beside the disc, the surface is as under a point.
    if (r > 0.6) {
      EXPECT_LE((disc - point_load_stress(p, 2, 0.3)).norm(), 1e-13) << r;
    }
  }
}

}  // namespace
}  // namespace tensorray
