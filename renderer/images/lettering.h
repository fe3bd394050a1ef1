#pragma once
/// @file renderer/images/lettering.h
/// Labels in pictures, in a stroke font of its own: fonts differ from machine to machine.

#include <string>

#include <Eigen/Core>

#include "renderer/images/image.h"

namespace tensorray {

/// Draws one line of text over the first channels of `image`, anti-aliased. Strokes are an eighth of the height wide;
/// digits are all equally wide; descenders, brackets and bars reach a quarter of the height below the base line, and
/// nothing rises above a capital. The text is UTF-8; a character that is not printable ASCII becomes a small box.
/// @param position  Where the line's lower left corner (on the base line) lies, in pixels from the upper left corner of
///                  the picture, continuous: pixel (x, y) covers [x, x+1) × [y, y+1).
/// @param height    Of a capital, in pixels; what lies outside the picture is cut off.
/// @param color     One value for each of the first three channels. A channel "A" becomes opaque instead.
/// @throw std::invalid_argument unless position and height are finite and the height is above 0.
void draw_text(Image& image, const Eigen::Vector2d& position, double height, const std::string& text,
               const Eigen::Vector3d& color);

/// The width of the line that `draw_text` draws, in pixels: from the left edge of the first character to the right edge
/// of the last, so that a line starting at x = centre - width / 2 is centred.
double text_width(const std::string& text, double height);

}  // namespace tensorray
