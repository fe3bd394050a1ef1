#pragma once
/// The average of a tensor field over the part of a voxel that a mesh fills.

#include <algorithm>

#include <Eigen/Cholesky>

namespace tensorray {

/// Moments of a tensor field over samples in a voxel. Positions are relative to the voxel's centre, in voxels.
class VoxelAverage {
 public:
  using Tensor = Eigen::Matrix<double, 9, 1>;

  /// Tensors that are linear in coordinates c = (1, c₁, c₂, c₃), as a row for each of these.
  using Linear = Eigen::Matrix<double, 4, 9>;

  /// Adds samples at positions (1, p) = `place` c with the tensors `linear`ᵀ c.
  /// @param squares  `linear` `linear`ᵀ.
  /// @param moments  Σ w c cᵀ over the samples, where w > 0 is the volume of which a sample is the value.
  void add(const Eigen::Matrix4d& place, const Linear& linear, const Eigen::Matrix4d& squares,
           const Eigen::Matrix4d& moments) {
    const Eigen::Matrix4d placed = place * moments;
    positions_.noalias() += placed * place.transpose();
    tensors_.noalias() += placed * linear;
    squares_ += squares.cwiseProduct(moments).sum();
  }

  bool empty() const { return positions_(0, 0) == 0; }

  /// The average, corrected for samples that are not centred in the voxel: because the body fills the voxel in part,
  /// or because samples belong to one voxel as wholes. A linear function is fitted by least squares, and what it
  /// changes from the centre to the centroid of the samples is subtracted: in full if it explains all of the tensor's
  /// variance, not at all if it explains less than 3/4. So a linear field gives its value at the centre, whatever the
  /// samples' positions, and a layer that is thinner than the voxel gives its plain average, as a line fitted to it
  /// says nothing.
  Tensor value() const {
    // Of a voxel that is filled the variance of positions is 1/12. Less than this is none: samples on a plane or a
    // line.
    constexpr double no_variance = 1e-9;
    const double weight = positions_(0, 0);
    const Eigen::Vector3d centroid = positions_.col(0).tail<3>() / weight;
    const Tensor average = tensors_.row(0).transpose() / weight;
    Eigen::Matrix3d variance = positions_.bottomRightCorner<3, 3>() / weight - centroid * centroid.transpose();
    variance.diagonal().array() += no_variance;
    const Eigen::Matrix<double, 9, 3> covariance =
        tensors_.bottomRows<3>().transpose() / weight - average * centroid.transpose();
    const Eigen::Matrix<double, 9, 3> gradient = variance.ldlt().solve(covariance.transpose()).transpose();
    const double all = squares_ / weight - average.squaredNorm();
    const double explained = gradient.cwiseProduct(covariance).sum();
    const double fraction = all > 0 ? std::clamp(4 * explained / all - 3, 0.0, 1.0) : 0.0;
    return average - fraction * gradient * centroid;
  }

 private:
  // Sums of w (1, p) (1, p)ᵀ, of w (1, p) Tᵀ, and of w ‖T‖². Columns of four fill registers.
  Eigen::Matrix4d positions_ = Eigen::Matrix4d::Zero();
  Linear tensors_ = Linear::Zero();
  double squares_ = 0;
};

}  // namespace tensorray
