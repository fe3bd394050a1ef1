#pragma once
/// @file renderer/images/ink.h
/// Laying lines over pictures.

#include <Eigen/Core>

#include "renderer/images/image.h"

namespace tensorray {

/// The share of a pixel that a line covers, taken along a strip one pixel wide across the line: exact for lines along x
/// or y, and the line's width on average for others.
/// @param distance  From the pixel's centre to the middle of the line, in pixels. @param width  In pixels.
double line_coverage(double distance, double width);

/// Lays a colour over a part (0 to 1) of a pixel: over its first three channels; a channel "A" becomes opaque instead.
void lay_over(Image& image, int x, int y, const Eigen::Vector3d& color, double coverage);

}  // namespace tensorray
