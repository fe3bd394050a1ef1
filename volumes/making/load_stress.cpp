#include "volumes/making/load_stress.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// 1 − s atan(1/s) for s >= 0, without the loss of digits where s is large.
double arc_deficit(double s) {
  if (s < 100) return 1 - s * std::atan2(1, s);
  const double t = 1 / (s * s);
  return t * (1.0 / 3 - t * (1.0 / 5 - t / 7));
}

}  // namespace

Matrix3d point_load_stress(const Vector3d& position, double load, double poisson_ratio) {
  // Timoshenko's cylindrical components, with depth = −z, regrouped so that nothing is divided by the distance to the
  // axis. The radial part is −3 depth p pᵀ/R⁵; the rest lies in the plane of the surface.
  const double depth = -position.z(), distance = position.norm();
  const double cube = distance * distance * distance, reach = distance + depth;
  // A product of a vector with itself is symmetric, bit for bit; with a factor in the same expression it need not be.
  const Matrix3d square = position * position.transpose();
  Matrix3d tensor = -3 * depth / (cube * distance * distance) * square;
  const double compressibility = 1 - 2 * poisson_ratio;
  const Vector2d across = position.head<2>();
  const Matrix2d across_square = across * across.transpose();
  tensor.topLeftCorner<2, 2>() += compressibility * ((depth / cube - 1 / (distance * reach)) * Matrix2d::Identity() +
                                                     (distance + reach) / (cube * reach * reach) * across_square);
  return load / (2 * pi) * tensor;
}

Matrix3d disc_load_stress(const Vector3d& position, double load, double radius, double poisson_ratio) {
  // Huber's components with lengths in radii. An ellipsoid confocal to the disc goes through the position; its half
  // axis is s: r²/(1 + s²) + depth²/s² = 1. Then q = depth/s, and s² + q² = root. The components are regrouped so that
  // nothing is divided by r, and that no large terms cancel.
  const Vector2d across = position.head<2>() / radius;
  const double depth = std::max(0.0, -position.z() / radius);
  const double b = across.squaredNorm() + depth * depth - 1;
  const double root = std::hypot(b, 2 * depth);
  if (root == 0) return Matrix3d::Zero();  // On the edge of the disc there is no pressure.
  const double s = b < 0 ? std::sqrt(2 / (root - b)) * depth : std::sqrt((root + b) / 2);
  const double q = b < 0 ? std::sqrt((root - b) / 2) : depth / s;

  const double w = 1 / (1 + s * s);
  const double compressibility = 1 - 2 * poisson_ratio;
  const double around = -compressibility / 3 * w * (1 + q + q * q) / (1 + q) +
                        q * ((1 - poisson_ratio) * w - (1 + poisson_ratio) * arc_deficit(s));
  // (radial − around) / r².
  const double difference = w * w * (compressibility * (2 + q) / (3 * (1 + q) * (1 + q)) - q * s * s / root);

  Matrix3d tensor = Matrix3d::Zero();
  const Matrix2d across_square = across * across.transpose();
  tensor.topLeftCorner<2, 2>() = around * Matrix2d::Identity() + difference * across_square;
  tensor.topRightCorner<2, 1>() = q * q * s * w / root * across;
  tensor.bottomLeftCorner<1, 2>() = tensor.topRightCorner<2, 1>().transpose();
  tensor(2, 2) = -q * q * q / root;
  return 3 * load / (2 * pi * radius * radius) * tensor;
}

}  // namespace tensorray
