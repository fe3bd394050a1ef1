#pragma once
/// @file renderer/density/density.h
/// Density estimation: computes power per pixel from points on a plate.

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/process/archive.h"
#include "renderer/density/kernel_deposit.h"
#include "renderer/density/point_buckets.h"
#include "renderer/film/film.h"

namespace tensorray {

enum class DensityKind {
  gaussian,             ///< Zheng and Pang 2003, Eq. 10, corrected: normalised by 2πτ².
  histogram,            ///< Each point counts in the pixel that contains it.
  photon_differential,  ///< Each photon covers the ellipse that the light about it covers; see FootprintDeposit.
};

struct DensitySettings {
  DensityKind kind = DensityKind::gaussian;
  double tau = 6;        ///< gaussian: standard deviation, in pixels; >= 0.3.
  double footprint = 1;  ///< photon_differential: standard deviation, in spacings of the photons; > 0.
};

/// Sums points of equal weight, so that each pixel holds the weight that falls on it. Each point belongs to a channel.
/// The film has one plane per channel. If the channels have colours, it has three planes instead (red, green and blue),
/// and each point adds the colour of its channel. The picture is the same as if the planes of the channels were
/// coloured afterwards, but takes a third of the time for 32 channels.
///
/// The Gaussian is mirrored at the edges of the plate, so that the sum over the pixels is the number of points,
/// and a uniformly lit plate is uniform up to its edges. For tau >= 2 points are deposited with quintic B-spline
/// weights; `finish` then applies the separable filter that turns them into the spline interpolant of the Gaussian. The
/// error is at most 1e-4 of the peak of the kernel at τ = 2 and 1e-6 at τ = 6. (Cubic splines cost about half, but a
/// lattice of points then shows as a ripple above 1e-6.) For a smaller tau each point is drawn with a separable
/// Gaussian. Both kernels are cut off beyond 4.5 τ and normalised. The position of a point is rounded to 2^-25 of a
/// pixel.
///
/// Sums do not depend on the order of the points, and sums of parts of the points can be added: what a point adds to a
/// pixel is rounded to a multiple of 2^-26 of the brightest colour (of its largest component, rounded up to a power of
/// two; without colours, of 1), so that additions are exact. This holds while no pixel has 2^27 points of this colour,
/// or the weight of so many; beyond, sums have the precision of doubles, but depend on the order.
class DensityEstimator {
 public:
  /// @param colors  One colour per channel, or empty.
  /// @throw std::invalid_argument if a size is < 1 or > 65000, tau is out of range, or only some channels have a
  /// colour, or if the kind is photon_differential.
  DensityEstimator(int width, int height, int channels, const DensitySettings& settings,
                   const std::vector<Eigen::Vector3d>& colors = {});

  /// Prepares a point of a channel for `add`. @param at  Pixel coordinates within the plate. Any thread may call it.
  DensityPoint point(int channel, const Eigen::Vector2d& at) const;

  /// Adds points. Points whose channel is DensityPoint::nowhere are ignored. Runs on all threads; the result does not
  /// depend on their number.
  void add(const std::vector<DensityPoint>& points);

  /// Writes the sums so far, or adds those of other points. @throw DamagedArchive if there are not so many.
  void copy_sums(Archive& archive);

  /// Returns weight per pixel. @param weight  The weight of one point. Runs on all threads; the result does not depend
  /// on their number.
  Film finish(double weight = 1) const;

 private:
  std::size_t plane_size() const;
  void deposit(std::uint32_t bucket);

  DensitySettings settings_;
  int width_, height_, channels_;
  std::optional<GaussianKernel> gaussian_;  // Set if points are drawn with Gaussians.
  int margin_ = 0;                          // Width of the margin about the plate in which kernels end, pixels.
  std::vector<PixelColor> colors_;          // One per channel, or empty.
  double quantum_ = 0;                      // What is added to a pixel is a multiple of it.
  PointBucketing bucketing_;
  PointBuckets buckets_;
  std::vector<PixelColor> sums_;  // Planes with margins: one of single values per channel, or a single one of colours.
};

}  // namespace tensorray
