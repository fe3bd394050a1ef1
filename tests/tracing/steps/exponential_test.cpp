#include "tracing/steps/exponential.h"

#include <unsupported/Eigen/MatrixFunctions>

#include "tests/names.h"

namespace tensorray {
namespace {

TEST(Exponential, AgreesWithTheMatrixExponential) {
  std::srand(1);
  for (int i = 0; i < 2500; ++i) {
    const double size = std::pow(10.0, -6 + 7.5 * i / 2500);  // Up to ‖A‖ of about 60.
    const Matrix3d A = size * Matrix3d::Random();
    const Vector3d v = Vector3d::Random(), expected = Matrix3d(A.exp()) * v;
    const ExponentialDirection found = exponential_direction(A, v);
    EXPECT_LT((found.direction - expected.normalized()).norm(), 2e-12 * std::max(1.0, std::exp(A.norm() / 5))) << A;
    EXPECT_NEAR(found.log_length, std::log(expected.norm()) - A.trace() / 3, 1e-11 * (1 + A.norm())) << A;
  }
  const Matrix3d strong = Vector3d(2e5, -1e5, -1e5).asDiagonal();  // exp(strong) overflows.
  EXPECT_NEAR(exponential_direction(strong, {1, 0, 0}).log_length, 2e5, 1e-4);
}

TEST(Exponential, ConvergesToTheMajorEigenvectorWithoutOverflow) {
  Matrix3d A = Vector3d(3, 2, 1).asDiagonal();
  for (const double size : {1e2, 1e5, 1e10, 1e100}) {
    const Vector3d v = exponential_direction(size * A, {1e-3, 1, 1}).direction;
    EXPECT_NEAR(v.x(), 1, 1e-12) << size;
  }
}

TEST(Exponential, IsBlindToTheTrace) {
  const Matrix3d A = Matrix3d::Random();
  const Vector3d v(1, 2, 3);
  const Matrix3d shifted = A + 1000 * Matrix3d::Identity();
  EXPECT_LT((exponential_direction(A, v).direction - exponential_direction(shifted, v).direction).norm(), 1e-12);
}

TEST(Exponential, HasNoDirectionWhereNothingIsFinite) {
  EXPECT_TRUE(exponential_direction(Matrix3d::Constant(NAN), {1, 0, 0}).direction.isZero());
  EXPECT_TRUE(exponential_direction(Matrix3d::Constant(INFINITY), {1, 0, 0}).direction.isZero());
  EXPECT_TRUE(exponential_direction(Matrix3d::Identity(), {NAN, 0, 0}).direction.isZero());
  EXPECT_TRUE(exponential_direction(Matrix3d::Identity(), {0, 0, 0}).direction.isZero());
}

}  // namespace
}  // namespace tensorray
