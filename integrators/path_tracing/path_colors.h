#pragma once
/// @file integrators/path_tracing/path_colors.h
/// Colours for the values along a path.

#include <functional>
#include <optional>
#include <vector>

#include "integrators/path_tracing/path_tracing_method.h"
#include "renderer/charts/colormap.h"
#include "renderer/images/image.h"
#include "tracing/paths/paths.h"

namespace tensorray {

/// How the points of paths are coloured.
struct PathColors {
  /// The colour of each point of each path, linear Rec. 709, 0 to 1. Empty: paths have the colour of their material.
  std::vector<std::vector<Eigen::Vector3d>> of_points;
  /// Draws a legend of the colours over a picture. `from_rec709` converts colours of linear Rec. 709 to those of the
  /// picture. Empty: no legend.
  std::function<void(Image&, const Eigen::Matrix3d& from_rec709)> legend;
};

/// Chooses the range of values if the description does not give it. If colours are those of wavelengths, paths that lie
/// in one another have the mean of their colours: light is white, or whatever its wavelengths give, until they part.
/// @param paths   Those of one seed stand beside each other, by wavelength.
/// @param radius  Paths nearer to each other than this lie in one another, world units.
PathColors path_colors(const PathColorDescription& description, const std::vector<Path>& paths, double radius);

}  // namespace tensorray
