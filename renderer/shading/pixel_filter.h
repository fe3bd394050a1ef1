#pragma once
/// @file renderer/shading/pixel_filter.h
/// How the light about a pixel's centre makes up the pixel.

#include <vector>

#include <Eigen/Core>

namespace tensorray {

enum class PixelFilterShape {
  box,              ///< All alike.
  gaussian,         ///< exp(−x²/(2σ²)), σ = radius / 3, lowered to 0 at the radius.
  blackman_harris,  ///< Four cosines; side lobes of −92 dB: smooth, and nearly without aliasing.
};

/// The radius that suits the shape, in pixels: box ½, the others 1.5.
double default_radius(PixelFilterShape shape);

/// A positive, separable filter on [−radius, radius]², for filter importance sampling: a sample's position is drawn
/// with the filter as its density, and all samples of a pixel weigh 1. Immutable: any thread may use it.
class PixelFilter {
 public:
  /// @param radius  Pixels. @throw std::invalid_argument unless it is > 0 and finite.
  PixelFilter(PixelFilterShape shape, double radius);
  explicit PixelFilter(PixelFilterShape shape) : PixelFilter(shape, default_radius(shape)) {}

  /// The density at an offset from the pixel's centre, in 1/pixel²; its integral is 1.
  double density(const Eigen::Vector2d& offset) const { return density(offset.x()) * density(offset.y()); }

  /// An offset with this density, from evenly spread `u` of [0, 1)²; each of u's numbers sets one of the offset's,
  /// monotonically. By inversion to rounding, in some 0.3 µs.
  Eigen::Vector2d sample(const Eigen::Vector2d& u) const { return {sample(u.x()), sample(u.y())}; }

  PixelFilterShape shape() const { return shape_; }
  double radius() const { return radius_; }

 private:
  double density(double x) const;
  double cumulative(double x) const;
  double sample(double u) const;
  double invert(double u, double low, double high) const;

  PixelFilterShape shape_;
  double radius_;
  std::vector<double> quantiles_;  ///< Where `cumulative` is i / (size − 1).
};

}  // namespace tensorray
