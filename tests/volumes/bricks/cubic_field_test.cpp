// A cubic field: what it reproduces, what it does at borders, and that slabs of any size give the same.

#include <functional>
#include <random>

#include "tests/volumes/grid_support.h"
#include "volumes/bricks/coefficients.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/grids/block_source.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

constexpr Interpolant fading{Interpolation::cubic, Border::fade}, extending{Interpolation::cubic, Border::extend};
constexpr double rounding = 4e-6;  // Of single precision, for values of 1: a coefficient is a sum of some 10 of them.

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

/// Along an axis with n voxels, polynomials of degree up to min(3, n − 1) are exact, and their derivatives, up to the
/// faces.
void expect_polynomials(const Vector3i& first, const Vector3i& size, bool symmetric) {
  SCOPED_TRACE(testing::Message() << size.transpose() << " voxels from " << first.transpose());
  const Vector3i degrees = (size.array() - 1).min(3);
  const auto at = [&](const Vector3d& index) { return polynomial(index, degrees, symmetric); };
  const TensorField field(dense_grid(AlignedBox3i(first, first + size - Vector3i::Ones()), sheared_transform(),
                                     [&](const Vector3i& index) { return at((index - first).cast<double>()); }),
                          fading);
  EXPECT_EQ(field.is_symmetric(), symmetric);
  TensorSampler sampler(field);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
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

TEST(CubicField, ReproducesPolynomials) {
  expect_polynomials({0, 0, 0}, {16, 16, 16}, false);
  expect_polynomials({0, 0, 0}, {17, 17, 17}, true);
  expect_polynomials({-3, 5, 7}, {18, 12, 26}, false);
  expect_polynomials({7, 7, 15}, {10, 11, 19}, true);
  expect_polynomials({2, 0, -9}, {1, 2, 3}, false);
  expect_polynomials({6, 6, 6}, {4, 5, 3}, false);
  expect_polynomials({7, 15, -1}, {2, 1, 4}, true);
  expect_polynomials({0, 0, 0}, {9, 10, 8}, false);
}

/// A grid whose voxels within `box` are active where `is_active`.
TensorGrid masked_grid(const AlignedBox3i& box, const std::function<bool(const Vector3i&)>& is_active,
                       const std::function<Matrix3d(const Vector3i&)>& value) {
  TensorGrid grid = unit_voxels(box.min(), box.max(), value);
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
  TensorGrid grid = dense_grid({Vector3i(-5, 1, 6), Vector3i(12, 20, 22)}, sheared_transform(), ones);
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for_each_value(grid, [&](Matrix3f& value) { value = Matrix3f::NullaryExpr([&] { return normal(random); }); });
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
    const TensorGrid grid = unit_voxels({0, 0, 0}, {7, 7, 7}, [&](const Vector3i& v) {
      return Matrix3d((v == Vector3i(3, 3, 3) ? large : 1) * Vector3d(1, -2, 0.5).asDiagonal());
    });
    EXPECT_GT(TensorField(grid, fading).brick({0, 0, 0}).strongest, large);
  }
}

/// Blocks with gaps along all axes, and voxels that are missing; the last plane along x has no cell of its own.
std::vector<BlockShape> shapes_with_gaps() {
  std::vector<BlockShape> shapes;
  const Vector3i places[] = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {2, 1, 2}, {3, 1, 2},
                             {6, 0, 0}, {6, 1, 0}, {7, 0, 0}, {7, 2, 1}, {8, 0, 0}, {8, 2, 2}};
  for (const Vector3i& place : places) {
    BlockShape shape;
    shape.origin = TensorBlock::size * place;
    for (int i = 0; i < TensorBlock::voxels; ++i)
      shape.active[i] = place.x() < 8 ? i % 11 != 3 : TensorBlock::position(i).x() == 0;
    shapes.push_back(shape);
  }
  return shapes;
}

struct MadeBricks {
  BrickMemory bricks;
  std::vector<float> strongest;
};

/// Bricks that are made slab by slab, over blocks that are not needed any more. @param most  Places of a slab.
MadeBricks make_by_slabs(const BlockTable& table, const Interpolant& interpolant, bool symmetric, std::size_t most) {
  const int components = symmetric ? TensorBrick::symmetric : TensorBrick::general;
  const AlignedBox3i extent = active_box(table.shapes);
  CoefficientBricks bricks = coefficient_bricks(table, extent, interpolant);
  bricks.slabs = slabs_of(bricks.places, most);
  MadeBricks made{brick_memory({bricks}, interpolant.between, components), {}};
  const BrickMemory blocks = blocks_within(made.bricks, bricks);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (std::size_t i = 0; i < table.places.size(); ++i) {
    TensorBlock block{};
    for (int voxel = 0; voxel < TensorBlock::voxels; ++voxel)
      if (table.shapes[i].active[voxel]) {
        const Matrix3f T = Matrix3f::NullaryExpr([&] { return uniform(random); });
        block.values[voxel] = symmetric ? Matrix3f(T + T.transpose()) : T;
      }
    EXPECT_TRUE(place_values(block, components, blocks.brick(bricks.index.find(table.places[i]))));
  }
  const Coefficients field{bricks, extent, interpolant, blocks};
  continue_values(field);
  made.strongest = make_coefficients(field, made.bricks);
  keep_bricks(made.bricks, bricks.count);
  return made;
}

TEST(CoefficientSlabs, OfAnySizeGiveTheSameBricks) {
  const std::vector<BlockShape> shapes = shapes_with_gaps();
  const BlockTable table(shapes);
  for (const Interpolant& interpolant : {Interpolant{}, fading, extending})
    for (const bool symmetric : {true, false}) {
      const MadeBricks whole = make_by_slabs(table, interpolant, symmetric, 1 << 20);
      ASSERT_GT(whole.bricks.count, 20u);
      for (const std::size_t most : {1, 12, 30}) {
        const MadeBricks made = make_by_slabs(table, interpolant, symmetric, most);
        ASSERT_EQ(made.bricks.count, whole.bricks.count);
        EXPECT_EQ(made.strongest, whole.strongest) << most;
        EXPECT_TRUE(std::equal(whole.bricks.brick(0), whole.bricks.brick(whole.bricks.count), made.bricks.brick(0)))
            << "slabs of " << most << " places";
      }
    }
}

}  // namespace
}  // namespace tensorray
