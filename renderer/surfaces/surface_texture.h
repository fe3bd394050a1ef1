#pragma once
/// @file renderer/surfaces/surface_texture.h
/// A picture as the colours of a flat surface.

#include <vector>

#include <Eigen/Core>

#include "renderer/surfaces/plate.h"

namespace tensorray {

struct SurfaceTexture {
  Plate plate;  ///< Where the picture lies; its pixels are those of `colors`. Beyond its edges their colours go on.
  std::vector<Eigen::Vector3f> colors;  ///< Row by row from the top; working space, 0 to 1.
  bool smooth = true;                   ///< Linear interpolation between the middles of pixels; false: sharp pixels.
};

/// The colour at a point of the surface.
Eigen::Vector3f color_at(const SurfaceTexture& texture, const Eigen::Vector3d& point);

}  // namespace tensorray
