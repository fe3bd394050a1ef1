#pragma once
/// @file renderer/color/color_bar.h
/// Legends drawn into pictures: a labelled colour bar for numbers, a key for colours with a meaning each.

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "renderer/color/colormap.h"
#include "renderer/images/image.h"

namespace tensorray {

/// A mark of a scale.
struct Tick {
  double value = 0;
  std::string label;
};

/// Round values within a range, at most `most` (≥ 2), rising: multiples of 1, 2 or 5 times a power of ten. On a
/// logarithmic scale powers of ten if at least two lie in the range, else 1, 2 and 5 times them; else as on a linear
/// scale. Labels of one linear scale have equally many decimals; a point is the decimal sign in every locale; large and
/// small numbers have an exponent ("5e-7").
std::vector<Tick> round_ticks(const ValueRange& range, int most);

struct ColorBar {
  std::string title;  ///< Printable ASCII, as in lettering.h; short. May be empty.
  ValueRange range;
  std::function<Eigen::Vector3d(double)> color;  ///< In the picture's own colours, of a position from 0 to 1.
};

/// A colour and what it means.
struct ColorKeyEntry {
  std::string label;
  Eigen::Vector3d color;  ///< In the picture's own colours.
};

struct ColorKey {
  std::string title;  ///< May be empty.
  std::vector<ColorKeyEntry> entries;
};

/// The key of the colours that are made of a direction's parts: x red, y green, z blue.
ColorKey direction_key();

// Both draw over a picture's first three channels (a channel "A" becomes opaque instead, as far as the panel is), on a
// translucent panel at the middle of the right edge, whose size follows the shorter side of the picture. The panel is
// dark with white writing, or light with black, whichever is nearer to the picture there. The picture may be
// scene-linear or display-referred; 1 is taken as white. What lies outside the picture is cut off.
// @throw std::invalid_argument unless the picture begins with R, G, B; if the range is empty or not finite; if the bar
// has no colours or the key no entries.

void draw_color_bar(Image& image, const ColorBar& bar);
void draw_color_key(Image& image, const ColorKey& key);

}  // namespace tensorray
