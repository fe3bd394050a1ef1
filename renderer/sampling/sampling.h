#pragma once
/// Low-discrepancy numbers for a light path, warps from the unit square to other domains, and discrete distributions.
/// Everything here is a pure function, or belongs to one thread.

#include <algorithm>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// The random numbers that a surface needs.
struct SurfaceNumbers {
  Eigen::Vector2d direction, light;  ///< In [0, 1)²: to choose where light comes from, and to choose a light.
};

/// The random numbers of one light path, as functions of (seed, pixel, sample). Each call of `next_…` takes the next
/// dimension. Each dimension is a separate Sobol sequence, shuffled and Owen-scrambled by a hash of (seed, pixel,
/// dimension); `sample` is the index into it (padding: Burley 2020, "Practical Hash-based Owen Scrambling"). So the
/// samples of a pixel are stratified in each dimension, and the two numbers of `next_2d` are stratified jointly: of the
/// first 2^k samples, one is in each elementary interval. Different dimensions and different pixels are uncorrelated.
/// Where light paths of a pixel branch, set `dimension` so that the same choice always has the same dimension.
///
/// `in_pixel` and `at_surface` have dimensions of their own. The place in the pixel and the numbers of the first
/// surface decide most of what a sample sees: they are one sequence, stratified jointly in four dimensions.
struct PathSampler {
  PathSampler(std::uint64_t seed = 0, std::uint64_t pixel = 0, std::uint32_t sample = 0, std::uint32_t dimension = 0);

  std::uint64_t pixel;   ///< y * width + x.
  std::uint32_t sample;  ///< Index of the sample within the pixel, from 0; further passes continue the count.
  std::uint32_t dimension;
  std::uint64_t key;  ///< Of seed and pixel.

  double next_1d();           ///< In [0, 1).
  Eigen::Vector2d next_2d();  ///< In [0, 1)²; uses up one dimension, as next_1d does.

  Eigen::Vector2d in_pixel() const;  ///< In [0, 1)².
  /// @param depth  Number of the surface along the path, from 1.
  SurfaceNumbers at_surface(int depth) const;
};

/// Chooses with the probability `share`, and keeps `u` (uniform in [0, 1)) uniform for the next choice: one number can
/// choose a lobe and then a direction of the lobe, which keeps the directions of each lobe stratified.
inline bool choose(double share, double& u) {
  const bool chosen = u < share;
  constexpr double below_one = 1 - 0x1p-53;
  u = std::min(chosen ? u / share : (u - share) / (1 - share), below_one);
  return chosen;
}

/// An orthonormal, right-handed frame about a unit vector: columns tangent, bitangent, axis (Duff et al. 2017,
/// "Building an Orthonormal Basis, Revisited"). It is discontinuous where axis.z changes sign.
Eigen::Matrix3d frame_about(const Eigen::Vector3d& axis);

/// The point of the unit circle at `turn` turns from +x towards +y, to 2e-15. @param turn  In [−2, 2].
Eigen::Vector2d circle_at(double turn);

// The warps map `u`, uniform in the unit square, to the stated density. Nearby points stay nearby, so that
// stratification is preserved.

/// Uniform on the unit disk: density 1/π (Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square").
Eigen::Vector2d square_to_disk(const Eigen::Vector2d& u);

/// Unit directions about +z with density z/π.
Eigen::Vector3d square_to_cosine_hemisphere(const Eigen::Vector2d& u);

/// Unit directions, uniform: density 1/(4π).
Eigen::Vector3d square_to_sphere(const Eigen::Vector2d& u);

/// 1 − cos angle; accurate also for small angles.
double one_minus_cosine(double angle);

/// Unit directions with 1 − z below `height` (0 to 2), uniform: density 1 / (2π height).
Eigen::Vector3d square_to_cap(const Eigen::Vector2d& u, double height);

/// Unit directions within `angle` (radians, 0 to π) of +z, uniform: density 1 / cone_solid_angle(angle).
Eigen::Vector3d square_to_cone(const Eigen::Vector2d& u, double angle);

/// 2π (1 − cos angle); accurate also for small angles.
double cone_solid_angle(double angle);

/// Barycentric coordinates in a triangle, uniform over its area: density 1/area (Heitz 2019, "A Low-Distortion Map
/// Between Triangle and Square").
Eigen::Vector3d square_to_triangle(const Eigen::Vector2d& u);

// Random choice of cells, in one or two dimensions, with given relative probabilities. Immutable: any thread may
// sample.

/// Chooses among the cells 0 to size − 1. As a piecewise constant density on [0, 1), cell i has probability(i) * size.
class Distribution1D {
 public:
  /// @param values  Relative probabilities of the cells; finite, >= 0. If all are 0, all cells are equally probable.
  /// @throw std::invalid_argument if there are no values, or one is negative or not finite.
  explicit Distribution1D(const std::vector<double>& values);

  struct Sample {
    int cell = 0;
    double within = 0;  ///< Uniform in [0, 1): the position in the cell, or a number for the next choice.
    double probability = 0;
  };

  /// The cell that contains `u` (in [0, 1)), by inversion: monotonic, and never a cell of probability 0.
  Sample sample(double u) const;
  double probability(int cell) const { return cumulative_[cell + 1] - cumulative_[cell]; }
  double sum() const { return sum_; }  ///< Sum of the values.

 private:
  std::vector<double> cumulative_;  ///< Cumulative probabilities, from 0 to 1.
  double sum_ = 0;
};

/// Chooses among the cells (x, y) of a picture: first a row by the sum of its values, then a cell in it.
class Distribution2D {
 public:
  /// @param values  width * height relative probabilities, row by row, as for Distribution1D.
  /// @throw std::invalid_argument if their number is not width * height, or one is negative or not finite.
  Distribution2D(const std::vector<double>& values, int width, int height);

  struct Sample {
    Eigen::Vector2i cell = Eigen::Vector2i::Zero();
    Eigen::Vector2d within = Eigen::Vector2d::Zero();
    double probability = 0;
  };

  Sample sample(const Eigen::Vector2d& u) const;
  double probability(const Eigen::Vector2i& cell) const;

  double sum() const { return column_.sum(); }

 private:
  std::vector<Distribution1D> rows_;
  Distribution1D column_;
};

}  // namespace tensorray
