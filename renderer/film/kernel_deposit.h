#pragma once
/// @file renderer/film/kernel_deposit.h
/// Adds the kernels of points to pixels: the inner loops of density estimation. The widest vectors that the processor
/// has are chosen when the program runs.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tensorray {

/// A point on a plate, in 16 bytes: how far it lies beyond a pixel's centre, from 0 to 1 along x and y, and which pixel
/// that is, counted from where the kernels of points of column or row 0 begin.
struct DensityPoint {
  static constexpr std::uint16_t nowhere = 0xffff;  ///< A channel: the point is not one.

  float x = 0, y = 0;
  std::uint16_t column = 0, row = 0;
  std::uint16_t channel = nowhere;
};

/// Red, green, blue and 0: with a fourth value pixels lie on vectors' bounds, wherever a kernel begins.
struct alignas(32) PixelColor {
  double values[4] = {0, 0, 0, 0};
};

/// Pixels that kernels are added to, rows from the top; large enough for the kernels of all points.
struct DepositTarget {
  double* pixels = nullptr;            ///< One value a pixel, or with colours four (aligned as PixelColor).
  std::size_t width = 0;               ///< In pixels.
  const PixelColor* colors = nullptr;  ///< By channel, what a point's weights are multiplied by; null: there are none.
};

constexpr int spline_taps = 6;  ///< Pixels that a quintic B-spline covers.

/// Adds the quintic B-splines about points, in their order: 6 × 6 pixels with the sum 1, the third of which is the one
/// whose centre the point lies beyond.
void deposit_splines(const std::vector<DensityPoint>& points, std::size_t first, std::size_t last,
                     const DepositTarget& target);

/// The Gaussian at the pixels' centres, cut beyond `reach` pixels, with sum 1.
class GaussianKernel {
 public:
  GaussianKernel(double tau, double reach);
  int taps() const { return static_cast<int>(samples_.size()); }  ///< Pixels that it covers at most.

  /// The weights of the pixels from the first one that a kernel covers, for a point `beyond` the centre of the pixel
  /// number taps() / 2 − 1.
  void weights(double beyond, double* out) const;

 private:
  double tau_, reach_;
  std::vector<double> samples_;  // exp(−i² / 2τ²), i from 1 − taps/2 to taps/2.
};

/// Adds Gaussians about points, in their order.
void deposit_gaussians(const std::vector<DensityPoint>& points, std::size_t first, std::size_t last,
                       const GaussianKernel& kernel, const DepositTarget& target);

/// Counts points in the pixels of their columns and rows.
void deposit_counts(const std::vector<DensityPoint>& points, std::size_t first, std::size_t last,
                    const DepositTarget& target);

}  // namespace tensorray
