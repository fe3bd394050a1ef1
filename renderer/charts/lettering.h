#pragma once
/// Labels in pictures. The stroke font is built in, because installed fonts differ between machines.

#include <string>

#include <Eigen/Core>

#include "renderer/images/image.h"

namespace tensorray {

/// Draws one line of text over the first channels of `image`, anti-aliased. The stroke width is an eighth of the
/// height. All digits have the same width. Descenders, brackets and bars reach a quarter of the height below the base
/// line; nothing is higher than a capital letter. The text is UTF-8; what is not printable ASCII becomes a box.
/// @param position  Lower left corner of the line (on the base line), in pixels from the upper left corner of the
///                  picture. It is continuous: pixel (x, y) covers [x, x+1) × [y, y+1).
/// @param height    Height of a capital letter, in pixels. Parts outside the picture are cut off.
/// @param color     One value for each of the first three channels. A channel "A" becomes opaque under the text.
/// @param outline   Strokes are wider by this on both sides, in pixels: text in another colour under the text itself
///                  makes it legible on any ground.
/// @throw std::invalid_argument unless position and height are finite and the height is above 0.
void draw_text(Image& image, const Eigen::Vector2d& position, double height, const std::string& text,
               const Eigen::Vector3d& color, double outline = 0);

/// The height of a capital letter in pictures of this size, pixels: legible also in a copy of half the size.
double letter_height(int width, int height);

/// The width of the line that `draw_text` draws, in pixels, from the left edge of the first character to the right edge
/// of the last one. A line that starts at x = centre - width / 2 is centred.
double text_width(const std::string& text, double height);

}  // namespace tensorray
