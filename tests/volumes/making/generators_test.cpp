#include "volumes/making/generators.h"

#include <functional>

#include "base/constants.h"
#include "tests/volumes/grid_support.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/sampling/tensor_sampler.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {
namespace {

void for_each(const TensorGrid& grid, const std::function<void(const Vector3d&, const Matrix3d&)>& visit) {
  for_each_active(grid, [&](const Vector3i& index, const Matrix3f& tensor) {
    visit(grid.to_world * index.cast<double>(), tensor.cast<double>());
  });
}

Matrix3d sampled(const Generator& generator, const Vector3d& position) {
  GridSettings grid;
  grid.resolution.setOnes();
  grid.min = grid.max = position;
  return find(generate(generator, grid), {0, 0, 0})->cast<double>();
}

/// The gradient of a velocity by central differences: exact for a quadratic.
Matrix3d differences(const std::function<Vector3d(const Vector3d&)>& velocity, const Vector3d& p, double h) {
  Matrix3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = h * Vector3d::Unit(axis);
    gradient.col(axis) = (velocity(p + step) - velocity(p - step)) / (2 * h);
  }
  return gradient;
}

/// Points, or discs of their radius.
TEST(Loads, HaveTheStressOfEach) {
  for (const double radius : {0.0, 0.2}) {
    const auto stress = [&](const Vector3d& p, double load) {
      return radius > 0 ? disc_load_stress(p, load, radius, 0.3) : point_load_stress(p, load, 0.3);
    };
    const PointLoad load{1, 0.3, radius};
    for_each(generate(load, default_grid(load, 17)), [&](const Vector3d& p, const Matrix3d& tensor) {
      ASSERT_LE((tensor - stress(p, 1)).norm(), 1e-6 * stress(p, 1).norm());
    });
    TwoPointLoad loads;
    loads.second_load = 2;
    loads.radius = radius;
    const Vector3d half(0.4, 0, 0);
    for_each(generate(loads, default_grid(loads, 17)), [&](const Vector3d& p, const Matrix3d& tensor) {
      const Matrix3d expected = stress(p + half, 1) + stress(p - half, 2);
      ASSERT_LE((tensor - expected).norm(), 1e-6 * expected.norm());
    });
  }
}

TEST(Rotation, TurnsAboutItsAxis) {
  Rotation rotation;
  rotation.axis = {1, 2, -2};
  rotation.rate = 5;
  const Matrix3d tensor = sampled(rotation, {0.1, -0.2, 0.5});
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
    ASSERT_LE((tensor - differences(velocity, p, 0.01)).colwise().norm().maxCoeff(), 1e-6);
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
  const auto check = [&](const Vector3d& p, const Matrix3d& tensor) {
    // h²/6 times a third derivative of about rate/core², and single precision.
    ASSERT_LE((tensor - differences(velocity, p, 1e-4)).norm(), 1e-5) << p.transpose();
    ASSERT_NEAR(tensor.trace(), 0, 1e-6);
  };
  for_each(generate(vortex, default_grid(vortex, 17)), check);
  GridSettings axis = default_grid(vortex, 9);  // Close to the axis, across the change to the series.
  axis.min.setConstant(-0.05);
  axis.max.setConstant(0.05);
  for_each(generate(vortex, axis), check);
}

TEST(Helix, HasItsEigenvaluesOnTheCurve) {
  const Helix helix;
  for (const double angle : {0.0, 0.7, 2.0, 4.0, 9.0}) {
    const double rise = helix.pitch / (2 * pi);
    const Vector3d on(helix.radius * std::cos(angle), helix.radius * std::sin(angle), rise * angle);
    const Matrix3d tensor = sampled(helix, on);
    const Vector3d tangent = Vector3d(-on.y(), on.x(), rise).normalized();
    EXPECT_LE((tensor * tangent - helix.along * tangent).norm(), 1e-6);
    EXPECT_NEAR(eigenvalues(tensor)[1].real(), helix.across, 1e-6);
    EXPECT_NEAR(eigenvalues(tensor)[2].real(), helix.across, 1e-6);
  }
}

TEST(Helix, IsContinuousAndIsotropicFarAway) {
  const Helix helix;
  const auto sample = [&](const Vector3d& p) { return sampled(helix, p); };
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
    EXPECT_EQ(grid.active_box().min(), Vector3i(0, 0, 0));
    EXPECT_LE((grid.to_world * Vector3d(0, 0, 0) - settings.min).norm(), 1e-14);
    EXPECT_LE((grid.to_world * grid.active_box().max().cast<double>() - settings.max).norm(), 1e-14);
    const Matrix3d axes = grid.to_world.linear();
    EXPECT_TRUE(axes.isApprox(axes(0, 0) * Matrix3d::Identity(), 1e-14)) << "voxels are cubes";
  }
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
  constant.tensor = by_rows({1, 2, 3, 4, 5, 6, 7, 8, 9});
  EXPECT_THAT(generate(constant, default_grid(constant, 2)).metadata.at("tensorray:source"),
              HasSubstr("tensor=1,2,3,4,5,6,7,8,9 "));
}

template <class G, class Value>
void expect_refused(Value G::*parameter, const Value& value, const std::string& name) {
  G generator;
  generator.*parameter = value;
  EXPECT_THAT([&] { generate(generator, default_grid(generator, 3)); },
              ThrowsMessage<std::invalid_argument>(StartsWith(name)));
}

TEST(Generators, RefuseParametersOutOfRange) {
  expect_refused(&PointLoad::poisson_ratio, 0.6, "poisson_ratio");
  expect_refused(&PointLoad::radius, -0.1, "radius");
  expect_refused<PointLoad, double>(&PointLoad::load, NAN, "load");
  expect_refused<Rotation, Vector3d>(&Rotation::axis, Vector3d::Zero(), "axis");
  expect_refused<Shear, Vector3d>(&Shear::gradient, Vector3d::Zero(), "gradient");
  expect_refused(&Vortex::core, 0.0, "core");
  expect_refused(&Helix::thickness, -1.0, "thickness");
  expect_refused<Constant, Matrix3d>(&Constant::tensor, Matrix3d::Constant(INFINITY), "tensor");
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

/// Nearer to the load, the field of finer levels is nearer to the formula.
TEST(Generators, LevelsRefineTowardsTheLoad) {
  const PointLoad load;
  GridSettings settings = default_grid(load, 33);
  double errors[3];
  for (const int levels : {1, 2, 3}) {
    settings.levels = levels;
    const TensorField field(generate(load, settings), {Interpolation::cubic});
    EXPECT_EQ(field.levels(), levels);
    TensorSampler sampler(field);
    double& error = errors[levels - 1] = 0;
    for (int i = 0; i < 50; ++i) {
      const Vector3d at(0.1 * std::cos(i), 0.1 * std::sin(i), -0.08 - 0.002 * i);
      const Matrix3d exact = point_load_stress(at, load.load, load.poisson_ratio);
      error = std::max(error, (sampler.at(at) - exact).norm() / exact.norm());
    }
  }
  EXPECT_LT(errors[1], errors[0] / 4);
  EXPECT_LT(errors[2], errors[1] / 4);
  settings.levels = 2;
  EXPECT_THROW(generate(Constant{}, settings), std::invalid_argument);
  settings.levels = 5;
  EXPECT_THROW(generate(load, settings), std::invalid_argument);
}

/// Second differences of a function at p: the matrix of its second derivatives.
Matrix3d hessian(const std::function<double(const Vector3d&)>& value, const Vector3d& p, double h) {
  Matrix3d result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Vector3d a = h * Vector3d::Unit(i), b = h * Vector3d::Unit(j);
      result(i, j) = (value(p + a + b) - value(p + a - b) - value(p - a + b) + value(p - a - b)) / (4 * h * h);
    }
  return result;
}

struct Load {
  const char* name;
  double ratio;
  std::function<Matrix3d(const Vector3d&)> stress;
};

std::vector<Load> loads() {
  std::vector<Load> result;
  for (const double ratio : {-0.5, 0.0, 0.3, 0.5}) {
    result.push_back({"point", ratio, [ratio](const Vector3d& p) { return point_load_stress(p, 1, ratio); }});
    result.push_back({"disc", ratio, [ratio](const Vector3d& p) { return disc_load_stress(p, 1, 0.6, ratio); }});
  }
  return result;
}

// Inside and outside the disc's cylinder and the unit ball, and on the axis.
const std::vector<Vector3d> positions{
    {0.3, -0.2, -0.5}, {0, 0, -1}, {1e-9, 0.4, -0.1}, {1, 0.2, -0.3}, {0.1, 0.1, -0.3}};

TEST(LoadStress, IsInEquilibrium) {
  const double h = 1e-4;
  for (const Load& load : loads())
    for (const Vector3d& p : positions) {
      Vector3d divergence;
      for (int i = 0; i < 3; ++i)
        divergence[i] = differences([&](const Vector3d& q) -> Vector3d { return load.stress(q).row(i); }, p, h).trace();
      // The error of central differences is h²/6 times a third derivative, which is of the order of 60 σ / |p|³.
      const double scale = load.stress(p).norm() / std::pow(p.norm(), 3);
      EXPECT_LE(divergence.norm(), 60 * h * h * scale + 1e-10)
          << load.name << " " << load.ratio << " " << p.transpose();
    }
}

TEST(LoadStress, IsCompatible) {
  // Beltrami and Michell: ∇²σ + ∇∇ tr σ / (1 + ν) = 0. The error of second differences, which are over 2h, is (2h)²/12
  // times a fourth derivative, which is of the order of 360 σ / |p|⁴, for six terms.
  const double h = 1e-3;
  for (const Load& load : loads())
    for (const Vector3d& p : positions) {
      const Matrix3d trace = hessian([&](const Vector3d& q) { return load.stress(q).trace(); }, p, h);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const double laplacian = hessian([&](const Vector3d& q) { return load.stress(q)(i, j); }, p, h).trace();
          const double scale = load.stress(p).norm() / std::pow(p.norm(), 4);
          EXPECT_LE(std::abs(laplacian + trace(i, j) / (1 + load.ratio)), 6 * 360.0 / 12 * 4 * h * h * scale + 1e-8)
              << load.name << " " << load.ratio << " " << p.transpose() << " " << i << j;
        }
    }
}

TEST(LoadStress, PlaneBelowCarriesTheLoad) {
  // The force of the lower part on the upper part through z = −1, by quadrature in rings r = tan(θ). It balances the
  // load.
  for (const Load& load : loads()) {
    Vector3d force = Vector3d::Zero();
    const int rings = 2000, spokes = 8;
    for (int i = 0; i < rings * spokes; ++i) {
      const double angle = (i / spokes + 0.5) / rings * pi / 2, r = std::tan(angle), turn = 2 * pi * i / spokes;
      const double area = r / std::pow(std::cos(angle), 2) * (pi / 2 / rings) * (2 * pi / spokes);
      force -= area * load.stress({r * std::cos(turn), r * std::sin(turn), -1}).col(2);
    }
    EXPECT_LE((force - Vector3d(0, 0, 1)).norm(), 1e-5) << load.name << " " << load.ratio;
  }
}

TEST(LoadStress, SurfaceHasTheTractionOfTheLoad) {
  const Matrix3d point = point_load_stress({0.3, 0.4, 0}, 2, 0.3);
  EXPECT_EQ(point.col(2), Vector3d(Vector3d::Zero()));
  EXPECT_GT(point.norm(), 0.1);
  EXPECT_LE((point - point.transpose()).norm(), 1e-15);

  const double radius = 0.6, greatest = 3 * 2 / (2 * pi * radius * radius);
  for (const double r : {0.0, 0.1, 0.5, 0.59999, 0.6, 0.7, 3.0}) {
    const Vector3d p(0.6 * r, 0.8 * r, 0);
    const Matrix3d disc = disc_load_stress(p, 2, radius, 0.3);
    const double pressure = greatest * std::sqrt(std::max(0.0, 1 - p.squaredNorm() / (radius * radius)));
    EXPECT_LE((disc.col(2) - Vector3d(0, 0, -pressure)).norm(), 1e-7 * greatest) << r;
    EXPECT_TRUE(disc == disc.transpose()) << r;
    // Beside the disc, the surface is as under a point.
    if (r > 0.6) {
      EXPECT_LE((disc - point_load_stress(p, 2, 0.3)).norm(), 1e-13) << r;
    }
  }
}

}  // namespace
}  // namespace tensorray
