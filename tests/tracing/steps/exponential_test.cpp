#include "tracing/steps/exponential.h"

#include <limits>

#include <gtest/gtest.h>
#include <unsupported/Eigen/MatrixFunctions>

namespace tensorray {
namespace {

TEST(Exponential, AgreesWithTheMatrixExponential) {
  std::srand(1);
  for (int i = 0; i < 2000; ++i) {
    const double size = std::pow(10.0, -6 + 7.0 * i / 2000);  // Up to ‖A‖ of about 20.
    const Eigen::Matrix3d A = size * Eigen::Matrix3d::Random();
    const Eigen::Vector3d v = Eigen::Vector3d::Random();
    const Eigen::Vector3d expected = (Eigen::Matrix3d(A.exp()) * v).normalized();
    EXPECT_LT((exponential_direction(A, v).direction - expected).norm(),
              2e-12 * std::max(1.0, std::exp(2 * A.norm() / 10)))
        << A;
  }
}

TEST(Exponential, KnowsTheLength) {
  std::srand(2);
  for (int i = 0; i < 200; ++i) {
    const double size = std::pow(10.0, -4 + 5.5 * i / 200);  // Up to ‖A‖ of about 60.
    const Eigen::Matrix3d A = size * Eigen::Matrix3d::Random();
    const Eigen::Vector3d v = Eigen::Vector3d::Random().normalized();
    const double expected = std::log((Eigen::Matrix3d(A.exp()) * v).norm()) - A.trace() / 3;
    EXPECT_NEAR(exponential_direction(A, v).log_length, expected, 1e-11 * (1 + A.norm())) << A;
  }
  const Eigen::Matrix3d strong = Eigen::Vector3d(2e5, -1e5, -1e5).asDiagonal();  // exp(strong) overflows.
  EXPECT_NEAR(exponential_direction(strong, {1, 0, 0}).log_length, 2e5, 1e-4);
}

TEST(Exponential, ConvergesToTheMajorEigenvectorWithoutOverflow) {
  Eigen::Matrix3d A = Eigen::Vector3d(3, 2, 1).asDiagonal();
  for (const double size : {1e2, 1e5, 1e10, 1e100}) {
    const Eigen::Vector3d v = exponential_direction(size * A, {1e-3, 1, 1}).direction;
    EXPECT_NEAR(v.x(), 1, 1e-12) << size;
  }
}

TEST(Exponential, IsBlindToTheTrace) {
  const Eigen::Matrix3d A = Eigen::Matrix3d::Random();
  const Eigen::Vector3d v(1, 2, 3);
  const Eigen::Matrix3d shifted = A + 1000 * Eigen::Matrix3d::Identity();
  EXPECT_LT((exponential_direction(A, v).direction - exponential_direction(shifted, v).direction).norm(), 1e-12);
}

TEST(Exponential, HasNoDirectionWhereNothingIsFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(exponential_direction(Eigen::Matrix3d::Constant(nan), {1, 0, 0}).direction.isZero());
  EXPECT_TRUE(exponential_direction(Eigen::Matrix3d::Constant(infinity), {1, 0, 0}).direction.isZero());
  EXPECT_TRUE(exponential_direction(Eigen::Matrix3d::Identity(), {nan, 0, 0}).direction.isZero());
  EXPECT_TRUE(exponential_direction(Eigen::Matrix3d::Identity(), {0, 0, 0}).direction.isZero());
}

}  // namespace
}  // namespace tensorray
