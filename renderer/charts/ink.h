#pragma once
/// @file renderer/charts/ink.h
/// Draws lines and areas of one colour over pictures, anti-aliased.

#include <Eigen/Core>

#include "renderer/images/image.h"

namespace tensorray {

/// The part of a pixel that a line covers, measured along a strip one pixel wide across the line. It is exact for lines
/// along x or y; for other directions the width of the line is correct on average.
/// @param distance  From the pixel's centre to the middle of the line, in pixels. @param width  In pixels.
double line_coverage(double distance, double width);

/// Mixes a colour into the first three channels of a pixel; `coverage` is its weight, 0 to 1. A channel "A" becomes
/// opaque by the same weight.
void lay_over(Image& image, int x, int y, const Eigen::Vector3d& color, double coverage);

}  // namespace tensorray
