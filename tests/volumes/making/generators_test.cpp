#include "volumes/making/generators.h"

#include <cmath>
#include <functional>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/constants.h"
#include "volumes/making/load_stress.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The tensor of a generated grid at an index.
Matrix3d at(const TensorGrid& grid, const Eigen::Vector3i& index) {
  for (const TensorBlock& block : grid.blocks) {
    const Eigen::Vector3i p = index - block.origin;
    if ((p.array() < 0).any() || (p.array() >= TensorBlock::size).any()) continue;
    const int offset = TensorBlock::offset(p.x(), p.y(), p.z());
    EXPECT_TRUE(block.active[offset]);
    return block.values[offset].cast<double>();
  }
  ADD_FAILURE() << "no voxel at " << index.transpose();
  return Matrix3d::Zero();
}

/// Calls `visit(world position, tensor)` at each voxel.
void for_each(const TensorGrid& grid, const std::function<void(const Vector3d&, const Matrix3d&)>& visit) {
  for (const TensorBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset])
        visit(grid.to_world * (block.origin + TensorBlock::position(offset)).cast<double>(),
              block.values[offset].cast<double>());
}

TEST(PointLoad, TheLoadIsOneVoxelAboveTheBox) {
  const PointLoad load;
  const GridSettings settings = default_grid(load, 21);
  EXPECT_EQ(settings.resolution, Eigen::Vector3i(21, 21, 20));
  const TensorGrid grid = generate(load, settings);
  EXPECT_LE((grid.to_world.linear() - 0.1 * Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_LE((grid.to_world * Vector3d(20, 20, 19) - Vector3d(1, 1, -0.1)).norm(), 1e-14);
  for_each(grid, [](const Vector3d& p, const Matrix3d& tensor) {
    const Matrix3d expected = point_load_stress(p, 1, 0.3);
    ASSERT_LE((tensor - expected).norm(), 1e-6 * expected.norm());
  });
  EXPECT_LT(at(grid, {10, 10, 19})(2, 2), 0);  // Compression under the load.
}

TEST(TwoPointLoad, AddsTheStressesOfBoth) {
  TwoPointLoad loads;
  loads.second_load = 2;
  const TensorGrid grid = generate(loads, default_grid(loads, 17));
  for_each(grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    const Vector3d half(loads.separation / 2, 0, 0);
    const Matrix3d expected = point_load_stress(p + half, 1, 0.3) + point_load_stress(p - half, 2, 0.3);
    ASSERT_LE((tensor - expected).norm(), 1e-6 * expected.norm());
  });
}

TEST(Loads, PressOnDiscsOfTheirRadius) {
  PointLoad load;
  load.radius = 0.3;
  const TensorGrid one = generate(load, default_grid(load, 17));
  for_each(one, [](const Vector3d& p, const Matrix3d& tensor) {
    const Matrix3d expected = disc_load_stress(p, 1, 0.3, 0.3);
    ASSERT_LE((tensor - expected).norm(), 1e-6 * expected.norm());
  });
  TwoPointLoad loads;
  loads.radius = 0.2;
  const TensorGrid two = generate(loads, default_grid(loads, 17));
  for_each(two, [&](const Vector3d& p, const Matrix3d& tensor) {
    const Vector3d half(loads.separation / 2, 0, 0);
    const Matrix3d expected = disc_load_stress(p + half, 1, 0.2, 0.3) + disc_load_stress(p - half, 1, 0.2, 0.3);
    ASSERT_LE((tensor - expected).norm(), 1e-6 * expected.norm());
  });
}

TEST(Rotation, TurnsAboutItsAxis) {
  Rotation rotation;
  rotation.axis = {1, 2, -2};
  rotation.rate = 5;
  const Matrix3d tensor = at(generate(rotation, default_grid(rotation, 2)), {0, 0, 0});
  const Vector3d v(0.3, -0.7, 0.2);
  EXPECT_LE((tensor * v - 5 * rotation.axis.normalized().cross(v)).norm(), 1e-6);
  EXPECT_EQ(tensor, Matrix3d(-tensor.transpose()));
}

TEST(Shear, IsTheGradientOfItsFlow) {
  Shear shear;
  shear.flow = {2, 0, 0};
  shear.gradient = {0, 3, 4};
  shear.rate = 1.5;
  shear.profile = 0.5;
  const Vector3d along = shear.gradient.normalized();
  const auto velocity = [&](const Vector3d& p) -> Vector3d {
    const double height = p.dot(along);
    return shear.rate * (height + 0.5 * shear.profile * height * height) * Vector3d::UnitX();
  };
  for_each(generate(shear, default_grid(shear, 5)), [&](const Vector3d& p, const Matrix3d& tensor) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = 0.01 * Vector3d::Unit(axis);  // Exact for a quadratic.
      ASSERT_LE((tensor.col(axis) - (velocity(p + step) - velocity(p - step)) / 0.02).norm(), 1e-6);
    }
    ASSERT_LE((tensor * tensor).norm(), 1e-6);
  });
}

TEST(Vortex, IsTheGradientOfTheBurgersVortex) {
  Vortex vortex;
  vortex.strain = 0.4;
  const auto velocity = [&](const Vector3d& p) -> Vector3d {
    const double squared = p.head<2>().squaredNorm();
    const double swirl =
        squared == 0 ? vortex.circulation / (2 * pi * vortex.core * vortex.core)
                     : -vortex.circulation / (2 * pi * squared) * std::expm1(-squared / (vortex.core * vortex.core));
    return {-vortex.strain / 2 * p.x() - swirl * p.y(), -vortex.strain / 2 * p.y() + swirl * p.x(),
            vortex.strain * p.z()};
  };
  const double h = 1e-4;
  const auto check = [&](const Vector3d& p, const Matrix3d& tensor) {
    Matrix3d expected;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = h * Vector3d::Unit(axis);
      expected.col(axis) = (velocity(p + step) - velocity(p - step)) / (2 * h);
    }
    // h²/6 times a third derivative of about rate/core², and single precision.
    ASSERT_LE((tensor - expected).norm(), 1e-5) << p.transpose();
    ASSERT_NEAR(tensor.trace(), 0, 1e-6);
  };
  for_each(generate(vortex, default_grid(vortex, 17)), check);
  GridSettings axis = default_grid(vortex, 9);  // Close to the axis, across the change to the series.
  axis.min.setConstant(-0.05);
  axis.max.setConstant(0.05);
  for_each(generate(vortex, axis), check);
}

TEST(Helix, IsSymmetricWithEigenvaluesInRange) {
  const Helix helix;
  for_each(generate(helix, default_grid(helix, 33)), [&](const Vector3d& p, const Matrix3d& tensor) {
    ASSERT_EQ(tensor, Matrix3d(tensor.transpose()));
    const Eigen::Vector3cd values = eigenvalues(tensor);
    ASSERT_LE(values[0].real(), helix.along + 1e-6) << p.transpose();
    ASSERT_GE(values[2].real(), helix.across - 1e-6) << p.transpose();
  });
}

TEST(Helix, HasItsEigenvaluesOnTheCurve) {
  const Helix helix;
  for (const double angle : {0.0, 0.7, 2.0, 4.0, 9.0}) {
    const double rise = helix.pitch / (2 * pi);
    const Vector3d on(helix.radius * std::cos(angle), helix.radius * std::sin(angle), rise * angle);
    GridSettings grid;
    grid.resolution.setOnes();
    grid.min = grid.max = on;
    const Matrix3d tensor = at(generate(helix, grid), {0, 0, 0});
    const Vector3d tangent =
        Vector3d(-helix.radius * std::sin(angle), helix.radius * std::cos(angle), rise).normalized();
    EXPECT_LE((tensor * tangent - helix.along * tangent).norm(), 1e-6);
    EXPECT_NEAR(eigenvalues(tensor)[1].real(), helix.across, 1e-6);
    EXPECT_NEAR(eigenvalues(tensor)[2].real(), helix.across, 1e-6);
  }
}

TEST(Helix, IsContinuousAndIsotropicFarAway) {
  const Helix helix;
  const auto sample = [&](const Vector3d& p) {
    GridSettings grid;
    grid.resolution.setOnes();
    grid.min = grid.max = p;
    return at(generate(helix, grid), {0, 0, 0});
  };
  EXPECT_LE((sample({3, 0, 0}) - helix.background * Matrix3d::Identity()).norm(), 1e-6);
  // Across the branch of the angle, across the height half-way between turns, and across the axis.
  const double h = 1e-5;
  for (const Vector3d& p : {Vector3d(-0.6, 0, 0.3), Vector3d(0.5, 0, 0.5), Vector3d(0, 0, 0.1), Vector3d(0, 0, 0)})
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_LE((sample(p + h * Vector3d::Unit(axis)) - sample(p - h * Vector3d::Unit(axis))).norm(), 40 * h);
}

TEST(Generators, KindsAndGeneratorsMatch) {
  EXPECT_EQ(generator_kinds().size(), std::variant_size_v<Generator>);
  for (const std::string& kind : generator_kinds()) {
    const Generator generator = generator_of(kind);
    EXPECT_EQ(kind_of(generator), kind);
    const GridSettings settings = default_grid(generator, 9);
    const TensorGrid grid = generate(generator, settings);
    EXPECT_EQ(grid.name, kind);
    EXPECT_EQ(grid.metadata.at("tensorray:field"), kind);
    EXPECT_EQ(grid.active_voxels(), static_cast<std::size_t>(settings.resolution.prod()));
    EXPECT_EQ(grid.active_box().min(), Eigen::Vector3i(0, 0, 0));
    EXPECT_LE((grid.to_world * Vector3d(0, 0, 0) - settings.min).norm(), 1e-14);
    EXPECT_LE((grid.to_world * grid.active_box().max().cast<double>() - settings.max).norm(), 1e-14);
    const Vector3d voxel = grid.to_world.linear().diagonal();
    EXPECT_NEAR(voxel.x(), voxel.y(), 1e-14);
    EXPECT_NEAR(voxel.x(), voxel.z(), 1e-14);
  }
}

TEST(Generators, UnknownKindListsTheKinds) {
  EXPECT_THAT([] { generator_of("vortx"); },
              testing::ThrowsMessage<std::invalid_argument>(
                  testing::AllOf(testing::HasSubstr("vortx"), testing::HasSubstr("two_point_load, constant"))));
}

TEST(Generators, MetadataNamesEveryParameter) {
  TwoPointLoad loads;
  loads.separation = 0.1;
  const TensorGrid grid = generate(loads, default_grid(loads, 3));
  EXPECT_EQ(
      grid.metadata.at("tensorray:source"),
      "two_point_load load=1 second_load=1 separation=0.1 poisson_ratio=0.3 radius=0 resolution=3,3,2 min=-1,-1,-2 "
      "max=1,1,-1");
  Constant constant;
  constant.tensor << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  EXPECT_THAT(generate(constant, default_grid(constant, 2)).metadata.at("tensorray:source"),
              testing::HasSubstr("tensor=1,2,3,4,5,6,7,8,9 "));
}

template <class G>
void expect_refused(const G& generator, const std::string& parameter) {
  EXPECT_THAT([&] { generate(generator, default_grid(generator, 3)); },
              testing::ThrowsMessage<std::invalid_argument>(testing::StartsWith(parameter)));
}

TEST(Generators, RefuseParametersOutOfRange) {
  PointLoad load;
  load.poisson_ratio = 0.6;
  expect_refused(load, "poisson_ratio");
  load = {};
  load.radius = -0.1;
  expect_refused(load, "radius");
  load = {};
  load.load = NAN;
  expect_refused(load, "load");
  Rotation rotation;
  rotation.axis.setZero();
  expect_refused(rotation, "axis");
  Shear shear;
  shear.gradient.setZero();
  expect_refused(shear, "gradient");
  Vortex vortex;
  vortex.core = 0;
  expect_refused(vortex, "core");
  Helix helix;
  helix.thickness = -1;
  expect_refused(helix, "thickness");
  Constant constant;
  constant.tensor(1, 2) = INFINITY;
  expect_refused(constant, "tensor");
}

TEST(Generators, RefuseImpossibleGrids) {
  GridSettings grid;
  grid.resolution = {4, 0, 4};
  EXPECT_THROW(generate(Constant{}, grid), std::invalid_argument);
  grid.resolution = {4, 4, 4};
  grid.max.y() = -2;
  EXPECT_THROW(generate(Constant{}, grid), std::invalid_argument);
  grid.max.y() = grid.min.y();
  EXPECT_THROW(generate(Constant{}, grid), std::invalid_argument);
  EXPECT_THROW(default_grid(Constant{}, 1), std::invalid_argument);
}

TEST(Generators, ASliceHasOneVoxel) {
  GridSettings grid;
  grid.resolution = {5, 1, 9};
  grid.min.y() = grid.max.y() = 0.25;
  const TensorGrid slice = generate(Constant{}, grid);
  EXPECT_EQ(slice.active_voxels(), 45u);
  EXPECT_NEAR((slice.to_world * Vector3d::Zero()).y(), 0.25, 1e-15);
  EXPECT_NEAR(slice.to_world.linear()(1, 1), 0.25, 1e-15);  // Equal to the smaller spacing of the other axes.
  grid.max.y() = 0.75;
  EXPECT_NEAR((generate(Constant{}, grid).to_world * Vector3d::Zero()).y(), 0.5, 1e-15);
}

}  // namespace
}  // namespace tensorray
