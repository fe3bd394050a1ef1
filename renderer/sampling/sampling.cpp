#include "renderer/sampling/sampling.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "renderer/sampling/random.h"

namespace tensorray {
namespace {

/// The seed of the sequence of the current dimension: the 53 random bits of the hash.
std::uint64_t sequence_seed(const PathSampler& path) {
  return static_cast<std::uint64_t>(random_uniform(path.seed, path.pixel, path.dimension) * 0x1p53);
}

/// The direction about +z with 1 − cos θ = `height`. Uses 1 − cos θ, because cos θ is not accurate enough for small
/// angles.
Eigen::Vector3d direction_at(double height, double turn) {
  const double across = std::sqrt(std::max(0.0, height * (2 - height)));
  return {across * std::cos(2 * pi * turn), across * std::sin(2 * pi * turn), 1 - height};
}

double one_minus_cosine(double angle) { return 2 * std::pow(std::sin(angle / 2), 2); }

}  // namespace

double PathSampler::next_1d() {
  const std::uint64_t sequence = sequence_seed(*this);
  ++dimension;
  return sobol(sequence, sample, 0);
}

Eigen::Vector2d PathSampler::next_2d() {
  const std::uint64_t sequence = sequence_seed(*this);
  ++dimension;
  const auto [x, y] = sobol_pair(sequence, sample);
  return {x, y};
}

Eigen::Matrix3d frame_about(const Eigen::Vector3d& axis) {
  const double sign = std::copysign(1.0, axis.z());
  const double a = -1 / (sign + axis.z()), b = axis.x() * axis.y() * a;
  Eigen::Matrix3d frame;
  frame.col(0) << 1 + sign * axis.x() * axis.x() * a, sign * b, -sign * axis.x();
  frame.col(1) << b, sign + axis.y() * axis.y() * a, -axis.y();
  frame.col(2) = axis;
  return frame;
}

Eigen::Vector2d square_to_disk(const Eigen::Vector2d& u) {
  const Eigen::Vector2d p = 2 * u - Eigen::Vector2d::Ones();
  if (p.isZero(0)) return Eigen::Vector2d::Zero();
  const bool along_x = std::abs(p.x()) > std::abs(p.y());
  const double radius = along_x ? p.x() : p.y();
  const double angle = along_x ? pi / 4 * p.y() / p.x() : pi / 2 - pi / 4 * p.x() / p.y();
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

Eigen::Vector3d square_to_cosine_hemisphere(const Eigen::Vector2d& u) {
  const Eigen::Vector2d p = square_to_disk(u);
  return {p.x(), p.y(), std::sqrt(std::max(0.0, 1 - p.squaredNorm()))};
}

Eigen::Vector3d square_to_sphere(const Eigen::Vector2d& u) { return direction_at(2 * u.x(), u.y()); }

Eigen::Vector3d square_to_cone(const Eigen::Vector2d& u, double angle) {
  return direction_at(one_minus_cosine(angle) * u.x(), u.y());
}

double cone_solid_angle(double angle) { return 2 * pi * one_minus_cosine(angle); }

Eigen::Vector3d square_to_triangle(const Eigen::Vector2d& u) {
  const double half = std::min(u.x(), u.y()) / 2;
  const double b0 = u.x() < u.y() ? half : u.x() - half;
  const double b1 = u.x() < u.y() ? u.y() - half : half;
  return {b0, b1, 1 - b0 - b1};
}

}  // namespace tensorray
