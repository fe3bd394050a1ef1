#pragma once
/// @file renderer/sampling/sampling.h
/// Well spread numbers for the dimensions of a path, and warps from the unit square to what they shall choose from.
/// Everything here is a pure function, or belongs to one thread.

#include <cstdint>

#include <Eigen/Core>

namespace tensorray {

/// The numbers of one path, dimension after dimension: each call takes the next one. Every dimension is a
/// Sobol sequence of its own, shuffled and Owen-scrambled by a hash of (seed, pixel, dimension), and `sample` is the
/// index into it (padding: Burley 2020, "Practical Hash-based Owen Scrambling"). So the samples of a pixel are
/// stratified in each dimension, and both numbers of a `next_2d` together: of the first 2^k samples, one is in each
/// elementary interval. Between dimensions and between pixels they are unrelated.
/// Where paths of a pixel branch, set `dimension` so that the same choice always has the same dimension.
struct PathSampler {
  std::uint64_t seed = 0;
  std::uint64_t pixel = 0;   ///< y * width + x.
  std::uint32_t sample = 0;  ///< Of the pixel, from 0; any number of passes goes on counting.
  std::uint32_t dimension = 0;

  double next_1d();           ///< In [0, 1).
  Eigen::Vector2d next_2d();  ///< In [0, 1)²; one dimension, as next_1d.
};

/// An orthonormal, right-handed frame about a unit vector: columns tangent, bitangent, axis (Duff et al. 2017,
/// "Building an Orthonormal Basis, Revisited"). It jumps where axis.z changes its sign.
Eigen::Matrix3d frame_about(const Eigen::Vector3d& axis);

// The warps map `u` of the unit square, evenly spread, to the named density. Neighbours stay neighbours, so that
// stratification survives.

/// The unit disk, evenly: density 1/π (Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square").
Eigen::Vector2d square_to_disk(const Eigen::Vector2d& u);

/// Unit directions about +z with density z/π.
Eigen::Vector3d square_to_cosine_hemisphere(const Eigen::Vector2d& u);

/// Unit directions, evenly: density 1/(4π).
Eigen::Vector3d square_to_sphere(const Eigen::Vector2d& u);

/// Unit directions within `angle` (radians, 0 to π) of +z, evenly: density 1 / cone_solid_angle(angle).
Eigen::Vector3d square_to_cone(const Eigen::Vector2d& u, double angle);

/// 2π (1 − cos angle), exact for small angles also.
double cone_solid_angle(double angle);

/// Barycentric coordinates in a triangle, evenly over its area: density 1/area (Heitz 2019, "A Low-Distortion Map
/// Between Triangle and Square").
Eigen::Vector3d square_to_triangle(const Eigen::Vector2d& u);

}  // namespace tensorray
