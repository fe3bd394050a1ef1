#pragma once
/// @file renderer/density.h
/// Density estimation: from points on a plate to power per pixel.

#include <vector>

#include <Eigen/Core>

#include "renderer/film.h"

namespace tensorray {

enum class DensityKind {
  gaussian,   ///< Zheng and Pang 2003, Eq. 10, corrected: normalised by 2πτ².
  histogram,  ///< Every point counts in the pixel in which it lies.
};

struct DensitySettings {
  DensityKind kind = DensityKind::gaussian;
  double tau = 6;  ///< Standard deviation of the Gaussian, in pixels; >= 0.3.
};

/// Sums points of equal weight, a channel at a time; every pixel then holds the weight that falls on it.
///
/// The Gaussian is folded back at the edges of the plate, so that the sum over the pixels is exactly the number of
/// points, and a uniformly lit plate is uniform up to its edges. For tau >= 2 points are deposited with quintic
/// B-spline weights, and `finish` applies the separable filter that turns them into the spline interpolant of the
/// Gaussian: within 1e-4 of the kernel's peak at τ = 2 and 1e-6 at τ = 6. (Cubic ones cost less than half, but a
/// lattice of points then shows as a ripple above 1e-6.) For a smaller tau each point is drawn with a separable kernel.
/// Both are cut beyond 4.5 τ and normalised.
class DensityEstimator {
 public:
  /// @throw std::invalid_argument if a size is < 1 or tau is out of range.
  DensityEstimator(int width, int height, int channels, const DensitySettings& settings);

  /// Adds `points` (pixel coordinates; within the plate) to a channel, in their order.
  /// Threads: different channels may be filled at the same time.
  void add(int channel, const std::vector<Eigen::Vector2d>& points);

  /// Weight per pixel. The estimator is spent. Runs on all threads; the result does not depend on their number.
  Film finish() &&;

 private:
  DensitySettings settings_;
  Film film_;
};

}  // namespace tensorray
