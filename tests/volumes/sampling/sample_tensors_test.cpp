
#include <array>
#include <random>

#include "tests/names.h"
#include "volumes/sampling/brick_point.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

constexpr Interpolant cubic{Interpolation::cubic, Border::fade};

/// A field of several bricks, without every third block.
TensorField uneven_field(const Vector3i& first, const Vector3i& last, bool symmetric = false) {
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  to_world.linear() =
      Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()).toRotationMatrix() * Vector3d(0.5, 1, 2).asDiagonal();
  to_world.translation() = Vector3d(10, -20, 30);
  TensorGrid grid = dense_grid({first, last}, to_world, [&](const Vector3i& at) -> Matrix3d {
    const Matrix3d T = Matrix3d::NullaryExpr([&](Eigen::Index row, Eigen::Index column) {
      return std::sin(0.9 * at.x() + 1.7 * static_cast<double>(row)) +
             std::cos(0.6 * at.y() - 1.1 * at.z() + 2.3 * static_cast<double>(column));
    });
    return symmetric ? Matrix3d(T + T.transpose()) : T;
  });
  for (std::size_t i = 1; i + 1 < grid.blocks.size(); i += 3) grid.blocks[i].active.reset();
  return TensorField(grid, cubic);
}

/// Points along random lines, in the extent and up to three voxels outside it: the neighbours are near each other.
std::vector<Vector3d> index_points(const TensorField& field, std::size_t count) {
  std::mt19937 engine(1);
  const auto random = [&] { return std::uniform_real_distribution<double>(0, 1)(engine); };
  const auto within = [&] {
    const Vector3d sizes = field.index_bounds().sizes() + Vector3d::Constant(6);
    return Vector3d(field.index_bounds().min() - Vector3d::Constant(3) +
                    Vector3d(random(), random(), random()).cwiseProduct(sizes));
  };
  std::vector<Vector3d> points;
  while (points.size() < count) {
    const Vector3d from = within(), to = within();
    for (int i = 0; i < 20 && points.size() < count; ++i) points.push_back(from + i / 20.0 * (to - from));
  }
  return points;
}

std::vector<std::array<float, 9>> sampled(const TensorField& field, const std::vector<Vector3d>& points,
                                          const Vector3i& brick, float factor) {
  const std::size_t room = sampled_room(points.size());
  std::vector<float> places[3], components(9 * room);
  for (int axis = 0; axis < 3; ++axis) {
    places[axis].resize(room);
    for (std::size_t i = 0; i < points.size(); ++i)
      places[axis][i] = static_cast<float>(points[i][axis] - 8 * brick[axis]);
  }
  const IndexPoints at{brick, {places[0].data(), places[1].data(), places[2].data()}, points.size()};
  sample_tensors(field, at, factor, components.data(), room);
  std::vector<std::array<float, 9>> tensors(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t c = 0; c < 9; ++c) tensors[i][c] = components[c * room + i];
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
        const auto tensors = sampled(field, points, {-1, 0, 2}, 0.5f);
        for (std::size_t i = 0; i < count; ++i) {
          const Matrix3d expected = 0.5 * sampler.at(field.to_world() * points[i]);
          const Matrix3d found = Eigen::Map<const Eigen::Matrix3f>(tensors[i].data()).cast<double>();
          // Positions are rounded to 4e-6 of a voxel; neighbouring voxels differ by up to twice the greatest norm.
          ASSERT_LT((found - expected).norm(), 1e-5 * field.max_norm())
              << points[i].transpose() << " in " << first.transpose() << " to " << last.transpose();
        }
      }
    }
}

}  // namespace
}  // namespace tensorray
