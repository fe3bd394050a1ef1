#pragma once
/// Built-in pictures that are seen through a lens.

#include "renderer/images/image.h"

namespace tensorray {

enum class TestImage {
  checkerboard,  ///< Black (0) and white (1) squares, 16 along the shorter side.
  /// Nearly white with black lines, 16 cells along the shorter side; every fourth line is thicker. Each whole cell has
  /// a label of its column (A, B ...) and row (1, 2 ...), such as "C4", unless it would be too small to read. The
  /// background colours of the quadrants differ slightly.
  grid,
  /// Hue by angle (red at the right, then counter-clockwise yellow, green ...), saturation by radius, with fine circles
  /// and radial lines; neutral grey around it.
  color_wheel,
  line,  ///< One vertical white line in the middle of black, 1/64 of the width wide: shows dispersion.
};

/// A picture with channels R, G, B in linear Rec.709, values from 0 to 1, edges anti-aliased. Cells are squares; four
/// of them meet in the middle of the picture, so that the pattern is symmetric about it. Runs on all threads.
/// @throw std::invalid_argument unless both sizes are at least 1.
Image test_image(TestImage which, int width, int height);

}  // namespace tensorray
