#include "tools/import/lattices/lattice.h"

#include <cmath>
#include <limits>

#include "tests/import/voxel_support.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

using Components = std::function<std::vector<double>(const Vector3i&)>;

/// A lattice of `components(index)`. Expects that slices are read from the last to the first, once each.
Lattice lattice_of(const Vector3i& size, const Components& components) {
  Lattice lattice;
  lattice.size = size;
  lattice.components = static_cast<int>(components(Vector3i::Zero()).size());
  lattice.read_slice = [=, next = size.z() - 1](int z, double* values) mutable {
    EXPECT_EQ(z, next--);
    for (int y = 0; y < size.y(); ++y)
      for (int x = 0; x < size.x(); ++x)
        for (const double c : components({x, y, z})) *values++ = c;
  };
  return lattice;
}

std::vector<double> full(const Matrix3d& tensor) {
  std::vector<double> components;
  for (int i = 0; i < 9; ++i) components.push_back(tensor(i / 3, i % 3));
  return components;
}

Matrix3d tensor_at(const Vector3i& index) {
  return test::general_tensor() + Vector3d(1, 100, 10000).dot(index.cast<double>()) * Matrix3d::Ones();
}

TEST(Lattice, EveryVoxelKeepsItsTensorAndPlace) {
  const Vector3i size(11, 17, 9);
  Lattice lattice = lattice_of(size, [](const Vector3i& index) { return full(tensor_at(index)); });
  lattice.to_world.translate(Vector3d(3, 4, 5)).scale(0.5);
  LatticeReport report;
  const TensorGrid grid = tensors_of(lattice, {}, report);
  EXPECT_EQ(report.voxels, 11u * 17 * 9);
  EXPECT_EQ(report.active, report.voxels);
  EXPECT_EQ(grid.active_voxels(), report.voxels);
  EXPECT_EQ(grid.to_world.matrix(), lattice.to_world.matrix());
  EXPECT_EQ(grid.blocks.size(), 2u * 3 * 2);
  test::for_each_voxel(grid, [](const Vector3i& index, const Matrix3d& tensor) {
    EXPECT_EQ(tensor, tensor_at(index).cast<float>().cast<double>());
  });
}

TEST(Lattice, BlocksAreOrderedAndOnlyThoseWithActiveVoxels) {
  Lattice lattice = lattice_of({40, 33, 29}, [](const Vector3i& index) {
    const Vector3i block = index / 8;
    const bool active = (block.x() * 7 + block.y() * 3 + block.z()) % 4 == 1;
    return full(active ? tensor_at(index) : Matrix3d::Zero());
  });
  lattice.zero_is_background = true;
  LatticeReport report;
  const TensorGrid grid = tensors_of(lattice, {}, report);
  EXPECT_EQ(report.active + report.background, report.voxels);
  EXPECT_EQ(grid.active_voxels(), report.active);
  for (std::size_t i = 0; i < grid.blocks.size(); ++i) {
    const Vector3i origin = grid.blocks[i].origin, block = origin / 8;
    EXPECT_EQ((block.x() * 7 + block.y() * 3 + block.z()) % 4, 1);
    EXPECT_TRUE(grid.blocks[i].active.any());
    if (i == 0) continue;
    const Vector3i before = grid.blocks[i - 1].origin;
    EXPECT_TRUE(std::lexicographical_compare(before.begin(), before.end(), origin.begin(), origin.end()));
  }
  test::for_each_voxel(grid, [](const Vector3i& index, const Matrix3d& tensor) {
    EXPECT_EQ(tensor, tensor_at(index).cast<float>().cast<double>());
  });
}

TEST(Lattice, SymmetricTensorsStaySymmetricWhenTurned) {
  Lattice lattice = lattice_of({16, 8, 8}, [](const Vector3i& i) -> std::vector<double> {
    return {std::sin(i.x() + 0.1), std::sin(i.y() + 0.2), 0.3 * i.z(), std::cos(i.x() * 1.0), 1.0 * i.y(), 0.7};
  });
  lattice.frame = test::rotation();
  test::for_each_voxel(test::tensors_of(lattice, TensorOrder::voigt),
                       [](const Vector3i&, const Matrix3d& tensor) { EXPECT_EQ(tensor, tensor.transpose()); });
}

TEST(Lattice, MaskedZeroAndNonFiniteVoxelsAreInactive) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const std::vector<std::vector<double>> voxels = {
      {1, 1, 2, 3, 4, 5, 6},       // 0: active
      {0, 1, 2, 3, 4, 5, 6},       // 1: masked
      {0.5, 0, 0, 0, 0, 0, 7},     // 2: active
      {1, 0, 0, 0, 0, 0, 0},       // 3: zero
      {1, 1, nan, 3, 4, 5, 6},     // 4: not finite
      {1, 1, 2, 3, 4, -inf, 6},    // 5: not finite
      {0.49, nan, 2, 3, 4, 5, 6},  // 6: masked, whatever the other components are
      {nan, 1, 2, 3, 4, 5, 6},     // 7: masked, because the mask is NaN
      {1, 1e300, 0, 0, 0, 0, 0},   // 8: beyond single precision
  };
  Lattice lattice = lattice_of({9, 1, 1}, [&](const Vector3i& index) { return voxels[index.x()]; });
  lattice.masked = lattice.zero_is_background = true;
  LatticeReport report;
  const TensorGrid grid = tensors_of(lattice, TensorOrder::fsl, report);
  EXPECT_EQ(report.voxels, 9u);
  EXPECT_EQ(report.active, 2u);
  EXPECT_EQ(report.background, 4u);
  EXPECT_EQ(report.non_finite, 3u);
  test::expect_near((Matrix3d() << 1, 2, 3, 2, 4, 5, 3, 5, 6).finished(), test::voxel(grid, {0, 0, 0}));
  EXPECT_NE(test::voxel(grid, {2, 0, 0}), nullptr);
  EXPECT_EQ(grid.blocks.front().values[TensorBlock::offset(1, 0, 0)], Eigen::Matrix3f::Zero());
}

TEST(Lattice, OfMoreThanNineComponentsTheFirstSixAreTheTensor) {
  const Lattice lattice = lattice_of(
      {1, 1, 1}, [](const Vector3i&) { return std::vector<double>{11, 22, 33, 12, 23, 13, 99, NAN, 99, 99}; });
  const TensorGrid grid = test::tensors_of(lattice, TensorOrder::vtk);
  test::expect_near((Matrix3d() << 11, 12, 13, 12, 22, 23, 13, 23, 33).finished(), test::voxel(grid, {0, 0, 0}));
}

TEST(Lattice, WrongNumbersOfComponentsAndAMissingOrderAreErrors) {
  const auto components = [](std::size_t count) {
    Lattice lattice = lattice_of({1, 1, 1}, [=](const Vector3i&) { return std::vector<double>(count, 1); });
    lattice.array = "stress";
    return lattice;
  };
  LatticeReport report;
  const auto tensors = [&](std::size_t count) {
    return [&report, lattice = components(count)] { tensors_of(lattice, {}, report); };
  };
  EXPECT_THROW(tensors(6)(), std::invalid_argument);
  test::expect_error(tensors(6), {"\"stress\"", "--order vtk|fsl|mrtrix|voigt"});
  test::expect_error(tensors(10), {"--order"});
  test::expect_error(tensors(3), {"--gradient-of", "vector"});
  test::expect_error(tensors(1), {"1 component and", "another array"});
  test::expect_error(tensors(8), {"8 components", "another array"});
  test::expect_error([&] { gradient_of(components(6), report); }, {"gradient", "\"stress\"", "has 6"});
  EXPECT_NO_THROW(tensors(9)());
}

TEST(Lattice, GradientOfALinearVectorFieldIsItsMatrixInWorldAxes) {
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  to_world.linear() = test::rotation() * Vector3d(0.5, 2, 0.25).asDiagonal();
  to_world.translation() = Vector3d(3, 4, 5);
  const Matrix3d gradient = test::general_tensor(), frame = test::rotation().transpose();
  Lattice lattice = lattice_of({13, 10, 9}, [&](const Vector3i& index) -> std::vector<double> {
    const Vector3d v = frame.transpose() * (gradient * (to_world * index.cast<double>()));
    return {v.x(), v.y(), v.z()};
  });
  lattice.to_world = to_world;
  lattice.frame = frame;
  LatticeReport report;
  const TensorGrid grid = gradient_of(lattice, report);
  EXPECT_EQ(report.active, 13u * 10 * 9);
  EXPECT_EQ(grid.active_voxels(), report.active);
  EXPECT_EQ(grid.to_world.matrix(), to_world.matrix());
  test::for_each_voxel(grid, [&](const Vector3i&, const Matrix3d& tensor) {
    EXPECT_LT((tensor - gradient).norm(), 1e-5 * gradient.norm());
  });
}

TEST(Lattice, GradientLeavesOutInactiveVoxels) {
  const Lattice lattice = lattice_of({9, 9, 9}, [](const Vector3i& index) -> std::vector<double> {
    if (index == Vector3i(4, 4, 4)) return {NAN, 0, 0};
    return {2.0 * index.x(), 0, 0};
  });
  LatticeReport report;
  const TensorGrid grid = gradient_of(lattice, report);
  EXPECT_EQ(report.non_finite, 1u);
  EXPECT_EQ(test::voxel(grid, {4, 4, 4}), nullptr);
  Matrix3d expected = Matrix3d::Zero();
  expected(0, 0) = 2;
  test::expect_near(expected, test::voxel(grid, {3, 4, 4}));
}

}  // namespace
}  // namespace tensorray
