#pragma once
/// @file renderer/film/density.h
/// Density estimation: from points on a plate to power per pixel.

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/film/film.h"
#include "renderer/film/kernel_deposit.h"
#include "renderer/film/point_buckets.h"

namespace tensorray {

enum class DensityKind {
  gaussian,   ///< Zheng and Pang 2003, Eq. 10, corrected: normalised by 2πτ².
  histogram,  ///< Every point counts in the pixel in which it lies.
};

struct DensitySettings {
  DensityKind kind = DensityKind::gaussian;
  double tau = 6;  ///< Standard deviation of the Gaussian, in pixels; >= 0.3.
};

/// Sums points of equal weight; every pixel then holds the weight that falls on it. Points have a channel each. The
/// film has a plane for each channel; or, if channels have colours, three planes: red, green and blue, to which each
/// point adds its channel's colour. That is the same picture as colouring the channels' planes afterwards, in a third
/// of the time for 32 channels.
///
/// The Gaussian is folded back at the edges of the plate, so that the sum over the pixels is exactly the number of
/// points, and a uniformly lit plate is uniform up to its edges. For tau >= 2 points are deposited with quintic
/// B-spline weights, and `finish` applies the separable filter that turns them into the spline interpolant of the
/// Gaussian: within 1e-4 of the kernel's peak at τ = 2 and 1e-6 at τ = 6. (Cubic ones cost about half, but a
/// lattice of points then shows as a ripple above 1e-6.) For a smaller tau each point is drawn with a separable kernel.
/// Both are cut beyond 4.5 τ and normalised. A point's place is rounded to 2^-25 of a pixel.
class DensityEstimator {
 public:
  /// @param colors  A colour for each channel; or none.
  /// @throw std::invalid_argument if a size is < 1 or > 65000, tau is out of range, or not all channels have a colour.
  DensityEstimator(int width, int height, int channels, const DensitySettings& settings,
                   const std::vector<Eigen::Vector3d>& colors = {});

  /// A point of a channel as `add` takes it. @param at  Pixel coordinates; within the plate. Any thread may call it.
  DensityPoint point(int channel, const Eigen::Vector2d& at) const;

  /// Adds points; those that are nowhere are left out. Runs on all threads; the sums are made in the points' order, so
  /// that they do not depend on the number of threads.
  void add(const std::vector<DensityPoint>& points);

  /// Weight per pixel, `weight` being that of a point. The estimator is spent. Runs on all threads; the result does not
  /// depend on their number.
  Film finish(double weight = 1) &&;

 private:
  std::size_t plane_size() const;
  void deposit(std::uint32_t bucket);
  void fold_rows(int plane);

  DensitySettings settings_;
  int width_, height_, channels_;
  std::optional<GaussianKernel> gaussian_;  // If points are drawn with it.
  int margin_ = 0;                          // Pixels about the plate in which kernels end.
  std::vector<PixelColor> colors_;          // By channel, or none.
  PointBucketing bucketing_;
  PointBuckets buckets_;
  std::vector<PixelColor>
      sums_;  // Planes with their margins: of single values, or if there are colours, one of colours.
};

}  // namespace tensorray
