#include "renderer/color/chromaticities.h"

#include <Eigen/LU>

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d chromaticity_of(const Vector3d& xyz) { return xyz.head<2>() / xyz.sum(); }

}  // namespace

Chromaticities chromaticities_of(const std::array<double, 8>& n) {
  return {{n[0], n[1]}, {n[2], n[3]}, {n[4], n[5]}, {n[6], n[7]}};
}

std::array<double, 8> numbers_of(const Chromaticities& c) {
  return {c.red.x(), c.red.y(), c.green.x(), c.green.y(), c.blue.x(), c.blue.y(), c.white.x(), c.white.y()};
}

Vector3d xyz_of(const Vector2d& c) { return {c.x() / c.y(), 1, (1 - c.x() - c.y()) / c.y()}; }

Matrix3d rgb_to_xyz(const Chromaticities& colors) {
  Matrix3d primaries;  // X, Y and Z of each in proportion: y may be 0.
  const auto direction = [](const Vector2d& c) { return Vector3d(c.x(), c.y(), 1 - c.x() - c.y()); };
  primaries << direction(colors.red), direction(colors.green), direction(colors.blue);
  return primaries * (primaries.inverse() * xyz_of(colors.white)).asDiagonal();
}

std::optional<Matrix3d> adaptation(const Vector3d& from, const Vector3d& to) {
  constexpr double min_response = 0.01;
  Matrix3d cones;  // Of Bradford.
  cones << 0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296;
  const Vector3d response = (cones * from).cwiseQuotient(cones * to);
  if (!(response.minCoeff() > min_response)) return std::nullopt;
  return cones.inverse() * response.cwiseInverse().asDiagonal() * cones;
}

Chromaticities named_chromaticities(const Matrix3d& matrix) {
  constexpr double rounding = 2e-3;  // Of the matrices' entries; configs have numbers of six digits, and other D65s.
  const Vector2d d65 = d65_white(), aces = aces_white();
  for (const Chromaticities& named :
       {rec709_chromaticities(), Chromaticities{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, d65},
        Chromaticities{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, d65},
        Chromaticities{{0.64, 0.33}, {0.21, 0.71}, {0.15, 0.06}, d65},
        Chromaticities{{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, aces},
        Chromaticities{{0.7347, 0.2653}, {0, 1}, {0.0001, -0.0770}, aces}}) {
    const Matrix3d to_d65 = *adaptation(xyz_of(named.white), xyz_of(d65)) * rgb_to_xyz(named);
    if ((to_d65 - matrix).cwiseAbs().maxCoeff() < rounding) return named;
  }
  return {chromaticity_of(matrix.col(0)), chromaticity_of(matrix.col(1)), chromaticity_of(matrix.col(2)),
          chromaticity_of(matrix.rowwise().sum())};
}

}  // namespace tensorray
