#include "tools/import/sampling/voxel_average.h"

#include <algorithm>

#include <Eigen/Cholesky>

namespace tensorray {

void VoxelAverage::add(const Eigen::Vector3d& position, double weight, const Tensor& tensor) {
  weight_ += weight;
  first_ += weight * position;
  second_.noalias() += (weight * position) * position.transpose();
  sum_ += weight * tensor;
  mixed_.noalias() += (weight * tensor) * position.transpose();
  squares_ += weight * tensor.squaredNorm();
}

VoxelAverage::Tensor VoxelAverage::value() const {
  // Of a voxel that is filled the variance of positions is 1/12. Less than this is none: samples on a plane or a line.
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

}  // namespace tensorray
