#include "volumes/tensors/invariants.h"

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d diagonal(double a, double b, double c) { return Vector3d(a, b, c).asDiagonal(); }

Matrix3d cross_matrix(const Vector3d& axis) {
  Matrix3d matrix;
  for (int i = 0; i < 3; ++i) matrix.col(i) = axis.cross(Vector3d::Unit(i));
  return matrix;
}

double of(const std::string& name, const Matrix3d& tensor) { return invariant(invariant_of(name), tensor); }

TEST(InvariantTest, DiagonalTensors) {
  const Matrix3d tensor = diagonal(2, -3, 6);
  EXPECT_DOUBLE_EQ(of("norm", tensor), 7);
  EXPECT_DOUBLE_EQ(of("trace", tensor), 5);
  EXPECT_DOUBLE_EQ(of("determinant", tensor), -36);
  EXPECT_NEAR(of("largest_eigenvalue", tensor), 6, 1e-14);
  EXPECT_NEAR(of("middle_eigenvalue", tensor), 2, 1e-14);
  EXPECT_NEAR(of("smallest_eigenvalue", tensor), -3, 1e-14);
  EXPECT_NEAR(of("max_shear", tensor), 4.5, 1e-14);
  EXPECT_NEAR(of("von_mises", tensor), std::sqrt((25 + 81 + 16) / 2.0), 1e-14);  // From the three differences.
  EXPECT_EQ(of("vorticity", tensor), 0);
  EXPECT_EQ(of("swirling_strength", tensor), 0);
  EXPECT_EQ(of("asymmetry", tensor), 0);
}

TEST(InvariantTest, AnisotropyOfLinePlaneAndSphere) {
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(5, 0, 0)), 1, 1e-15);
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(0, 5, 5)), std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(5, 5, 5)), 0, 1e-15);
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(1, 0, -1)), std::sqrt(1.5), 1e-15);
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(1.7, 0.3, 0.3)), 1.4 / std::sqrt(1.7 * 1.7 + 2 * 0.09), 1e-15);
  EXPECT_NEAR(of("mode", diagonal(5, 1, 1)), 1, 1e-14);
  EXPECT_NEAR(of("mode", diagonal(1, 5, 5)), -1, 1e-14);
  EXPECT_NEAR(of("mode", diagonal(3, 2, 1)), 0, 1e-14);
  EXPECT_EQ(of("mode", 3 * Matrix3d::Identity()), 0);
  EXPECT_EQ(of("mode", diagonal(0.1f, 0.1 * (1 + 1e-7), 0.1)), 0);
}

TEST(InvariantTest, RotationAndShear) {
  const Matrix3d rotation = cross_matrix({1, -2, 2});
  EXPECT_NEAR(of("vorticity", rotation), 6, 1e-14);  // Twice the rate of rotation.
  EXPECT_NEAR(of("swirling_strength", rotation), 3, 1e-14);
  EXPECT_NEAR(of("asymmetry", rotation), 2, 1e-15);
  EXPECT_EQ(of("fractional_anisotropy", rotation), 0);
  EXPECT_EQ(of("max_shear", rotation), 0);
  Matrix3d shear = Matrix3d::Zero();
  shear(0, 2) = 4;
  EXPECT_NEAR(of("vorticity", shear), 4, 1e-14);
  EXPECT_NEAR(of("max_shear", shear), 2, 1e-14);
  EXPECT_NEAR(of("von_mises", shear), 2 * std::sqrt(3.0), 1e-14);
  EXPECT_NEAR(of("asymmetry", shear), std::sqrt(2.0), 1e-15);
  // A pair 1 ± 2i and 5: ordered by real parts.
  Matrix3d spiral = diagonal(1, 1, 5);
  spiral(0, 1) = -2;
  spiral(1, 0) = 2;
  EXPECT_NEAR(of("largest_eigenvalue", spiral), 5, 1e-14);
  EXPECT_NEAR(of("smallest_eigenvalue", spiral), 1, 1e-14);
  EXPECT_NEAR(of("swirling_strength", spiral), 2, 1e-14);
}

TEST(InvariantTest, IsTheSameInAllAxesAndScalesWithItsDegree) {
  std::mt19937 engine(5);
  std::normal_distribution<double> normal;
  const auto random = [&] { return normal(engine); };
  for (int i = 0; i < 200; ++i) {
    const Matrix3d tensor = Matrix3d::NullaryExpr(random);
    const Eigen::Quaterniond turn = Eigen::Quaterniond(Eigen::Vector4d::NullaryExpr(random)).normalized();
    const Matrix3d q = turn.toRotationMatrix();
    for (const std::string& name : invariant_names()) {
      const double value = of(name, tensor);
      // A pair of nearly equal eigenvalues changes with the square root of rounding errors.
      EXPECT_NEAR(of(name, q * tensor * q.transpose()), value, 1e-6 * (1 + std::abs(value))) << name;
      const double power = name == "determinant" ? 3 : value == 0 || of(name, 2 * tensor) == value ? 0 : 1;
      EXPECT_NEAR(of(name, 2 * tensor), std::pow(2, power) * value, 1e-12 * (1 + std::abs(value))) << name;
    }
  }
}

TEST(InvariantTest, IsFiniteForEveryFiniteTensorAndZeroForZero) {
  const double largest = std::numeric_limits<double>::max(), least = std::numeric_limits<double>::denorm_min();
  std::mt19937 engine(7);
  std::uniform_int_distribution<int> choose(0, 6);
  const double numbers[] = {0, 1, -1, largest, -largest, least, -1e-200};
  for (const std::string& name : invariant_names()) {
    EXPECT_EQ(of(name, Matrix3d::Zero()), 0) << name;
    for (int i = 0; i < 300; ++i) {
      const Matrix3d tensor = Matrix3d::NullaryExpr([&] { return numbers[choose(engine)]; });
      EXPECT_TRUE(std::isfinite(of(name, tensor))) << name << " of\n" << tensor;
    }
  }
  EXPECT_NEAR(of("norm", diagonal(3e-200, 4e-200, 0)) / 1e-200, 5, 1e-14);
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(1e300, 0, 0)), 1, 1e-15);
  EXPECT_EQ(of("determinant", diagonal(1e200, 1e200, -1e200)), -largest);
}

}  // namespace
}  // namespace tensorray
