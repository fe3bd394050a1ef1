// A cubic field: what it reproduces, what it does at borders, and that all readers see the same.

#include <functional>
#include <random>

#include "tests/volumes/grid_support.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/grids/tensor_grid.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

constexpr Interpolant fading{Interpolation::cubic, Border::fade}, extending{Interpolation::cubic, Border::extend};
constexpr double rounding = 4e-6;  // Of single precision, for values of 1: a coefficient is a sum of some 10 of them.

Eigen::Affine3d sheared() {
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  to_world.linear() << 0.5, 0.1, 0, -0.2, 0.3, 0.05, 0, 0.1, 0.8;
  to_world.translation() = Vector3d(1, -2, 0.5);
  return to_world;
}

/// A polynomial of degree `degrees` along each axis of index space, of values up to about 1 in a box of the size `box`.
Matrix3d polynomial(const Vector3d& index, const Vector3i& degrees, bool symmetric) {
  Matrix3d T;
  for (int i = 0; i < 9; ++i) {
    double value = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double x = (index[axis] - 7 + 0.7 * i) / 20;
      double sum = 0.3;
      for (int n = 1; n <= degrees[axis]; ++n) sum += (0.5 - 0.3 * n + 0.05 * i) * std::pow(x, n);
      value *= sum;
    }
    T.data()[i] = value;
  }
  return symmetric ? Matrix3d((T + T.transpose()) / 2) : T;
}

struct ExtentCase {
  Vector3i first, size;
  bool symmetric;
};

void PrintTo(const ExtentCase& c, std::ostream* out) {
  *out << c.size.transpose() << " voxels from " << c.first.transpose() << (c.symmetric ? ", symmetric" : "");
}

class Extents : public testing::TestWithParam<ExtentCase> {};

/// Along an axis with n voxels, polynomials of degree up to min(3, n − 1) are exact, and their derivatives, up to the
/// faces.
TEST_P(Extents, PolynomialsAreReproduced) {
  const auto [first, size, symmetric] = GetParam();
  const Vector3i degrees = (size.array() - 1).min(3);
  const bool sym = symmetric;
  const TensorField field(dense_grid(AlignedBox3i(first, first + size - Vector3i::Ones()), sheared(),
                                     [&, from = first](const Vector3i& index) {
                                       return polynomial((index - from).cast<double>(), degrees, sym);
                                     }),
                          fading);
  EXPECT_EQ(field.is_symmetric(), symmetric);
  TensorSampler sampler(field);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto at = [&](const Vector3d& index) { return polynomial(index, degrees, sym); };
  for (int n = 0; n < 400; ++n) {
    Vector3d index;
    for (int axis = 0; axis < 3; ++axis) {
      const double u = uniform(random);
      index[axis] = (u < 0.1 ? 0 : u > 0.9 ? 1 : uniform(random)) * (size[axis] - 1);
    }
    const Vector3d world = field.to_world() * (index + first.cast<double>());
    Eigen::Matrix<double, 3, 2> along;
    for (double& value : along.reshaped()) value = uniform(random) - 0.5;
    std::array<Matrix3d, 2> derivatives;
    const Matrix3d value = sampler.at(world, along, derivatives);
    EXPECT_LT((value - at(index)).norm(), rounding) << index.transpose();
    EXPECT_LT((sampler.at(world) - value).norm(), 1e-12);
    for (int i = 0; i < 2; ++i) {
      const Vector3d step = field.to_index().linear() * along.col(i) * 1e-4;
      const Matrix3d expected = (at(index + step) - at(index - step)) / 2e-4;
      EXPECT_LT((derivatives[i] - expected).norm(), 4 * rounding * step.norm() / 1e-4 + 1e-6) << index.transpose();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    CubicField, Extents,
    testing::Values(ExtentCase{{0, 0, 0}, {16, 16, 16}, false}, ExtentCase{{0, 0, 0}, {17, 17, 17}, true},
                    ExtentCase{{-3, 5, 7}, {18, 12, 26}, false}, ExtentCase{{7, 7, 15}, {10, 11, 19}, true},
                    ExtentCase{{2, 0, -9}, {1, 2, 3}, false}, ExtentCase{{6, 6, 6}, {4, 5, 3}, false},
                    ExtentCase{{7, 15, -1}, {2, 1, 4}, true}, ExtentCase{{0, 0, 0}, {9, 10, 8}, false}));

Matrix3d noise(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Matrix3d T;
  for (double& value : T.reshaped()) value = normal(random);
  return T;
}

/// A grid whose voxels within `box` are active where `is_active`.
TensorGrid masked_grid(const AlignedBox3i& box, const std::function<bool(const Vector3i&)>& is_active,
                       const std::function<Matrix3d(const Vector3i&)>& value) {
  TensorGrid grid = dense_grid(box, Eigen::Affine3d::Identity(), value);
  clear_voxels(grid.blocks, [&](const Vector3i& index) { return !is_active(index); });
  return grid;
}

const AlignedBox3i cube_of_32(Vector3i::Zero(), Vector3i(31, 31, 31));
const Vector3d ball_centre = Vector3d::Constant(15.3);

bool is_in_ball(const Vector3i& voxel) { return (voxel.cast<double>() - ball_centre).norm() < 12; }

Matrix3d ones(const Vector3i&) { return Matrix3d::Constant(1); }

/// Calls visit(index) at voxels and half-way between them, about the ball.
template <class Visit>
void visit_halves(const Visit& visit) {
  for (int x = 8; x < 54; ++x)
    for (int y = 8; y < 54; ++y)
      for (int z = 8; z < 54; ++z) visit(Vector3d(x, y, z) / 2);
}

/// A dense field of any values has them at its voxels.
TEST(CubicField, InterpolatesItsVoxels) {
  const TensorGrid grid =
      dense_grid(AlignedBox3i(Vector3i(-5, 1, 6), Vector3i(12, 20, 22)), sheared(), [](auto& index) {
        std::mt19937 own(static_cast<unsigned>(index.dot(Vector3i(1, 100, 10000)) + 1000000));
        return noise(own);
      });
  const TensorField field(grid, fading);
  TensorSampler sampler(field);
  for_each_active(grid, [&](const Vector3i& index, const Matrix3f& value) {
    const Matrix3d found = sampler.at(grid.to_world * index.cast<double>());
    ASSERT_LT((found - value.cast<double>()).norm(), 3e-5);  // White noise: coefficients are up to ten times as large.
  });
}

/// The same beside a body of any shape: its voxels keep their values, and nothing is far from 0 and 1 but beside edges.
TEST(CubicField, ABallHardlyRings) {
  const TensorField field(masked_grid(cube_of_32, is_in_ball, ones), fading);
  TensorSampler sampler(field);
  int far_from = 0, count = 0;
  visit_halves([&](const Vector3d& at) {
    const double value = sampler.at(at)(0, 1);
    EXPECT_GT(value, -0.3);
    EXPECT_LT(value, 1.2);
    far_from += value < -0.1 || value > 1.1;
    ++count;
    const Vector3i voxel = at.cast<int>();
    if (voxel.cast<double>() == at && is_in_ball(voxel)) {
      EXPECT_NEAR(value, 1, 2e-4);
    }
  });
  EXPECT_LT(far_from, 0.02 * count);
}

/// A field that is linear goes on behind the last voxels of a body.
TEST(CubicField, ExtendContinuesLines) {
  const auto line = [](const Vector3d& index) {
    return Matrix3d((0.2 + 0.02 * index.x() - 0.03 * index.y() + 0.01 * index.z()) * Matrix3d::Constant(1));
  };
  const TensorField field(
      masked_grid(cube_of_32, is_in_ball, [&](const Vector3i& v) { return line(v.cast<double>()); }), extending);
  TensorSampler sampler(field);
  visit_halves([&](const Vector3d& at) {
    if ((at - ball_centre).norm() < 12.4) {
      EXPECT_LT((sampler.at(at) - line(at)).norm(), 1e-4) << at.transpose();
    }
  });
}

/// Layers of one to four voxels at a face of the extent, and another body far away: voxels keep their values.
TEST(CubicField, ThinLayersAtFacesKeepTheirValues) {
  const AlignedBox3i box(Vector3i::Zero(), Vector3i(23, 11, 11));
  for (const Interpolant& interpolant : {fading, extending})
    for (int layer = 1; layer <= 4; ++layer)
      for (const bool is_last : {false, true}) {
        const auto within = [&](const Vector3i& v) {
          const int x = is_last ? 23 - v.x() : v.x();
          return x < layer || x > 18;
        };
        const TensorField field(masked_grid(box, within, ones), interpolant);
        TensorSampler sampler(field);
        for (int x = 0; x < 24; ++x)
          if (within({x, 5, 5})) {
            EXPECT_NEAR(sampler.at(Vector3d(x, 5, 5))(0, 1), 1, 1e-5) << layer << " voxels, at " << x;
          }
        if (interpolant == extending && layer > 1) {  // A constant goes on.
          EXPECT_NEAR(sampler.at(Vector3d(is_last ? 22.5 : 0.5, 5, 5))(0, 1), 1, 1e-5) << layer;
        }
      }
}

/// Values beside each other whose squares are far apart, some beyond single precision.
TEST(CubicField, TheBoundHoldsForValuesOfAnySize) {
  for (const double large : {1e10, 1e20, 1e35}) {
    const TensorField field(dense_grid(AlignedBox3i(Vector3i::Zero(), Vector3i(7, 7, 7)), sheared(),
                                       [&](const Vector3i& v) {
                                         Matrix3d T = Matrix3d(Vector3d(1, -2, 0.5).asDiagonal());
                                         return v == Vector3i(3, 3, 3) ? Matrix3d(large * T) : T;
                                       }),
                            fading);
    EXPECT_GT(field.brick({0, 0, 0}).strongest, large);
  }
}

}  // namespace
}  // namespace tensorray
