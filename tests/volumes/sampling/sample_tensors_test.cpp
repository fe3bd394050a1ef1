#include <random>

#include "tests/volumes/grid_support.h"
#include "volumes/sampling/brick_point.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

constexpr Interpolant cubic{Interpolation::cubic, Border::fade};

/// A field of several bricks, without every third block.
TensorField uneven_field(const Vector3i& first, const Vector3i& last, bool symmetric) {
  TensorGrid grid = dense_grid({first, last}, sheared_transform(), [&](const Vector3i& at) {
    return symmetric ? Matrix3d(waves(at) + waves(at).transpose()) : waves(at);
  });
  for (std::size_t i = 1; i + 1 < grid.blocks.size(); i += 3) grid.blocks[i].active.reset();
  return TensorField(grid, cubic);
}

/// Points along random lines, in the extent and up to three voxels outside it: the neighbours are near each other.
std::vector<Vector3d> index_points(const TensorField& field, std::size_t count) {
  std::mt19937 random(1);
  const AlignedBox3d& extent = field.index_bounds();
  const AlignedBox3d box(extent.min() - Vector3d::Constant(3), extent.max() + Vector3d::Constant(3));
  std::vector<Vector3d> points;
  while (points.size() < count) {
    const Vector3d from = random_point(random, box), to = random_point(random, box);
    for (int i = 0; i < 20 && points.size() < count; ++i) points.push_back(from + i / 20.0 * (to - from));
  }
  return points;
}

std::vector<Matrix3d> sampled(const TensorField& field, const std::vector<Vector3d>& points, const Vector3i& brick,
                              float factor) {
  const std::size_t room = sampled_room(points.size());
  Eigen::ArrayXXf places = Eigen::ArrayXXf::Zero(room, 3), components(room, 9);
  for (std::size_t i = 0; i < points.size(); ++i)
    places.row(i) = (points[i] - 8 * brick.cast<double>()).cast<float>().transpose();
  const IndexPoints at{brick, {&places(0, 0), &places(0, 1), &places(0, 2)}, points.size()};
  sample_tensors(field, at, factor, components.data(), room);
  std::vector<Matrix3d> tensors;
  for (std::size_t i = 0; i < points.size(); ++i) tensors.emplace_back(components.row(i).reshaped(3, 3).cast<double>());
  return tensors;
}

TEST(SampleTensors, AgreesWithTheSamplerOfOnePoint) {
  const std::pair<Vector3i, Vector3i> extents[] = {
      {{-11, -3, 5}, {9, 14, 30}}, {{0, 0, 0}, {23, 23, 23}}, {{3, -4, 7}, {20, -4, 24}}, {{5, 5, 5}, {5, 5, 6}}};
  for (const auto& [first, last] : extents)
    for (const bool symmetric : {false, true}) {
      const TensorField field = uneven_field(first, last, symmetric);
      ASSERT_EQ(field.is_symmetric(), symmetric);
      TensorSampler sampler(field);
      for (const std::size_t count : {1, 15, 64, 65, 700}) {
        const std::vector<Vector3d> points = index_points(field, count);
        const std::vector<Matrix3d> tensors = sampled(field, points, {-1, 0, 2}, 0.5f);
        for (std::size_t i = 0; i < count; ++i) {
          const Matrix3d expected = 0.5 * sampler.at(field.to_world() * points[i]);
          // Positions are rounded to 4e-6 of a voxel; neighbouring voxels differ by up to twice the greatest norm.
          ASSERT_LT((tensors[i] - expected).norm(), 1e-5 * field.max_norm())
              << points[i].transpose() << " in " << first.transpose() << " to " << last.transpose();
        }
      }
    }
}

}  // namespace
}  // namespace tensorray
