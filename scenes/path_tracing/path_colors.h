#pragma once
/// @file scenes/path_tracing/path_colors.h
/// What is known along a path, as colours.

#include <functional>
#include <optional>
#include <vector>

#include "integrators/paths/paths.h"
#include "renderer/color/colormap.h"
#include "renderer/images/image.h"
#include "scenes/path_tracing/path_tracing_description.h"

namespace tensorray {

/// How the points of paths are coloured.
struct PathColors {
  /// Of linear Rec. 709, 0 to 1; of a point of a path. Empty: paths have the colour of their material.
  std::function<Eigen::Vector3d(const Path&, const PathPoint&)> color;
  /// Draws what the colours mean over a picture whose colours `from_rec709` makes of Rec. 709; empty if nothing is
  /// to be said.
  std::function<void(Image&, const Eigen::Matrix3d& from_rec709)> legend;
};

/// Chooses the range of values where the description does not give it.
PathColors path_colors(const PathColorDescription& description, const std::vector<Path>& paths);

}  // namespace tensorray
