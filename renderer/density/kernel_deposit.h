#pragma once
/// @file renderer/density/kernel_deposit.h
/// Adds the kernels of points to pixels: the inner loops of density estimation. Uses the widest vectors of the
/// processor, chosen at run time.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tensorray {

/// A point on a plate, in 16 bytes. (x, y) is the distance from a pixel's centre to the point, from 0 to 1 along each
/// axis. `column` and `row` name that pixel; they count from where the kernels of points of column or row 0 begin.
struct DensityPoint {
  static constexpr std::uint16_t nowhere = 0xffff;  ///< Value of `channel` that marks an unused point.

  float x = 0, y = 0;
  std::uint16_t column = 0, row = 0;
  std::uint16_t channel = nowhere;
};

/// Red, green, blue and 0: the fourth value aligns each pixel with vectors, wherever a kernel begins.
struct alignas(32) PixelColor {
  double values[4] = {0, 0, 0, 0};
};

/// Pixels that kernels are added to, rows from the top; large enough for the kernels of all points.
///
/// Each value can be rounded to a multiple of a quantum, a power of two, before it is added. Sums are then exact, and
/// do not depend on the order of the points, while they are below 2^53 quanta. Values must be below 2^51 quanta.
struct DepositTarget {
  double* pixels = nullptr;            ///< One value per pixel, or four if there are colours (aligned as PixelColor).
  std::size_t width = 0;               ///< In pixels.
  const PixelColor* colors = nullptr;  ///< For each channel, the factor of a point's weights; null: no colours.
  double rounding = 0;                 ///< 1.5 · 2^52 quanta: adding and subtracting it rounds. 0: nothing is rounded.
};

constexpr int spline_taps = 6;  ///< Number of pixels that a quintic B-spline covers along an axis.

/// Adds quintic B-splines about points. A spline has 6 × 6 pixels with the sum 1; the point
/// lies between the centres of the third and the fourth pixel along each axis.
void deposit_splines(const std::vector<DensityPoint>& points, std::size_t first, std::size_t last,
                     const DepositTarget& target);

/// The Gaussian at the pixels' centres, cut off beyond `reach` pixels and normalised to the sum 1.
class GaussianKernel {
 public:
  GaussianKernel(double tau, double reach);
  int taps() const { return static_cast<int>(samples_.size()); }  ///< Largest number of pixels that the kernel covers.

  /// Computes the weights of the pixels from the first one that the kernel covers. The point lies `beyond` pixels after
  /// the centre of pixel number taps() / 2 − 1.
  void weights(double beyond, double* out) const;

 private:
  double tau_, reach_;
  std::vector<double> samples_;  // exp(−i² / 2τ²), i from 1 − taps/2 to taps/2.
};

/// Adds Gaussians about points.
void deposit_gaussians(const std::vector<DensityPoint>& points, std::size_t first, std::size_t last,
                       const GaussianKernel& kernel, const DepositTarget& target);

/// Counts each point in the pixel of its column and row.
void deposit_counts(const std::vector<DensityPoint>& points, std::size_t first, std::size_t last,
                    const DepositTarget& target);

}  // namespace tensorray
