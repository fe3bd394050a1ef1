#pragma once
/// @file renderer/density/footprint_deposit.h
/// Spreads photons over the areas that they stand for (L. Schjøth, J. R. Frisvad, K. Erleben and J. Sporring, Photon
/// differentials, GRAPHITE 2007).

#include <atomic>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "base/process/archive.h"
#include "renderer/film/film.h"

namespace tensorray {

/// Adds photons as Gaussians of any elliptic shape. They are mirrored at the edges of the plate, so that the sum over
/// the pixels is the number of photons. Sums are integers, in units of 2^-34 of a photon, so that they do not depend on
/// the order of the photons.
class FootprintDeposit {
 public:
  /// @param colors  One colour per channel (the film then has the planes red, green and blue), or empty.
  /// @throw std::invalid_argument if a size is < 1, or only some channels have a colour.
  FootprintDeposit(int width, int height, int channels, const std::vector<Eigen::Vector3d>& colors = {});

  /// Adds a photon. Any number of threads may call it at once.
  /// @param at    Pixel coordinates within the plate.
  /// @param axes  The image of the unit circle is the ellipse one standard deviation from the middle, in pixels. It is
  ///              widened by 0.4 pixels, so that pixels can be sampled in their middles, and cut off at a sixteenth of
  ///              the plate, beyond which light is not linear in its start. Values that are not finite count as 0.
  void add(int channel, const Eigen::Vector2d& at, const Eigen::Matrix2d& axes);

  /// Writes the sums so far, or adds those of other photons; not while photons are added. @throw DamagedArchive if
  /// there are not so many.
  void copy_sums(Archive& archive);

  /// Weight per pixel. @param weight  The weight of one photon.
  Film finish(double weight) const;

 private:
  void add_to_pixel(int channel, int x, int y, double weight);

  int width_, height_, channels_;
  std::vector<Eigen::Vector3d> colors_;
  std::vector<std::atomic<std::int64_t>> sums_;  // As the values of a Film.
};

}  // namespace tensorray
