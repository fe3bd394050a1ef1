#pragma once
/// Density estimation: computes power per pixel from photons on a plate.

#include <atomic>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "base/process/archive.h"
#include "renderer/film/film.h"

namespace tensorray {

enum class DensityKind {
  gaussian,             ///< Zheng and Pang 2003, Eq. 10, corrected: normalised by 2πτ².
  histogram,            ///< Each photon counts in the pixel that contains it.
  photon_differential,  ///< Each photon covers the ellipse that the light about it covers (Schjøth, Frisvad, Erleben
                        ///< and Sporring, Photon differentials, GRAPHITE 2007).
};

struct DensitySettings {
  DensityKind kind = DensityKind::gaussian;
  double tau = 6;        ///< gaussian: standard deviation, in pixels; >= 0.3.
  double footprint = 1;  ///< photon_differential: standard deviation, in spacings of the photons; > 0.
};

/// Sums photons of equal weight, so that each pixel holds the weight that falls on it. Each photon belongs to a
/// channel. The film has one plane per channel. If the channels have colours, it has three planes instead (red, green
/// and blue), and each photon adds the colour of its channel. The picture is the same as if the planes of the channels
/// were coloured afterwards, but takes a third of the time for 32 channels.
///
/// All kernels are mirrored at the edges of the plate, so that the sum over the pixels is the number of photons, and a
/// uniformly lit plate is uniform up to its edges.
///
/// The Gaussian is a cubic B-spline about each photon, which `finish` blurs with a Gaussian of the variance τ² − ⅓:
/// that of the spline is ⅓ wherever the photon is. The error is at most 1e-3 of the peak of the kernel at τ = 2, and
/// falls with τ⁴. For a smaller τ the Gaussian itself is added, at the middles of the pixels. Both end at 4.5 τ.
///
/// Sums are integers, in units of 2^-34 of a photon: in any order, and of parts. A pixel has room for 2^29 photons.
class DensityEstimator {
 public:
  /// @param colors  One colour per channel, or empty.
  /// @throw std::invalid_argument if a size is < 1 or > 65000, tau is out of range, or some channels have no colour.
  DensityEstimator(int width, int height, int channels, const DensitySettings& settings,
                   const std::vector<Eigen::Vector3d>& colors = {});

  /// Adds a photon. Any number of threads may call it at once.
  /// @param at    Pixel coordinates within the plate.
  /// @param axes  Of photon differentials: the image of the unit circle is the ellipse one standard deviation from the
  ///              middle, in pixels. It is widened by 0.4 pixels, so that pixels can be sampled in their middles, and
  ///              cut off at a sixteenth of the plate, beyond which light is not linear in its start. Values that are
  ///              not finite count as 0.
  void add(int channel, const Eigen::Vector2d& at, const Eigen::Matrix2d& axes = Eigen::Matrix2d::Zero());

  /// Writes the sums so far, or adds those of other photons; not while photons are added. @throw DamagedArchive if
  /// there are not so many.
  void copy_sums(Archive& archive);

  /// Returns weight per pixel. @param weight  The weight of one photon. Runs on all threads.
  Film finish(double weight = 1) const;

 private:
  void add_to_pixel(int channel, int x, int y, double weight);

  DensitySettings settings_;
  int width_, height_, channels_;
  std::vector<Eigen::Vector3d> colors_;          // One per channel, or empty.
  std::vector<std::atomic<std::int64_t>> sums_;  // As the values of a Film.
};

}  // namespace tensorray
