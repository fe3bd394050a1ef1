#include "volumes/tensors/isosurface.h"

#include <limits>
#include <random>
#include <stdexcept>

#include <tbb/global_control.h>

#include "base/constants.h"
#include "tests/volumes/grid_support.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/making/generators.h"
#include "volumes/tensors/invariants.h"
#include "volumes/tensors/statistics.h"

namespace tensorray {
namespace {

const Vector3d center(0.11, -0.07, 0.05);

Matrix3d diagonal(double a, double b, double c) { return Vector3d(a, b, c).asDiagonal(); }

/// T = |P − c| I: its greatest eigenvalue is the distance from c.
TensorField distance_field(const AlignedBox3i& box, const Affine3d& to_world) {
  return TensorField(dense_grid(box, to_world, [&](const Vector3i& index) {
    const double distance = (to_world * index.cast<double>() - center).norm();
    return Matrix3d(distance * Matrix3d::Identity());
  }));
}

/// The cube from −1 to 1 with 2 n + 1 voxels along an edge.
TensorField cube(int n) {
  return distance_field({Vector3i::Constant(-n), Vector3i::Constant(n)}, Affine3d(Eigen::Scaling(1.0 / n)));
}

using Triangle = std::array<std::uint32_t, 3>;

Vector3d area_vector(const Isosurface& surface, const Triangle& t) {
  const Vector3d& a = surface.mesh.vertices[t[0]];
  return (surface.mesh.vertices[t[1]] - a).cross(surface.mesh.vertices[t[2]] - a) / 2;
}

double area(const Isosurface& surface) {
  double sum = 0;
  for (const Triangle& triangle : surface.mesh.triangles) sum += area_vector(surface, triangle).norm();
  return sum;
}

double max_radius_error(const Isosurface& surface, double radius) {
  double error = 0;
  for (const Vector3d& vertex : surface.mesh.vertices)
    error = std::max(error, std::abs((vertex - center).norm() - radius));
  return error;
}

/// Smaller values are inside: triangles and normals face the middle.
void expect_inwards(const Isosurface& surface, double tolerance) {
  ASSERT_EQ(surface.normals.size(), surface.mesh.vertices.size());
  for (const Triangle& t : surface.mesh.triangles)
    EXPECT_GE(area_vector(surface, t).dot(center - surface.mesh.vertices[t[0]]), 0);
  for (std::size_t i = 0; i < surface.mesh.vertices.size(); ++i)
    EXPECT_LT((surface.normals[i] - (center - surface.mesh.vertices[i]).normalized()).norm(), tolerance);
}

TEST(IsosurfaceTest, SphereOfSecondOrder) {
  constexpr double radius = 0.6, exact = 4 * pi * radius * radius;
  double radius_error[2], area_error[2];
  for (int i = 0; i < 2; ++i) {
    const int n = 8 << i;
    const double h = 1.0 / n;
    const Isosurface surface = isosurface(cube(n), Invariant::largest_eigenvalue, radius);
    EXPECT_EQ(open_edges(surface.mesh), 0u);
    expect_inwards(surface, 2 * h * h / (radius * radius));
    radius_error[i] = max_radius_error(surface, radius);
    area_error[i] = std::abs(area(surface) - exact);
    EXPECT_LT(radius_error[i], h * h / radius);
    EXPECT_LT(area_error[i], exact * 2 * h * h / (radius * radius));
  }
  EXPECT_LT(radius_error[1], radius_error[0] / 3);
  EXPECT_LT(area_error[1], area_error[0] / 3);
}

TEST(IsosurfaceTest, AnyAffineTransform) {
  Affine3d to_world(Eigen::Translation3d(0.1, 0, -0.1));
  to_world.linear() = 0.1 * sheared_transform().linear();  // Edges of voxels are at most 0.08 long.
  Affine3d mirrored = to_world;
  mirrored.linear().col(1) *= -1;
  for (const Affine3d& transform : {to_world, mirrored}) {
    const TensorField field = distance_field({Vector3i::Constant(-30), Vector3i::Constant(30)}, transform);
    const Isosurface surface = isosurface(field, Invariant::largest_eigenvalue, 0.7);
    EXPECT_EQ(open_edges(surface.mesh), 0u);
    EXPECT_LT(max_radius_error(surface, 0.7), 0.08 * 0.08 / 0.7);
    EXPECT_NEAR(area(surface), 4 * pi * 0.49, 4 * pi * 0.49 * 2 * 0.0064 / 0.49);
    expect_inwards(surface, 0.05);
  }
}

/// A sphere that extends beyond the extent is cut off there and has no caps. The rest has the area by Archimedes.
TEST(IsosurfaceTest, IsOpenAtTheFacesOfTheExtentAndEndsOnThem) {
  const int n = 16;
  const AlignedBox3i box(Vector3i(-n, -n, -n), Vector3i(4, n, n));
  const TensorField field = distance_field(box, Affine3d(Eigen::Scaling(1.0 / n)));
  const Isosurface surface = isosurface(field, Invariant::largest_eigenvalue, 0.6);
  EXPECT_EQ(surface.mesh.bounds().max().x(), 0.25);
  EXPECT_GT(open_edges(surface.mesh), 40u);
  const double exact = 2 * pi * 0.6 * (0.25 - center.x() + 0.6);
  EXPECT_NEAR(area(surface), exact, exact * 0.02);
  EXPECT_LT(max_radius_error(surface, 0.6), 0.5 / n);
}

/// Missing voxels are zero, far from the faces of the extent: a block has a surface half a voxel outside it.
TEST(IsosurfaceTest, InactiveVoxelsCountAsZero) {
  const auto isotropic = [](double value) { return [=](const Vector3i&) { return diagonal(value, value, value); }; };
  TensorGrid grid = unit_voxels({-4, 12, -4}, {4, 20, 4}, isotropic(2));
  for (const int at : {-100, 100}) {
    const TensorGrid far = unit_voxels(Vector3i::Constant(at), Vector3i::Constant(at), isotropic(0.5));
    grid.blocks.insert(at < 0 ? grid.blocks.begin() : grid.blocks.end(), far.blocks.begin(), far.blocks.end());
  }
  const Isosurface surface = isosurface(TensorField(grid), Invariant::trace, 3);
  EXPECT_EQ(open_edges(surface.mesh), 0u);
  const AlignedBox3d box = surface.mesh.bounds();
  EXPECT_LT((box.min() - Vector3d(-4.5, 11.5, -4.5)).norm(), 1e-5);
  EXPECT_LT((box.max() - Vector3d(4.5, 20.5, 4.5)).norm(), 1e-5);
  for (const Triangle& t : surface.mesh.triangles)
    EXPECT_GT(area_vector(surface, t).dot(surface.mesh.vertices[t[0]] - Vector3d(0, 16, 0)), 0);
}

TEST(IsosurfaceTest, EmptyWhereNothingIsOnTheOtherSide) {
  for (const double value : {-1.0, 9.0}) {
    const Isosurface surface = isosurface(cube(4), Invariant::largest_eigenvalue, value);
    EXPECT_TRUE(surface.mesh.triangles.empty()) << value;
    EXPECT_TRUE(surface.mesh.vertices.empty()) << value;
  }
}

TEST(IsosurfaceTest, RefusesWhatHasNoSurface) {
  EXPECT_THROW(isosurface(cube(2), Invariant::norm, std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  const TensorField flat = distance_field({Vector3i(0, 0, 0), Vector3i(4, 4, 0)}, Affine3d::Identity());
  EXPECT_THROW(isosurface(flat, Invariant::norm, 1), std::invalid_argument);
}

TensorGrid stretched_grid(const std::function<Matrix3d(const Vector3i&)>& value) {
  const Affine3d to_world = Eigen::Translation3d(1, 2, 3) * Eigen::Scaling(0.5, 1.0, 2.0);
  return dense_grid({Vector3i(-2, 0, 0), Vector3i(7, 9, 9)}, to_world, value);
}

TEST(FieldStatistics, DescribesTheExtent) {
  const TensorGrid grid = stretched_grid([](const Vector3i&) { return diagonal(1, 1, 1); });
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
  const TensorGrid grid = stretched_grid([](const Vector3i& i) {
    return Matrix3d(((i.x() + 2) * 100 + i.y() * 10 + i.z()) / std::sqrt(3.0) * Matrix3d::Identity());
  });
  const std::array<double, 7> expected{0, 10, 250, 500, 749, 989, 999};
  const FieldStatistics s = field_statistics(grid);
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(s.norm[i], expected[i], 1e-4);
}

TEST(FieldStatistics, EigenvaluesAndFractions) {
  // A tenth of the voxels (x = −2) has the eigenvalues −1 ± 3i and 4. The others are diag(5, 0, 0), neither complex nor
  // negative.
  const TensorGrid grid = stretched_grid([](const Vector3i& i) {
    return i.x() == -2 ? by_rows({-1, -3, 0, 3, -1, 0, 0, 0, 4}) : diagonal(5, 0, 0);
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
  const auto statistics = [](int first) {  // Of a field that is not finite from x = first on.
    return field_statistics(
        stretched_grid([=](const Vector3i& i) { return diagonal(i.x() >= first ? NAN : 2, 2, 2); }));
  };
  const FieldStatistics some = statistics(5), none = statistics(-2);
  EXPECT_EQ(some.active_voxels, 1000u);
  EXPECT_EQ(some.non_finite, 300u);
  EXPECT_EQ(some.index_box.max(), Vector3i(4, 9, 9));
  EXPECT_NEAR(some.norm[6], 2 * std::sqrt(3.0), 1e-6);
  EXPECT_EQ(some.real_max, 2);
  EXPECT_EQ(none.non_finite, 1000u);
  EXPECT_TRUE(none.index_box.isEmpty());
  EXPECT_EQ(none.memory_bytes, 0u);
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

double of(const std::string& name, const Matrix3d& tensor) { return invariant(invariant_of(name), tensor); }

TEST(InvariantTest, DiagonalTensors) {
  const Matrix3d tensor = diagonal(2, -3, 6);
  EXPECT_DOUBLE_EQ(of("norm", tensor), 7);
  EXPECT_DOUBLE_EQ(of("trace", tensor), 5);
  EXPECT_DOUBLE_EQ(of("determinant", tensor), -36);
  EXPECT_NEAR(of("largest_eigenvalue", tensor), 6, 1e-14);
  EXPECT_NEAR(of("middle_eigenvalue", tensor), 2, 1e-14);
  EXPECT_NEAR(of("smallest_eigenvalue", tensor), -3, 1e-14);
  EXPECT_NEAR(of("max_shear", tensor), 4.5, 1e-14);
  EXPECT_NEAR(of("von_mises", tensor), std::sqrt((25 + 81 + 16) / 2.0), 1e-14);  // From the three differences.
  EXPECT_EQ(of("vorticity", tensor), 0);
  EXPECT_EQ(of("swirling_strength", tensor), 0);
  EXPECT_EQ(of("asymmetry", tensor), 0);
}

TEST(InvariantTest, AnisotropyOfLinePlaneAndSphere) {
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(5, 0, 0)), 1, 1e-15);
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(0, 5, 5)), std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(5, 5, 5)), 0, 1e-15);
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(1, 0, -1)), std::sqrt(1.5), 1e-15);
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(1.7, 0.3, 0.3)), 1.4 / std::sqrt(1.7 * 1.7 + 2 * 0.09), 1e-15);
  EXPECT_NEAR(of("mode", diagonal(5, 1, 1)), 1, 1e-14);
  EXPECT_NEAR(of("mode", diagonal(1, 5, 5)), -1, 1e-14);
  EXPECT_NEAR(of("mode", diagonal(3, 2, 1)), 0, 1e-14);
  EXPECT_EQ(of("mode", 3 * Matrix3d::Identity()), 0);
  EXPECT_EQ(of("mode", diagonal(0.1f, 0.1 * (1 + 1e-7), 0.1)), 0);
}

TEST(InvariantTest, RotationAndShear) {
  const Matrix3d rotation = by_rows({0, -2, -2, 2, 0, -1, 2, 1, 0});  // About (1, −2, 2).
  EXPECT_NEAR(of("vorticity", rotation), 6, 1e-14);                   // Twice the rate of rotation.
  EXPECT_NEAR(of("swirling_strength", rotation), 3, 1e-14);
  EXPECT_NEAR(of("asymmetry", rotation), 2, 1e-15);
  EXPECT_EQ(of("fractional_anisotropy", rotation), 0);
  EXPECT_EQ(of("max_shear", rotation), 0);
  const Matrix3d shear = by_rows({0, 0, 4, 0, 0, 0, 0, 0, 0});
  EXPECT_NEAR(of("vorticity", shear), 4, 1e-14);
  EXPECT_NEAR(of("max_shear", shear), 2, 1e-14);
  EXPECT_NEAR(of("von_mises", shear), 2 * std::sqrt(3.0), 1e-14);
  EXPECT_NEAR(of("asymmetry", shear), std::sqrt(2.0), 1e-15);
  // A pair 1 ± 2i and 5: ordered by real parts.
  const Matrix3d spiral = by_rows({1, -2, 0, 2, 1, 0, 0, 0, 5});
  EXPECT_NEAR(of("largest_eigenvalue", spiral), 5, 1e-14);
  EXPECT_NEAR(of("smallest_eigenvalue", spiral), 1, 1e-14);
  EXPECT_NEAR(of("swirling_strength", spiral), 2, 1e-14);
}

TEST(InvariantTest, IsTheSameInAllAxesAndScalesWithItsDegree) {
  std::mt19937 engine(5);
  std::normal_distribution<double> normal;
  const auto random = [&] { return normal(engine); };
  for (int i = 0; i < 200; ++i) {
    const Matrix3d tensor = Matrix3d::NullaryExpr(random);
    const Eigen::Quaterniond turn = Eigen::Quaterniond(Eigen::Vector4d::NullaryExpr(random)).normalized();
    const Matrix3d q = turn.toRotationMatrix();
    for (const std::string& name : invariant_names()) {
      const double value = of(name, tensor);
      // A pair of nearly equal eigenvalues changes with the square root of rounding errors.
      EXPECT_NEAR(of(name, q * tensor * q.transpose()), value, 1e-6 * (1 + std::abs(value))) << name;
      const double power = name == "determinant" ? 3 : value == 0 || of(name, 2 * tensor) == value ? 0 : 1;
      EXPECT_NEAR(of(name, 2 * tensor), std::pow(2, power) * value, 1e-12 * (1 + std::abs(value))) << name;
    }
  }
}

TEST(InvariantTest, IsFiniteForEveryFiniteTensorAndZeroForZero) {
  const double largest = std::numeric_limits<double>::max(), least = std::numeric_limits<double>::denorm_min();
  std::mt19937 engine(7);
  std::uniform_int_distribution<int> choose(0, 6);
  const double numbers[] = {0, 1, -1, largest, -largest, least, -1e-200};
  for (const std::string& name : invariant_names()) {
    EXPECT_EQ(of(name, Matrix3d::Zero()), 0) << name;
    for (int i = 0; i < 300; ++i) {
      const Matrix3d tensor = Matrix3d::NullaryExpr([&] { return numbers[choose(engine)]; });
      EXPECT_TRUE(std::isfinite(of(name, tensor))) << name << " of\n" << tensor;
    }
  }
  EXPECT_NEAR(of("norm", diagonal(3e-200, 4e-200, 0)) / 1e-200, 5, 1e-14);
  EXPECT_NEAR(of("fractional_anisotropy", diagonal(1e300, 0, 0)), 1, 1e-15);
  EXPECT_EQ(of("determinant", diagonal(1e200, 1e200, -1e200)), -largest);
}

}  // namespace
}  // namespace tensorray
