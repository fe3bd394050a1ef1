#pragma once
/// @file renderer/textures/test_images.h
/// The built-in pictures to be seen through a lens.

#include "renderer/images/image.h"

namespace tensorray {

enum class TestImage {
  checkerboard,  ///< Black (0) and white (1) squares, 16 along the shorter side.
  grid,  ///< Nearly white with black lines, every fourth thicker, 16 cells along the shorter side, and a label in
         ///< every whole cell, columns A, B ..., rows 1, 2 ... ("C4"); colours differ by quadrant, faintly.
         ///< Labels are left out where they would be too small to read.
  color_wheel,  ///< Hue by angle (red at the right, then counter-clockwise yellow, green ...), saturation by radius,
                ///< with fine circles and rays; a neutral grey around it.
  line,         ///< One vertical white line, 1/64 of the width, in the middle of black: shows dispersion.
};

/// A picture with channels R, G, B in linear Rec.709, values from 0 to 1, edges anti-aliased. Cells are squares; four
/// of them meet in the middle of the picture, so that all is symmetric about it. Runs on all threads.
/// @throw std::invalid_argument unless both sizes are at least 1.
Image test_image(TestImage which, int width, int height);

}  // namespace tensorray
