#include "volumes/tensors/eigenvalues.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include "volumes/tensors/eigenvalue_vectors.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A tensor counts as a nilpotent Jordan block of three rows if its eigenvalues are below this and the norm of its
/// square is above `chain_square`. (Rounding moves such eigenvalues by the cube root of its size.)
constexpr double chain_tolerance = 2e-5;
constexpr double chain_square = 1e-3;

const Matrix3d identity = Matrix3d::Identity();

double sign_of(double x) { return x < 0 ? -1 : 1; }

bool is_symmetric(const Matrix3d& tensor) { return tensor == tensor.transpose(); }

/// Eigenvalues of any tensor, sorted by falling real part; in a pair, by falling imaginary part.
Eigen::Vector3cd sorted_eigenvalues(const Matrix3d& tensor) {
  Eigen::Vector3cd values = Eigen::EigenSolver<Matrix3d>(tensor, false).eigenvalues();
  std::sort(values.data(), values.data() + 3, [](const auto& a, const auto& b) {
    return a.real() != b.real() ? a.real() > b.real() : a.imag() > b.imag();
  });
  return values;
}

/// Whether a tensor of unit norm with three real eigenvalues has a Jordan block: eigenvalues repeat, and the polynomial
/// with simple zeros at the distinct eigenvalues does not annihilate the tensor.
bool has_jordan_block(const Matrix3d& tensor, const Vector3d& falling) {
  const bool first = falling[0] - falling[1] <= eigenvalue_tolerance,
             second = falling[1] - falling[2] <= eigenvalue_tolerance;
  const double rest = 4 * eigenvalue_tolerance;
  if (first && second) return (tensor - falling.mean() * identity).norm() > rest;
  if (!first && !second) return false;
  const double twice = first ? 0.5 * (falling[0] + falling[1]) : 0.5 * (falling[1] + falling[2]);
  const double once = first ? falling[2] : falling[0];
  return ((tensor - once * identity) * (tensor - twice * identity)).norm() > rest;
}

/// |T| of a tensor of unit norm with real eigenvalues, sorted falling: the Newton polynomial that interpolates |·| at
/// the eigenvalues. Its divided difference [a, b] is ±1 where both signs agree, and [a, b, c] is zero where all three
/// signs agree, so that repeated eigenvalues need no special case. Opposite signs leave c/(c − b), which is in [0, 1].
Matrix3d absolute_of_real(const Matrix3d& tensor, const Vector3d& falling) {
  const int zeros = static_cast<int>((falling.array().abs() <= eigenvalue_tolerance).count());
  if (zeros == 3) return Matrix3d::Zero();
  if (zeros == 2) {  // Interpolation points (0, 0, a), with the derivative of |·| at zero taken as 0.
    const double a = falling[0] > eigenvalue_tolerance ? falling[0] : falling[2];
    return tensor * tensor / std::abs(a);
  }
  if (falling[2] >= 0) return tensor;
  if (falling[0] <= 0) return -tensor;
  // One eigenvalue, `odd`, differs in sign from the others: T sign(T) = ±(T − 2 odd Π), where Π is the projector on its
  // eigenvector.
  const bool odd_negative = falling[1] >= 0;
  const double odd = odd_negative ? falling[2] : falling[0];
  const double near = falling[1], far = odd_negative ? falling[0] : falling[2];
  const Matrix3d numerator = (tensor - near * identity) * (tensor - far * identity) / (odd - far);
  return (odd_negative ? 1 : -1) * (tensor - 2 * (odd / (odd - near)) * numerator);
}

/// |T| of a symmetric tensor; exactly symmetric. Its eigenvalues are in closed form, with an error of about 1e-8: where
/// they are equal, the polynomial does not depend on how they differ.
Matrix3d symmetric_absolute(const Matrix3d& tensor) {
  const double norm = tensor.norm();
  Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
  solver.computeDirect(tensor / norm, Eigen::EigenvaluesOnly);
  const Matrix3d result = norm * absolute_of_real(tensor / norm, solver.eigenvalues().reverse());
  return (result + result.transpose()) / 2;
}

/// The real projector on the eigenvector of the real eigenvalue, along the invariant plane of the pair α ± iβ.
Matrix3d real_projector(const Matrix3d& tensor, double real, std::complex<double> pair) {
  const Matrix3d shifted = tensor - pair.real() * identity;
  const double beta = pair.imag(), distance = real - pair.real();
  return (shifted * shifted + beta * beta * identity) / (distance * distance + beta * beta);
}

Matrix3d absolute_of_pair(const Matrix3d& tensor, double real, std::complex<double> pair) {
  const double modulus = std::abs(pair);
  return modulus * identity + (std::abs(real) - modulus) * real_projector(tensor, real, pair);
}

/// sign(α) T on the plane of the pair, |λ| on the real eigenvector. On the cut, α = 0, T is kept on the plane.
Matrix3d positive_of_pair(const Matrix3d& tensor, double real, std::complex<double> pair, bool& on_cut) {
  on_cut = std::abs(pair.real()) <= eigenvalue_tolerance;
  const double plane = on_cut ? 1 : sign_of(pair.real());
  if (plane == sign_of(real)) return plane * tensor;
  return plane * tensor + 2 * std::abs(real) * real_projector(tensor, real, pair);
}

/// The general case, for a tensor of unit norm.
Matrix3d general_with_eigenvalues(const Matrix3d& tensor, Eigenvalues mode, bool& limit_taken) {
  const Eigen::Vector3cd values = sorted_eigenvalues(tensor);
  if (values.cwiseAbs().maxCoeff() <= chain_tolerance && (tensor * tensor).norm() > chain_square) {
    limit_taken = true;
    return Matrix3d::Zero();
  }
  Eigen::Index upper = 0;
  const double beta = values.imag().maxCoeff(&upper);
  Matrix3d result;
  if (beta <= eigenvalue_tolerance) {
    limit_taken = has_jordan_block(tensor, values.real());
    result = absolute_of_real(tensor, values.real());
  } else {
    const double real = (values.imag().array() == 0).select(values.real(), 0).sum();
    result = mode == Eigenvalues::absolute ? absolute_of_pair(tensor, real, values[upper])
                                           : positive_of_pair(tensor, real, values[upper], limit_taken);
  }
  const double growth = result.norm() / max_growth;
  if (growth <= 1) return result;
  limit_taken = true;
  return result / (growth * growth);
}

/// The tensors of some active voxels side by side, and the offsets of these voxels in their block.
struct VoxelVectors {
  TensorVectors tensors{};
  std::array<int, TensorVectors::capacity> offsets{};
  int count = 0;
};

/// Takes active voxels from `offset` on, as many as there is space for. @return the offset behind them.
int take_voxels(const TensorBlock& block, int offset, VoxelVectors& voxels) {
  voxels.count = 0;
  for (; offset < TensorBlock::voxels && voxels.count < TensorVectors::capacity; ++offset) {
    if (!block.active[offset]) continue;
    const float* const components = block.values[offset].data();
    for (int i = 0; i < 9; ++i) voxels.tensors.tensor[i][voxels.count] = components[i];
    voxels.offsets[voxels.count++] = offset;
  }
  return offset;
}

/// Writes the result of one tensor to its voxel.
void put_back(const VoxelVectors& voxels, int i, Eigenvalues mode, TensorBlock& block, EigenvalueSums& report) {
  const TensorVectors& tensors = voxels.tensors;
  Eigen::Matrix3f& value = block.values[voxels.offsets[i]];
  report.norm += tensors.squared_norm[i];
  if (tensors.left[i] == 0) {
    for (int k = 0; k < 9; ++k) value.data()[k] = static_cast<float>(tensors.result[k][i]);
    report.erased += tensors.erased[i];
    report.defective += tensors.defective[i] != 0;
    return;
  }
  const Matrix3d tensor = value.cast<double>();
  bool defective = false;
  const Matrix3d result = with_eigenvalues(tensor, mode, &defective);
  value = result.cast<float>();
  report.erased += erased_norm(tensor, result);
  report.defective += defective;
}

}  // namespace

Matrix3d with_eigenvalues(const Matrix3d& tensor, Eigenvalues mode, bool* defective) {
  if (mode != Eigenvalues::absolute && mode != Eigenvalues::positive)
    throw std::invalid_argument("with_eigenvalues: mode must be absolute or positive");
  const double largest = tensor.cwiseAbs().maxCoeff();
  if (largest == 0) return Matrix3d::Zero();
  const Matrix3d scaled = tensor / largest;  // The norm of `scaled` neither overflows nor underflows.
  if (is_symmetric(tensor)) return largest * symmetric_absolute(scaled);
  bool limit_taken = false;
  const double norm = scaled.norm();
  const Matrix3d result = largest * (norm * general_with_eigenvalues(scaled / norm, mode, limit_taken));
  if (limit_taken && defective) *defective = true;
  return result;
}

double erased_norm(const Matrix3d& before, const Matrix3d& after) {
  const auto part = [](const Matrix3d& tensor, double sign) {
    return (tensor + sign * tensor.transpose()).squaredNorm() / 4;
  };
  return std::max(0.0, part(before, -1) - part(after, -1)) + std::max(0.0, part(before, 1) - part(after, 1));
}

void EigenvalueSums::add(const EigenvalueSums& other) {
  defective += other.defective;
  norm += other.norm;
  erased += other.erased;
}

EigenvalueSums apply_eigenvalues(TensorBlock& block, Eigenvalues mode) {
  EigenvalueSums sums;
  VoxelVectors voxels;
  for (int offset = 0; offset < TensorBlock::voxels;) {
    offset = take_voxels(block, offset, voxels);
    compute_with_eigenvalues(voxels.tensors, voxels.count, mode == Eigenvalues::positive);
    for (int i = 0; i < voxels.count; ++i) put_back(voxels, i, mode, block, sums);
  }
  return sums;
}

EigenvalueReport report_of(const EigenvalueSums& sums, Eigenvalues chosen) {
  return {chosen, sums.defective, sums.norm > 0 ? sums.erased / sums.norm : 0};
}

Eigenvalues automatic_choice(double asymmetry) {
  return asymmetry < symmetric_tolerance ? Eigenvalues::absolute : Eigenvalues::raw;
}

Eigen::Vector3cd eigenvalues(const Matrix3d& tensor) {
  if (!is_symmetric(tensor)) return sorted_eigenvalues(tensor);
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(tensor, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().reverse().cast<std::complex<double>>();
}

}  // namespace tensorray
