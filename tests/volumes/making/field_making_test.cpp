#include "volumes/making/field_making.h"

#include <random>
#include <stdexcept>

#include <tbb/global_control.h>

#include "tests/volumes/grid_support.h"
#include "tests/volumes/level_support.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/making/noise.h"
#include "volumes/making/smoothing.h"

namespace tensorray {
namespace {

const AlignedBox3i box(Vector3i(-11, -3, 5), Vector3i(25, 14, 30));

/// A source of values that depend on the voxel alone.
BlockSource source_of(const std::function<Matrix3d(const Vector3i&)>& value) {
  return dense_source(box, Affine3d(Eigen::Scaling(0.25)), value);
}

Matrix3d symmetric(const Vector3i& i) { return waves(i) + waves(i).transpose(); }

/// Symmetric in most blocks, but not in all that are looked at for a guess.
Matrix3d mixed(const Vector3i& i) { return i.x() >= 8 && i.x() < 10 && i.y() == 9 ? waves(i) : symmetric(i); }

/// Not finite in a layer at the edge, of more than a block, and in single voxels.
Matrix3d damaged(const Vector3i& i) {
  const bool is_damaged = i.x() > 14 || i == Vector3i(0, 0, 8) || i == Vector3i(-11, 3, 30);
  return is_damaged ? Matrix3d(Matrix3d::Constant(NAN)) : symmetric(i);
}

/// Equal in every number.
void expect_same_bricks(const TensorField& a, const TensorField& b) {
  ASSERT_EQ(a.levels(), b.levels());
  for (std::size_t level = 0; level < a.bricks_of_levels().size(); ++level) {
    EXPECT_EQ(a.bricks_of_levels()[level].places, b.bricks_of_levels()[level].places);
    EXPECT_EQ(a.bricks_of_levels()[level].strongest, b.bricks_of_levels()[level].strongest);
  }
  EXPECT_EQ(a.index_bounds().min(), b.index_bounds().min());
  EXPECT_EQ(a.index_bounds().max(), b.index_bounds().max());
  EXPECT_EQ(a.max_norm(), b.max_norm());
  const BrickMemory &one = a.memory(), &other = b.memory();
  ASSERT_EQ(one.bytes(), other.bytes());
  EXPECT_TRUE(std::equal(one.floats.get(), one.floats.get() + one.count * one.stride, other.floats.get()));
}

void expect_as_from_grid(const std::function<Matrix3d(const Vector3i&)>& value, Eigenvalues mode) {
  TensorGrid grid = dense_grid(box, Affine3d(Eigen::Scaling(0.25)), value);
  const std::size_t non_finite = remove_non_finite(grid);
  const EigenvalueReport report = apply_eigenvalues(grid, mode);
  const MadeField made = make_field(source_of(value), mode);
  ASSERT_TRUE(made.field);
  EXPECT_EQ(made.non_finite, non_finite);
  EXPECT_EQ(made.voxels, grid.active_voxels());
  EXPECT_EQ(made.eigenvalues.chosen, report.chosen);
  EXPECT_EQ(made.eigenvalues.defective, report.defective);
  EXPECT_EQ(made.eigenvalues.norm_lost, report.norm_lost);
  expect_same_bricks(*made.field, TensorField(grid));
}

TEST(FieldMaking, GivesTheFieldOfThePreprocessedGrid) {
  for (const Eigenvalues mode :
       {Eigenvalues::automatic, Eigenvalues::raw, Eigenvalues::absolute, Eigenvalues::positive})
    for (const auto& value : {waves, symmetric, mixed, damaged}) expect_as_from_grid(value, mode);
}

TEST(FieldMaking, NothingIsLeftOfAFieldThatIsNotFinite) {
  const MadeField made =
      make_field(source_of([](const Vector3i&) { return Matrix3d(Matrix3d::Constant(INFINITY)); }), Eigenvalues::raw);
  EXPECT_FALSE(made.field);
  EXPECT_EQ(made.voxels, 0u);
  EXPECT_EQ(made.non_finite, static_cast<std::size_t>((box.sizes() + Vector3i::Ones()).prod()));
}

/// Cleaned and preprocessed at the voxels of each level, bit for bit as a grid that was changed before.
TEST(MakeField, LevelsAreEachCleanedAndPreprocessed) {
  const auto value = [](const Vector3d& at) { return symmetric((2 * at).cast<int>()); };
  TensorGrid grid = grid_of_levels(
      {Vector3i(0, 0, 0), Vector3i(24, 9, 10)}, 2, [](const Vector3i& brick) { return brick.x() < 2; }, value);
  grid.finer[0][3].values[grid.finer[0][3].active._Find_first()](0, 0) = INFINITY;
  TensorGrid changed = grid;
  EXPECT_EQ(remove_non_finite(changed), 1u);
  for (TensorBlocks* blocks : levels_of(changed))
    for (TensorBlock& block : *blocks) apply_eigenvalues(block, Eigenvalues::absolute);
  const MadeField made = make_field(view_of(grid), Eigenvalues::automatic, {Interpolation::cubic});
  EXPECT_EQ(made.non_finite, 1u);
  EXPECT_EQ(made.finer_voxels, std::vector<std::size_t>{active_voxels(shapes_of(changed.finer[0]))});
  expect_same_bricks(*made.field, TensorField(changed, {Interpolation::cubic}));
}

/// Holes, from single voxels to whole blocks, so that sums along one axis pass through voxels and blocks without value.
TensorGrid grid_with_holes(const std::function<Matrix3d(const Vector3i&)>& value) {
  const Affine3d to_world(Eigen::Scaling(0.5, 1.0, 3.0));
  TensorGrid grid = dense_grid({Vector3i(-13, -3, 5), Vector3i(25, 14, 30)}, to_world, value);
  clear_voxels(grid.blocks, [](const Vector3i& i) {
    return (i.x() * 7 + i.y() * 5 + i.z() * 3) % 4 == 0 || (i.x() >= 0 && i.x() < 8 && i.y() >= 0);
  });
  return grid;
}

/// The definition, without separating axes.
Matrix3d mean_about(const TensorGrid& grid, const Vector3i& middle, double deviation) {
  Matrix3d sum = Matrix3d::Zero();
  double weights = 0;
  for_each_active(grid, [&](const Vector3i& i, const Matrix3f& value) {
    if ((i - middle).cwiseAbs().maxCoeff() > 4 * deviation) return;
    const double weight = std::exp(-(i - middle).cast<double>().squaredNorm() / (2 * deviation * deviation));
    sum += weight * value.cast<double>();
    weights += weight;
  });
  return sum / weights;
}

TEST(Smoothing, ConstantsStayAtBordersAndBesideHoles) {
  const Matrix3d constant = by_rows({1.1, 0.3, -7, 1e-9, 3e5, 0.7, -0.2, 1.0 / 3, 13});
  const TensorGrid grid = grid_with_holes([&](const Vector3i&) { return constant; });
  for (const double deviation : {0.3, 1.0, 2.7}) {
    TensorGrid smoothed = grid;
    smooth(smoothed, deviation);
    expect_same_blocks(smoothed, grid);
  }
}

TEST(Smoothing, IsTheMeanOfActiveVoxels) {
  const TensorGrid grid = grid_with_holes(waves);
  for (const double deviation : {0.7, 2.5}) {
    TensorGrid smoothed = grid;
    smooth(smoothed, deviation);
    for (const Vector3i& i : {Vector3i(-13, -3, 7), Vector3i(9, 7, 17), Vector3i(-1, 14, 30), Vector3i(25, 0, 6)}) {
      const Matrix3f value = *find(smoothed, i);
      EXPECT_LT((value.cast<double>() - mean_about(grid, i, deviation)).cwiseAbs().maxCoeff(), 1e-7) << i.transpose();
    }
  }
}

TEST(FieldMaking, AndSmoothingDoNotDependOnThreads) {
  const MadeField many = make_field(source_of(waves), Eigenvalues::absolute);
  TensorGrid smooth_by_many = grid_with_holes(waves), smooth_by_one = smooth_by_many;
  smooth(smooth_by_many, 2);
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  const MadeField one = make_field(source_of(waves), Eigenvalues::absolute);
  EXPECT_EQ(many.eigenvalues.norm_lost, one.eigenvalues.norm_lost);
  expect_same_bricks(*many.field, *one.field);
  smooth(smooth_by_one, 2);
  expect_same_blocks(smooth_by_many, smooth_by_one);
}

/// A wave is lower by exp(−σ²k²/2), at the voxels of every level. Beside a level, those about it are interpolated
/// linearly, which is wrong by k²/8 at most, of half of the weights.
TEST(Smoothing, LevelsKeepTheWidthInSpace) {
  constexpr double k = 0.3, deviation = 1.5, left = 0.903707;  // exp(−σ²k²/2)
  const Formula wave = [](const Vector3d& at) { return Matrix3d(Matrix3d::Identity() * std::cos(k * at.x())); };
  TensorGrid grid = grid_of_levels(
      {Vector3i::Zero(), Vector3i(63, 7, 7)}, 3, [](const Vector3i& brick) { return brick.x() < 4; }, wave);
  smooth(grid, deviation);
  for (std::size_t level = 0; level < 3; ++level)
    for_each_active(*levels_of(grid)[level], [&](const Vector3i& index, const Matrix3f& value) {
      const double x = std::ldexp(index.x(), -static_cast<int>(level));
      if (x < 4 * deviation || x > 63 - 4 * deviation) return;
      const double tolerance = level > 0 && x > 32 - 4 * deviation ? k * k / 16 : 3e-4;
      ASSERT_NEAR(value(1, 1), left * std::cos(k * x), tolerance) << level << " " << index.transpose();
    });
}

TEST(Smoothing, RefusesDeviationsOutOfRangeAndNoiseOfLevels) {
  TensorGrid grid = grid_with_holes(waves);
  for (const double deviation : {-1.0, 20.5, double{NAN}})
    EXPECT_THROW(smooth(grid, deviation), std::invalid_argument) << deviation;
  grid.finer.push_back(grid.blocks);
  EXPECT_THROW(keep_noise(grid), std::invalid_argument);
}

TEST(FieldMaking, SignsOfANegatedFieldCount) {
  TensorGrid grid = unit_voxels({0, 0, 0}, {7, 7, 7}, symmetric);
  for (const auto& [mode, chosen] :
       {std::pair(Eigenvalues::automatic, Eigenvalues::absolute), std::pair(Eigenvalues::automatic, Eigenvalues::raw),
        std::pair(Eigenvalues::absolute, Eigenvalues::absolute)}) {
    EXPECT_EQ(make_field(view_of(grid), mode).eigenvalues.chosen, chosen);
    grid.metadata[negated_key] = "yes";
  }
}

/// Waves of 20 voxels, and noise of this deviation in each component.
TensorGrid noisy_waves(double amplitude, double deviation) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  TensorGrid grid = unit_voxels({0, 0, 0}, {39, 39, 39}, [&](const Vector3i& at) {
    return Matrix3d(amplitude * (0.314 * at.cast<double>()).array().sin().matrix().asDiagonal());
  });
  for_each_value(grid, [&](Matrix3f& value) {
    value += (deviation * Matrix3d::NullaryExpr([&] { return normal(random); })).cast<float>();
  });
  return grid;
}

/// Of what is left, neighbours have nothing in common, and the mean is isotropic.
TEST(Noise, IsKeptWithoutOrderAndStructureIsNot) {
  TensorGrid noise = noisy_waves(0, 0.1), both = noisy_waves(1, 0.1), structure = noisy_waves(1, 0);
  EXPECT_NEAR(variation(noise), 0.3, 0.003);
  for (TensorGrid* grid : {&noise, &both, &structure}) keep_noise(*grid);
  EXPECT_NEAR(variation(noise), 0.3, 0.005);
  EXPECT_NEAR(variation(both), 0.3, 0.03);
  EXPECT_LT(variation(structure), 0.12);  // The ends of the waves, at the grid's faces, and what curves.
  double product = 0, square = 0;
  Matrix3d mean = Matrix3d::Zero();
  for (const TensorBlock& block : both.blocks)
    for (std::size_t i = 0; i + 1 < TensorBlock::voxels; i += 2) {
      product += double{block.values[i](0, 1)} * block.values[i + 1](0, 1);
      square += double{block.values[i](0, 1)} * block.values[i](0, 1);
      mean += block.values[i].cast<double>() / 32000;
    }
  EXPECT_LT(std::abs(product), 0.03 * square);
  EXPECT_LT((mean - mean.trace() / 3 * Matrix3d::Identity()).norm(), 0.01);
}

}  // namespace
}  // namespace tensorray
