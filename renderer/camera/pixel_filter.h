#pragma once
/// Filters that weigh the light around a pixel's centre.

#include <vector>

#include <Eigen/Core>

namespace tensorray {

enum class PixelFilterShape {
  box,              ///< Equal weight everywhere.
  gaussian,         ///< exp(−x²/(2σ²)), σ = radius / 3, lowered to 0 at the radius.
  blackman_harris,  ///< Four cosine terms; side lobes of −92 dB: smooth, with almost no aliasing.
};

/// A positive, separable filter on [−radius, radius]² (of the box ½ pixel, of others 1.5), for filter importance
/// sampling: the filter is the density of the samples' positions, and all samples have weight 1. Immutable.
class PixelFilter {
 public:
  explicit PixelFilter(PixelFilterShape shape);

  /// An offset from the pixel's centre with the filter's density, from `u`, uniform in [0, 1)². Each component of the
  /// offset depends on the same component of `u` only, and increases with it. Exact to 1e-8.
  Eigen::Vector2d sample(const Eigen::Vector2d& u) const { return {sample(u.x()), sample(u.y())}; }

 private:
  double density(double x) const;
  double cumulative(double x) const;
  double sample(double u) const;
  double lower_sample(double u) const;
  double invert(double u, double low, double high) const;

  struct Quantile {
    double position = 0;
    double slope = 0;  ///< Derivative of the position, for each step of the table.
  };

  std::vector<Quantile> quantiles(double last) const;

  PixelFilterShape shape_;
  double radius_;
  std::vector<Quantile> middle_, end_;  ///< Where `cumulative` is i · ½ / (size − 1), and fractions of it near 0.
};

}  // namespace tensorray
