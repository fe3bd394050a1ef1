#include "volumes/tensors/statistics.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "volumes/bricks/tensor_field.h"
#include "volumes/making/generators.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

Matrix3d matrix_of_rows(std::initializer_list<double> rows) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.begin());
}

TensorGrid stretched_grid(const std::function<Matrix3d(const Vector3i&)>& value) {
  const Eigen::Affine3d to_world = Eigen::Translation3d(1, 2, 3) * Eigen::Scaling(0.5, 1.0, 2.0);
  return dense_grid({Vector3i(-2, 0, 0), Vector3i(7, 9, 9)}, to_world, value);
}

TEST(FieldStatistics, DescribesTheExtent) {
  const TensorGrid grid = stretched_grid([](const Vector3i&) { return Matrix3d::Identity(); });
  const FieldStatistics s = field_statistics(grid);
  EXPECT_EQ(s.active_voxels, 1000u);
  EXPECT_EQ(s.non_finite, 0u);
  EXPECT_EQ(s.index_box.min(), Vector3i(-2, 0, 0));
  EXPECT_EQ(s.index_box.max(), Vector3i(7, 9, 9));
  EXPECT_LE((s.voxel_size - Vector3d(0.5, 1, 2)).norm(), 1e-15);
  EXPECT_LE((s.world_box.min() - Vector3d(0, 2, 3)).norm(), 1e-14);
  EXPECT_LE((s.world_box.max() - Vector3d(4.5, 11, 21)).norm(), 1e-14);
  EXPECT_EQ(s.memory_bytes, TensorField(grid).memory_bytes());
  EXPECT_TRUE(std::isinf(s.stable_step(0.2)));  // Isotropic: no bending.
}

TEST(FieldStatistics, PercentilesOfTheNorm) {
  // Norms 0 … 999, each once.
  const TensorGrid grid = stretched_grid([](const Vector3i& i) -> Matrix3d {
    const double n = (i.x() + 2) * 100 + i.y() * 10 + i.z();
    return n / std::sqrt(3.0) * Matrix3d::Identity();
  });
  const std::array<double, 7> expected{0, 10, 250, 500, 749, 989, 999};
  const FieldStatistics s = field_statistics(grid);
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(s.norm[i], expected[i], 1e-4);
}

TEST(FieldStatistics, EigenvaluesAndFractions) {
  // A tenth of the voxels (x = −2) has the eigenvalues −1 ± 3i and 4. The others are diag(5, 0, 0), neither complex nor
  // negative.
  const TensorGrid grid = stretched_grid([](const Vector3i& i) -> Matrix3d {
    if (i.x() == -2) return matrix_of_rows({-1, -3, 0, 3, -1, 0, 0, 0, 4});
    return Vector3d(5, 0, 0).asDiagonal();
  });
  const FieldStatistics s = field_statistics(grid);
  EXPECT_NEAR(s.real_min, -1, 1e-12);
  EXPECT_NEAR(s.real_max, 5, 1e-12);
  EXPECT_NEAR(s.imaginary_max, 3, 1e-12);
  EXPECT_DOUBLE_EQ(s.complex_fraction, 0.1);
  EXPECT_DOUBLE_EQ(s.negative_fraction, 0.1);
  // Sums of squares per voxel: 36 (72 for T − Tᵀ), and 25.
  EXPECT_NEAR(s.asymmetry, std::sqrt(0.1 * 72 / (0.1 * 36 + 0.9 * 25)), 1e-6);
  // The deviator of diag(5, 0, 0) is diag(10/3, −5/3, −5/3). The deviator of the other tensor has the singular values
  // |−5/3 ± 3i| (a normal block) and 10/3.
  const double deviator = std::hypot(5.0 / 3, 3.0);
  EXPECT_NEAR(s.deviator_max, deviator, 1e-12);
  EXPECT_NEAR(s.stable_step(-0.2), 1 / (0.2 * deviator), 1e-12);
  // The pair becomes √10 on its plane: of the voxel's 36, the 18 of the antisymmetric part are erased.
  EXPECT_NEAR(s.absolute_loss, 0.1 * 18 / (0.1 * 36 + 0.9 * 25), 1e-12);
}

TEST(FieldStatistics, LeavesNonFiniteVoxelsOut) {
  const TensorGrid grid = stretched_grid([](const Vector3i& i) -> Matrix3d {
    return (i.x() > 4 ? std::numeric_limits<double>::quiet_NaN() : 2.0) * Matrix3d::Identity();
  });
  const FieldStatistics s = field_statistics(grid);
  EXPECT_EQ(s.active_voxels, 1000u);
  EXPECT_EQ(s.non_finite, 300u);
  EXPECT_EQ(s.index_box.max(), Vector3i(4, 9, 9));
  EXPECT_NEAR(s.norm[6], 2 * std::sqrt(3.0), 1e-6);
  EXPECT_EQ(s.real_max, 2);
}

TEST(FieldStatistics, OfNothingFinite) {
  const TensorGrid grid = stretched_grid([](const Vector3i&) -> Matrix3d { return Matrix3d::Constant(INFINITY); });
  const FieldStatistics s = field_statistics(grid);
  EXPECT_EQ(s.non_finite, 1000u);
  EXPECT_TRUE(s.index_box.isEmpty());
  EXPECT_EQ(s.memory_bytes, 0u);
}

TEST(FieldStatistics, DoesNotDependOnThreads) {
  const Vortex vortex;
  const TensorGrid grid = generate(vortex, default_grid(vortex, 40));
  const FieldStatistics many = field_statistics(grid);
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  const FieldStatistics one = field_statistics(grid);
  EXPECT_EQ(many.norm, one.norm);
  EXPECT_EQ(many.absolute_loss, one.absolute_loss);
  EXPECT_EQ(many.deviator_max, one.deviator_max);
  EXPECT_EQ(many.complex_fraction, one.complex_fraction);
}

}  // namespace
}  // namespace tensorray
