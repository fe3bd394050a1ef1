#include "volumes/tensors/eigenvalues.h"

#include <random>

#include <Eigen/LU>

#include "tests/volumes/grid_support.h"

namespace tensorray {
namespace {

constexpr Eigenvalues both[] = {Eigenvalues::absolute, Eigenvalues::positive};

class RandomTensors {
 public:
  Matrix3d general() {
    return Matrix3d::NullaryExpr([&] { return normal_(engine_); });
  }
  Matrix3d symmetric() {
    const Matrix3d half = general();
    return half + half.transpose();
  }
  Matrix3d rotation() {
    const Eigen::Vector4d q = Eigen::Vector4d::NullaryExpr([&] { return normal_(engine_); });
    return Eigen::Quaterniond(q).normalized().toRotationMatrix();
  }
  double exponent(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }

 private:
  std::mt19937 engine_{7};
  std::normal_distribution<double> normal_;
};

/// The pair a ± b i beside the real eigenvalue c.
Matrix3d pair_block(double a, double b, double c) { return by_rows({a, -b, 0, b, a, 0, 0, 0, c}); }

/// What becomes of such a block.
Matrix3d changed_pair(double a, double b, double c, Eigenvalues mode) {
  if (mode == Eigenvalues::absolute) return pair_block(std::hypot(a, b), 0, std::abs(c));
  return a < 0 ? pair_block(-a, -b, std::abs(c)) : pair_block(a, b, std::abs(c));
}

/// Tensors that are made of their eigenvalues in any basis, real ones or with a pair.
TEST(Eigenvalues, AreChangedInAnyBasis) {
  RandomTensors random;
  int compared = 0;
  for (int i = 0; i < 20000; ++i) {
    Matrix3d basis = random.general();
    basis.colwise().normalize();
    const Matrix3d inverse = basis.inverse();
    const Vector3d numbers = random.general().col(0);
    const double a = numbers[0], b = numbers[1], c = numbers[2];
    const bool has_pair = i % 2 == 0;
    const Matrix3d tensor = basis * (has_pair ? pair_block(a, b, c) : Matrix3d(numbers.asDiagonal())) * inverse;
    for (const Eigenvalues mode : both) {
      const Matrix3d block = has_pair ? changed_pair(a, b, c, mode) : Matrix3d(numbers.cwiseAbs().asDiagonal());
      const Matrix3d expected = basis * block * inverse;
      if (expected.norm() > 4 * tensor.norm()) continue;  // Near-nilpotent: the result fades to zero on purpose.
      ++compared;
      const double condition = basis.norm() * inverse.norm();
      bool defective = false;
      ASSERT_LE((with_eigenvalues(tensor, mode, &defective) - expected).norm(),
                1e-14 * condition * condition * tensor.norm())
          << tensor;
      EXPECT_FALSE(defective) << tensor;
    }
  }
  EXPECT_GT(compared, 39000);
}

TEST(Eigenvalues, SymmetricTensorsTakeTheAbsoluteValueOfEachEigenvalue) {
  RandomTensors random;
  for (int i = 0; i < 2000; ++i) {
    const Matrix3d tensor = random.symmetric();
    const Matrix3d absolute = with_eigenvalues(tensor, Eigenvalues::absolute);
    EXPECT_EQ(absolute, with_eigenvalues(tensor, Eigenvalues::positive));
    EXPECT_LE((absolute * absolute - tensor * tensor).norm(), 1e-13 * tensor.squaredNorm());
    EXPECT_GE(eigenvalues(absolute)[2].real(), -1e-14 * tensor.norm());
    EXPECT_LE((absolute - absolute.transpose()).norm(), 1e-14 * tensor.norm());
  }
}

TEST(Eigenvalues, NearlySymmetricTensorsAreLikeSymmetricOnes) {
  RandomTensors random;
  for (int i = 0; i < 2000; ++i) {
    Matrix3d tensor = random.symmetric();
    if (i % 3 == 0) {  // Repeated eigenvalues.
      const Matrix3d rotation = random.rotation();
      tensor = rotation * Vector3d(1, -1, -1).asDiagonal() * rotation.transpose();
    }
    const Matrix3d noise = 1e-9 * random.general();
    const Matrix3d expected = with_eigenvalues(tensor, Eigenvalues::absolute);
    EXPECT_LE((with_eigenvalues(tensor + noise, Eigenvalues::absolute) - expected).norm(), 1e-7) << tensor;
  }
}

TEST(Eigenvalues, ScalesWithTheTensor) {
  RandomTensors random;
  for (const double factor : {1e-300, 1e-30, 1e-12, 3.0, 1e12, 1e30, 1e300}) {
    const Matrix3d tensor = random.general();
    for (const Eigenvalues mode : both) {
      const Matrix3d expected = with_eigenvalues(tensor, mode);
      EXPECT_LE((with_eigenvalues(factor * tensor, mode) / factor - expected).norm(), 1e-12 * expected.norm());
    }
  }
}

TEST(Eigenvalues, OfDefectiveTensors) {
  struct Row {
    const char* name;
    Matrix3d tensor, expected;
    double tolerance;
    bool is_defective = true;
  };
  RandomTensors random;
  const Matrix3d zero = Matrix3d::Zero(), rotation = random.rotation();
  const Matrix3d two = by_rows({2, 1, 0, 0, 2, 0, 0, 0, 5}), three = by_rows({2, 1, 0, 0, 2, 1, 0, 0, 2});
  const Matrix3d negative = by_rows({-2, 1, 0, 0, -2, 0, 0, 0, -5}), mixed = by_rows({-2, 1, 0, 0, -2, 0, 0, 0, 5});
  const Matrix3d shear = by_rows({0, 0, 3, 0, 0, 0, 0, 0, 0}), chain = by_rows({0, 1, 0, 0, 0, 1, 0, 0, 0});
  const Row table[] = {
      {"zero", zero, zero, 0, false},
      {"a Jordan block", two, two, 1e-12},
      {"a threefold one", three, three, 1e-12},
      {"a negative one", negative, -negative, 1e-12},
      {"of both signs", mixed, by_rows({2, -1, 0, 0, 2, 0, 0, 0, 5}), 1e-7},
      {"nilpotent", shear, zero, 0},
      {"nilpotent of degree 3", chain, zero, 0},
      {"nilpotent with a stretch", by_rows({0, 0, 3, 0, 7, 0, 0, 0, 0}), Vector3d(0, 7, 0).asDiagonal(), 1e-12},
      {"turned shear", rotation * shear * rotation.transpose(), zero, 1e-7},
      {"turned chain", rotation * chain * rotation.transpose(), zero, 1e-7}};
  for (const Row& row : table)
    for (const Eigenvalues mode : both) {
      bool defective = false;
      EXPECT_LE((with_eigenvalues(row.tensor, mode, &defective) - row.expected).norm(), row.tolerance) << row.name;
      EXPECT_EQ(defective, row.is_defective) << row.name;
    }
}

TEST(Eigenvalues, SingularButDiagonalisableTensorsAreNotDefective) {
  RandomTensors random;
  for (int i = 0; i < 200; ++i) {
    const Matrix3d basis = random.general();
    const Matrix3d inverse = basis.inverse();
    if (inverse.norm() > 10) continue;
    for (const Eigenvalues mode : both)
      for (const Vector3d& diagonal : {Vector3d(-1, 0, 0), Vector3d(1, -1, 0), Vector3d(2, 2, -1), Vector3d(1, 1, 1)}) {
        const Matrix3d tensor = basis * diagonal.asDiagonal() * inverse;
        bool defective = false;
        const Matrix3d expected = basis * diagonal.cwiseAbs().asDiagonal() * inverse;
        EXPECT_LE((with_eigenvalues(tensor, mode, &defective) - expected).norm(), 1e-9 * basis.norm() * inverse.norm());
        EXPECT_FALSE(defective) << tensor;
      }
  }
}

TEST(Eigenvalues, AlmostSimpleShearBecomesIsotropic) {
  const double k = 2;
  for (const Eigenvalues mode : both)
    for (double epsilon = 0.1; epsilon > 1e-16; epsilon /= 10) {
      // In the (x, z) plane, with an eigenvalue of zero perpendicular to it.
      const Matrix3d shear = by_rows({0, 0, k, 0, 0, 0, epsilon, 0, 0});
      const Matrix3d expected = std::sqrt(k * epsilon) * Vector3d(1, 0, 1).asDiagonal().toDenseMatrix();
      EXPECT_LE((with_eigenvalues(shear, mode) - expected).norm(), 1.5e-6 * k) << epsilon;
    }
}

TEST(Eigenvalues, AntisymmetricTensors) {
  RandomTensors random;
  for (int i = 0; i < 100; ++i) {
    const Vector3d axis = random.rotation() * Vector3d::UnitX();
    const double rate = std::pow(10, random.exponent(-6, 6));
    const Matrix3d tensor = rate * by_rows({0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0});
    const Matrix3d across = Matrix3d::Identity() - axis * axis.transpose();
    bool defective = false;
    EXPECT_LE((with_eigenvalues(tensor, Eigenvalues::absolute, &defective) - rate * across).norm(), 1e-12 * rate);
    EXPECT_FALSE(defective);
    EXPECT_LE((with_eigenvalues(tensor, Eigenvalues::positive, &defective) - tensor).norm(), 1e-12 * rate);
    EXPECT_TRUE(defective);
  }
}

TEST(Eigenvalues, NearDefectiveTensorsStayBounded) {
  RandomTensors random;
  const Matrix3d blocks[] = {by_rows({0, 1, 0, 0, 0, 1, 0, 0, 0}), by_rows({1, 1, 0, 0, 1, 1, 0, 0, 1}),
                             by_rows({0, 1, 0, 0, 0, 0, 0, 0, 0}), by_rows({0, 1, 0, 0, 0, 0, 0, 0, 1})};
  for (int i = 0; i < 40000; ++i) {
    const Matrix3d rotation = random.rotation();
    const Matrix3d noise = std::pow(10, random.exponent(-18, -1)) * random.general();
    const Matrix3f single = (rotation * (blocks[i % 4] + noise) * rotation.transpose()).cast<float>();
    const Matrix3d tensor = single.cast<double>();
    for (const Eigenvalues mode : both) {
      const Matrix3d result = with_eigenvalues(tensor, mode);
      ASSERT_TRUE(result.allFinite()) << tensor;
      EXPECT_LE(result.norm(), 4.0001 * tensor.norm()) << tensor;
    }
  }
}

TensorGrid grid_of(const std::function<Matrix3d(const Vector3i&)>& value) {
  return unit_voxels({-3, 0, 5}, {20, 17, 30}, value);
}

TEST(ApplyEigenvalues, AutomaticIsAbsoluteForSymmetricFieldsOnly) {
  TensorGrid symmetric = grid_of([](const auto& i) -> Matrix3d { return Vector3d(-1, i.x(), 1).asDiagonal(); });
  const EigenvalueReport absolute = apply_eigenvalues(symmetric, Eigenvalues::automatic);
  EXPECT_EQ(absolute.chosen, Eigenvalues::absolute);
  EXPECT_NEAR(absolute.norm_lost, 0, 1e-12);
  EXPECT_EQ(absolute.defective, 0u);
  EXPECT_EQ(symmetric.blocks.front().values[511], Matrix3f(Vector3f(1, 1, 1).asDiagonal()));

  TensorGrid general = grid_of([](const auto&) { return by_rows({-1, 1, 0, 0, -1, 0, 0, 0, -1}); });
  const TensorGrid before = general;
  const EigenvalueReport raw = apply_eigenvalues(general, Eigenvalues::automatic);
  EXPECT_EQ(raw.chosen, Eigenvalues::raw);
  EXPECT_EQ(raw.norm_lost, 0);
  EXPECT_EQ(general.blocks[0].values, before.blocks[0].values);
}

TEST(ApplyEigenvalues, CountsDefectiveVoxelsAndLostNorm) {
  // Half of the voxels hold a simple shear, half a rotation of the same norm. Both are erased, although the rotation
  // becomes a strain of the same size.
  const auto value = [](const Vector3i& i) {
    return i.y() % 2 == 0 ? by_rows({0, 0, std::sqrt(2.0), 0, 0, 0, 0, 0, 0}) : by_rows({0, -1, 0, 1, 0, 0, 0, 0, 0});
  };
  TensorGrid grid = grid_of(value);
  const std::size_t voxels = grid.active_voxels();
  const EigenvalueReport report = apply_eigenvalues(grid, Eigenvalues::absolute);
  EXPECT_EQ(report.chosen, Eigenvalues::absolute);
  EXPECT_EQ(report.defective, voxels / 2);
  EXPECT_NEAR(report.norm_lost, 1, 1e-6);

  grid = grid_of(value);
  EXPECT_NEAR(apply_eigenvalues(grid, Eigenvalues::positive).norm_lost, 0.5, 1e-6);  // `positive` keeps rotation.
}

/// Tensors of every kind that with_eigenvalues treats apart, in single precision.
Matrix3d any_kind(RandomTensors& random, int kind) {
  static const Matrix3d special[] = {
      Matrix3d::Zero(),
      Matrix3d::Identity(),
      by_rows({2, 1, 0, 0, 2, 0, 0, 0, 5}),  // Jordan blocks.
      by_rows({-2, 1, 0, 0, -2, 1, 0, 0, -2}),
      by_rows({-2, 1, 0, 0, -2, 0, 0, 0, 5}),
      by_rows({0, 0, 3, 0, 7, 0, 0, 0, 0}),
      by_rows({0, 1, 0, 0, 0, 1, 0, 0, 0}),
      by_rows({0, 0, 3, 0, 0, 0, 1e-5, 0, 0}),  // Almost a simple shear.
      by_rows({0, -2, 0, 2, 0, 0, 0, 0, 0}),    // Pairs: on the cut of `positive`, and on both sides of it.
      by_rows({0, -2, 0, 2, 0, 0, 0, 0, -3}),
      by_rows({-1, -2, 0, 2, -1, 0, 0, 0, 3}),
      by_rows({1, -2, 0, 2, 1, 0, 0, 0, -3}),
      Vector3d(3, 3, -2).asDiagonal(),
      Vector3d(1, 0, 0).asDiagonal(),
      Vector3d(-1, 1, 0).asDiagonal(),
      Vector3d(-4, -2, -1).asDiagonal()};
  constexpr int count = sizeof special / sizeof special[0];
  const double scale = std::pow(10, random.exponent(-30, 30));
  if (kind % 3 == 1) return scale * random.general();
  if (kind % 3 == 2) return scale * random.symmetric();
  const Matrix3d rotation = kind % 2 == 0 ? random.rotation() : Matrix3d(Matrix3d::Identity());
  Matrix3d tensor = rotation * special[kind / 3 % count] * rotation.transpose();
  if (special[kind / 3 % count].isApprox(special[kind / 3 % count].transpose()))
    tensor = ((tensor + tensor.transpose()) / 2).eval();
  if (kind % 5 == 0) tensor += std::pow(10, random.exponent(-9, -1)) * random.symmetric();
  return scale * tensor;
}

/// Fields are preprocessed in vectors, tensors one by one. Both are in double precision.
TEST(ApplyEigenvalues, AgreesWithSingleTensors) {
  RandomTensors random;
  TensorGrid before = grid_of([](const auto&) { return Matrix3d::Zero(); });
  int kind = 0;
  for_each_value(before, [&](Matrix3f& value) { value = any_kind(random, kind++).cast<float>(); });
  for (const Eigenvalues mode : both) {
    TensorGrid grid = before;
    const EigenvalueReport report = apply_eigenvalues(grid, mode);
    std::size_t defective = 0;
    double norm = 0, erased = 0;
    for (std::size_t b = 0; b < grid.blocks.size(); ++b)
      for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
        if (!before.blocks[b].active[offset]) continue;
        const Matrix3d tensor = before.blocks[b].values[offset].cast<double>();
        bool is_defective = false;
        const Matrix3d expected = with_eigenvalues(tensor, mode, &is_defective);
        const Matrix3d result = grid.blocks[b].values[offset].cast<double>();
        ASSERT_LE((result - expected).norm(), 2e-7 * tensor.norm() + 1e-44) << tensor;
        defective += is_defective;
        norm += tensor.squaredNorm();
        erased += erased_norm(tensor, expected);
        if (tensor == tensor.transpose()) {
          EXPECT_EQ(result, result.transpose());
        }
      }
    EXPECT_EQ(report.defective, defective);
    EXPECT_GT(report.defective, 300u);
    EXPECT_NEAR(report.norm_lost, erased / norm, 1e-9);
  }
}

}  // namespace
}  // namespace tensorray
