#pragma once
/// The average of a tensor field over the part of a voxel that a mesh fills.

#include <algorithm>

#include <Eigen/Cholesky>

namespace tensorray {

/// Moments of a tensor field over samples in a voxel. Positions are relative to the voxel's centre, in voxels.
class VoxelAverage {
 public:
  using Tensor = Eigen::Matrix<double, 9, 1>;

  /// Adds samples of a linear function: at coordinates c = (1, c₁, c₂, c₃), the position is `position` c, and the
  /// tensor `tensor` c.
  /// @param moments  Σ w c cᵀ over the samples, where w > 0 is the volume of which a sample is the value.
  void add(const Eigen::Matrix<double, 3, 4>& position, const Eigen::Matrix<double, 9, 4>& tensor,
           const Eigen::Matrix4d& moments) {
    const Eigen::Matrix<double, 3, 4> positions = position * moments;
    const Eigen::Matrix<double, 9, 4> tensors = tensor * moments;
    weight_ += moments(0, 0);
    first_ += positions.col(0);
    second_.noalias() += positions * position.transpose();
    sum_ += tensors.col(0);
    mixed_.noalias() += tensors * position.transpose();
    squares_ += tensors.cwiseProduct(tensor).sum();
  }

  bool empty() const { return weight_ == 0; }

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
    const Eigen::Vector3d centroid = first_ / weight_;
    const Tensor average = sum_ / weight_;
    Eigen::Matrix3d variance = second_ / weight_ - centroid * centroid.transpose();
    variance.diagonal().array() += no_variance;
    const Eigen::Matrix<double, 9, 3> covariance = mixed_ / weight_ - average * centroid.transpose();
    const Eigen::Matrix<double, 9, 3> gradient = variance.ldlt().solve(covariance.transpose()).transpose();
    const double all = squares_ / weight_ - average.squaredNorm();
    const double explained = gradient.cwiseProduct(covariance).sum();
    const double fraction = all > 0 ? std::clamp(4 * explained / all - 3, 0.0, 1.0) : 0.0;
    return average - fraction * gradient * centroid;
  }

 private:
  double weight_ = 0, squares_ = 0;
  Eigen::Vector3d first_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second_ = Eigen::Matrix3d::Zero();
  Tensor sum_ = Tensor::Zero();
  Eigen::Matrix<double, 9, 3> mixed_ = Eigen::Matrix<double, 9, 3>::Zero();
};

}  // namespace tensorray
