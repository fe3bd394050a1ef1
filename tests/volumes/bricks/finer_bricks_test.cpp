// Fields of several levels: what they reproduce, how smooth they are, and what is at borders.

#include <cmath>
#include <random>

#include <tbb/global_control.h>

#include "tests/volumes/grid_support.h"
#include "tests/volumes/level_support.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

constexpr Interpolant smooth_fade{Interpolation::cubic, Border::fade},
    smooth_extend{Interpolation::cubic, Border::extend};
constexpr double rounding_of_levels = 1e-5;  // Of single precision, for values of 1 and subdivided coefficients.

/// A cubic polynomial along each axis, of values of about 1.
Matrix3d cubic_polynomial(const Vector3d& at) {
  const auto along = [](double x, double a) { return 0.4 + x * (a + x * (0.5 - 0.8 * a * x)); };
  Matrix3d T;
  for (int i = 0; i < 9; ++i)
    T.data()[i] = along(at.x() / 24, 0.3) * along(at.y() / 24, 0.1 * i) * along(at.z() / 24, 0.5 - 0.1 * i);
  return T;
}

/// A field and its derivatives at a position in voxels of level 0: value, and slopes along x, y, z.
using Jet = std::array<Matrix3d, 4>;

Jet jet_at(TensorSampler& sampler, const TensorField& field, const Vector3d& index) {
  Jet jet;
  std::array<Matrix3d, 2> slopes;
  for (int pair = 0; pair < 2; ++pair) {
    Eigen::Matrix<double, 3, 2> along;
    along << field.to_world().linear().col(pair), field.to_world().linear().col(pair + 1);
    jet[0] = sampler.at(field.to_world() * index, along, slopes);
    jet[1 + pair] = slopes[0];
    jet[2 + pair] = slopes[1];
  }
  return jet;
}

struct RefinedCase {
  const char* name;
  AlignedBox3i box;
  int levels;
  Refines refines;
};

void PrintTo(const RefinedCase& c, std::ostream* out) { *out << c.name; }

const AlignedBox3i three_bricks(Vector3i(0, 0, 0), Vector3i(24, 24, 24));

std::vector<RefinedCase> refined_cases() {
  const auto corner = [](const Vector3i& b) { return b == Vector3i(0, 0, 0) || b == Vector3i(1, 1, 1); };
  return {
      {"one level", {Vector3i(0, 0, 0), Vector3i(17, 17, 17)}, 1, [](const Vector3i&) { return true; }},
      {"one brick in the middle", three_bricks, 2, [](const Vector3i& b) { return b == Vector3i(1, 1, 1); }},
      {"half", three_bricks, 3, [](const Vector3i& b) { return b.x() == 0; }},
      {"all", three_bricks, 2, [](const Vector3i&) { return true; }},
      {"L", three_bricks, 3, [](const Vector3i& b) { return b.x() == 0 || b.y() == 0; }},
      {"bricks that touch at a corner", three_bricks, 2, corner},
      {"odd sizes", {Vector3i(-11, -3, 5), Vector3i(6, 12, 20)}, 2, [](const Vector3i& b) { return b.x() >= 0; }},
      {"faces between halves of bricks",
       {Vector3i(4, 0, 0), Vector3i(12, 12, 12)},
       3,
       [](const Vector3i& b) { return b.y() > 0; }},
      {"four levels", {Vector3i(0, 0, 0), Vector3i(16, 8, 8)}, 4, [](const Vector3i& b) { return b.x() == 1; }},
  };
}

Matrix3d wavy(const Vector3d& at) { return waves((8 * at).cast<int>()); }

class RefinedFields : public testing::TestWithParam<RefinedCase> {};

TEST_P(RefinedFields, CubicPolynomialsAreReproduced) {
  const RefinedCase& c = GetParam();
  const TensorField field(grid_of_levels(c.box, c.levels, c.refines, cubic_polynomial, sheared_transform()),
                          smooth_fade);
  EXPECT_EQ(field.levels(), c.levels);
  TensorSampler sampler(field);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  const double h = 1e-3;
  for (int n = 0; n < 2000; ++n) {
    Vector3d index;
    for (int axis = 0; axis < 3; ++axis) {
      const double u = uniform(random), v = u < 0.1 ? 0 : u > 0.9 ? 1 : u > 0.8 ? 0.5 : uniform(random);
      index[axis] = c.box.min()[axis] + v * c.box.sizes()[axis];
    }
    const Jet jet = jet_at(sampler, field, index);
    EXPECT_LT((jet[0] - cubic_polynomial(index)).norm(), rounding_of_levels) << index.transpose();
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = h * Vector3d::Unit(axis);
      const Matrix3d slope = (cubic_polynomial(index + step) - cubic_polynomial(index - step)) / (2 * h);
      EXPECT_LT((jet[1 + axis] - slope).norm(), 8 * rounding_of_levels) << index.transpose();
    }
  }
}

/// White noise at the voxels of all levels.
TensorGrid noise_of_levels(const AlignedBox3i& box, int levels, const Refines& refines) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(-1, 1);
  TensorGrid grid = grid_of_levels(box, levels, refines, [](const Vector3d&) { return Matrix3d::Zero(); });
  for_each_value(grid, [&](Matrix3f& value) { value = Matrix3f::NullaryExpr([&] { return uniform(random); }); });
  return grid;
}

/// Across a face between levels, value, slopes and curvature go on: the one-sided differences of slopes agree.
TEST_P(RefinedFields, RandomDetailsAreTwiceContinuouslyDifferentiable) {
  const RefinedCase& c = GetParam();
  const TensorField field(noise_of_levels(c.box, c.levels, c.refines), smooth_fade);
  TensorSampler sampler(field);
  std::mt19937 random(2);
  const double near = 1e-4, scale = std::pow(2, field.levels() - 1);
  for (int n = 0; n < 2000; ++n) {  // On the faces of the finest voxels, and across them.
    Vector3d index = random_point(random, c.box.cast<double>());
    const int axis = n % 3;
    index[axis] = n % 2 ? std::round(index[axis] / 4) * 4 : std::round(scale * index[axis]) / scale;
    if (index[axis] <= c.box.min()[axis] || index[axis] >= c.box.max()[axis]) continue;
    const Vector3d step = near * Vector3d::Unit(axis);
    const Jet before = jet_at(sampler, field, index - step), on = jet_at(sampler, field, index),
              behind = jet_at(sampler, field, index + step);
    for (int part = 0; part < 4; ++part) {
      const Matrix3d first = (on[part] - before[part]) / near, second = (behind[part] - on[part]) / near;
      const double bound =
          1000 * std::pow(scale, part == 0 ? 2 : 3) * near + 1e-5 * std::pow(scale, part == 0 ? 0 : 1) / near;
      EXPECT_LT((first - second).norm(), bound) << index.transpose() << " part " << part;
    }
  }
}

/// Calls visit(position in voxels of level 0, value) at the voxels of the finest level that are at least two of its
/// voxels within the box of those voxels, or on the faces of the extent.
template <class Visit>
void visit_finest(const TensorGrid& grid, const Visit& visit) {
  const int scale = 1 << grid.finer.size();
  const TensorBlocks& finest = grid.finer.back();
  AlignedBox3i inner = active_box(shapes_of(finest));
  inner.min().array() += 2 * (inner.min().array() != scale * grid.active_box().min().array()).cast<int>();
  inner.max().array() -= 2 * (inner.max().array() != scale * grid.active_box().max().array()).cast<int>();
  for_each_active(finest, [&](const Vector3i& index, const Matrix3f& value) {
    if (inner.contains(index)) visit(Vector3d(index.cast<double>() / scale), Matrix3d(value.cast<double>()));
  });
}

TEST_P(RefinedFields, DeviatorsAreBounded) {
  const RefinedCase& c = GetParam();
  const TensorField field(noise_of_levels(c.box, c.levels, c.refines), smooth_fade);
  TensorSampler sampler(field);
  std::mt19937 random(3);
  for (int n = 0; n < 1000; ++n) {
    const Vector3d index = random_point(random, c.box.cast<double>());
    const Vector3i brick = (index / 8).array().floor().cast<int>();
    const Eigen::Vector3f from = (index - 8 * brick.cast<double>()).cast<float>();
    const LeafBrick leaf = field.leaf(brick, {from.x(), from.y(), from.z()});
    const Matrix3d T = sampler.at(index);
    const double deviator = (T - T.trace() / 3 * Matrix3d::Identity()).norm();
    EXPECT_LE(deviator, leaf.brick.strongest);
    EXPECT_LE(leaf.brick.strongest, field.brick(brick).strongest);
    EXPECT_EQ(leaf.scale, c.refines(brick) ? 1 << (c.levels - 1) : 1);
  }
}

TEST_P(RefinedFields, ThreadsDoNotChangeBits) {
  const RefinedCase& c = GetParam();
  const TensorGrid grid = grid_of_levels(c.box, c.levels, c.refines, wavy);
  std::vector<std::vector<float>> bricks;
  for (const std::size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const TensorField field(grid, smooth_extend);
    const BrickMemory& memory = field.memory();
    bricks.emplace_back(memory.floats.get(), memory.floats.get() + memory.count * memory.stride);
  }
  EXPECT_EQ(bricks[0], bricks[1]);
}

INSTANTIATE_TEST_SUITE_P(Levels, RefinedFields, testing::ValuesIn(refined_cases()));

const auto first_half = [](const Vector3i& brick) { return brick.x() < 2; };

/// In a box, details interpolate the level's values; level 0 is what it was without them.
TEST(FinerBricks, ValuesAreInterpolatedAwayFromTheCoarserBricks) {
  for (const Interpolant& interpolant : {smooth_fade, smooth_extend}) {
    const TensorGrid grid = noise_of_levels({Vector3i(0, 0, 0), Vector3i(32, 12, 10)}, 2, first_half);
    const TensorField field(grid, interpolant);
    TensorSampler sampler(field);
    std::size_t count = 0;
    visit_finest(grid, [&](const Vector3d& index, const Matrix3d& value) {
      EXPECT_LT((sampler.at(index) - value).norm(), 2 * rounding_of_levels) << index.transpose();
      ++count;
    });
    EXPECT_EQ(count, 30u * 25 * 21);
  }
}

/// Where regions are no boxes, runs that are solved one after the other are wrong near inner edges.
TEST(FinerBricks, ValuesAreNearlyInterpolatedInRegionsThatAreNoBoxes) {
  const TensorGrid grid = noise_of_levels(three_bricks, 2, [](auto& b) { return b.x() == 0 || b.y() == 0; });
  const TensorField field(grid, smooth_fade);
  TensorSampler sampler(field);
  double greatest = 0;
  visit_finest(grid, [&](const Vector3d& index, const Matrix3d& value) {
    const bool near_edge =
        std::max(std::abs(index.x() - 8), std::abs(index.y() - 8)) < 4 || index.head<2>().minCoeff() > 7;
    if (!near_edge) greatest = std::max(greatest, (sampler.at(index) - value).norm());
  });
  EXPECT_LT(greatest, 2e-3);
}

TEST(FinerBricks, TheErrorIsOfFourthOrderInTheLocalVoxel) {
  double errors[2][2] = {};  // By resolution, in the refined half and in the other.
  for (const int fine : {0, 1}) {
    const int n = 32 << fine;
    const auto formula = [&](const Vector3d& index) {
      const double phase = Vector3d(16, 9.6, 6.4).dot(index) / n;
      return Matrix3d(Matrix3d::NullaryExpr([&](auto row, auto column) {
        return std::sin(phase + 2.1 * static_cast<double>(row) + 0.9 * static_cast<double>(column));
      }));
    };
    const auto left = [&](const Vector3i& b) { return 8 * b.x() < n / 2; };
    const AlignedBox3i box(Vector3i::Zero(), Vector3i(n, n / 2, n / 2));
    const TensorField field(grid_of_levels(box, 2, left, formula), smooth_fade);
    TensorSampler sampler(field);
    std::mt19937 random(6);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < 3000; ++i) {
      const double u = uniform(random);  // Neither near the faces nor near the coarser bricks.
      const Vector3d index(n * (u < 0.5 ? 0.1 + 0.6 * u : 0.35 + 0.55 * u), n * (0.2 + uniform(random) / 8),
                           n * (0.2 + uniform(random) / 8));
      double& error = errors[fine][u < 0.5 ? 0 : 1];
      error = std::max(error, (sampler.at(index) - formula(index)).norm());
    }
  }
  for (const int half : {0, 1}) {
    EXPECT_GT(errors[0][half] / errors[1][half], 12);
    EXPECT_LT(errors[0][half] / errors[1][half], 24);
  }
  EXPECT_LT(errors[0][0], errors[0][1] / 10);
}

TEST(FinerBricks, LevelsWithoutDetailsChangeNothing) {
  const AlignedBox3i box(Vector3i(0, 0, 0), Vector3i(20, 17, 16));
  TensorGrid grid = unit_voxels(box.min(), box.max(), waves);
  const TensorField alone(grid, smooth_fade);
  const auto refines = [](const Vector3i& brick) { return brick.x() == 0; };
  for (int level = 1; level < 3; ++level)
    add_level(grid, box, refines, [&](const Vector3d& index) { return TensorSampler(alone).at(index); });
  const TensorField field(grid, smooth_fade);
  EXPECT_EQ(field.levels(), 3);
  TensorSampler sampler(field), before(alone);
  std::mt19937 random(7);
  for (int n = 0; n < 1000; ++n) {
    const Vector3d index = random_point(random, box.cast<double>());
    EXPECT_LT((sampler.at(index) - before.at(index)).norm(), rounding_of_levels);
  }
}

/// Of a body whose last voxel of level 1 is between two of level 0.
TEST(FinerBricks, InactiveVoxelsAreContinuedAtTheirLevel) {
  const AlignedBox3i box(Vector3i(0, 0, 0), Vector3i(24, 12, 12));
  const auto line = [](const Vector3d& at) { return Matrix3d((1 + at.x() / 10) * Matrix3d::Ones()); };
  TensorGrid grid = grid_of_levels(box, 2, first_half, line);
  for (int level = 0; level < 2; ++level)
    clear_voxels(*levels_of(grid)[level], [&](const Vector3i& index) {  // From 10.6 on, but for the end.
      return index.x() * (2 - level) > 21 && (level > 0 || index.x() != 24);
    });
  const TensorField extended(grid, smooth_extend), faded(grid, smooth_fade);
  TensorSampler extend(extended), fade(faded);
  for (const double x : {2.0, 9.3, 10.0, 10.4, 10.5, 10.9}) {
    const Vector3d at(x, 6.2, 5.1);
    EXPECT_LT((extend.at(at) - line(at)).norm(), 3 * rounding_of_levels) << x;
  }
  for (const Vector3d& at : {Vector3d(2, 6, 5), {9, 6, 5}, {10, 6, 5}, {10.5, 6, 5}})
    EXPECT_LT((fade.at(at) - line(at)).norm(), 3 * rounding_of_levels) << at.transpose();
  EXPECT_LT(fade.at(Vector3d(13.5, 6, 5)).norm(), 1e-6);
}

TEST(FinerBricks, WhatRefinesNothingIsLeftOut) {
  const AlignedBox3i box(Vector3i(0, 0, 0), Vector3i(16, 8, 8));
  const auto first = [](const Vector3i& b) { return b.x() == 0; };
  const auto last = [](const Vector3i& b) { return b.x() == 3; };  // Not within level 1.
  TensorGrid grid = grid_of_levels(box, 2, first, wavy);
  add_level(grid, box, last, wavy);
  EXPECT_EQ(TensorField(grid, smooth_fade).levels(), 2);
  grid.finer.resize(1);
  for (TensorBlock& block : grid.finer[0]) block.origin.x() += 64;  // Beyond the extent.
  EXPECT_EQ(TensorField(grid, smooth_fade).levels(), 1);
  grid.finer.clear();
  EXPECT_EQ(TensorField(grid, smooth_fade).levels(), 1);
}

TEST(FinerBricks, SeveralLevelsNeedCubicInterpolation) {
  const TensorGrid grid = grid_of_levels(three_bricks, 2, first_half, wavy);
  EXPECT_THROW(TensorField(grid, Interpolant{}), std::invalid_argument);
}

/// One level whose tensors are symmetric and one whose are not: all bricks store general tensors.
TEST(FinerBricks, SymmetryIsThatOfAllLevels) {
  const auto symmetric = [](const Vector3d& at) { return Matrix3d(wavy(at) + wavy(at).transpose()); };
  TensorGrid grid = grid_of_levels(three_bricks, 2, first_half, symmetric);
  EXPECT_TRUE(TensorField(grid, smooth_fade).is_symmetric());
  grid.finer.clear();
  add_level(grid, three_bricks, first_half, wavy);
  EXPECT_FALSE(TensorField(grid, smooth_fade).is_symmetric());
}

}  // namespace
}  // namespace tensorray
