#pragma once
/// Legends drawn into pictures: a labelled colour bar for numbers, and a key that lists colours and their meanings.

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "renderer/charts/colormap.h"
#include "renderer/images/image.h"

namespace tensorray {

/// A mark of a scale.
struct Tick {
  double value = 0;
  std::string label;
};

/// Round values within a range, ascending, at most `most` (≥ 2) of them: multiples of 1, 2 or 5 times a power of ten. A
/// logarithmic scale has powers of ten if at least two lie in the range; otherwise 1, 2 and 5 times powers of ten;
/// otherwise ticks as on a linear scale. All labels of a linear scale have the same number of decimals. The decimal
/// sign is a point in every locale. Large and small numbers have an exponent ("5e-7").
std::vector<Tick> round_ticks(const ValueRange& range, int most);

struct ColorBar {
  std::string title;  ///< Short lines; printable ASCII, as in lettering.h. May be empty.
  ValueRange range;
  /// The colour at a position from 0 to 1, in the colour space of the picture.
  std::function<Eigen::Vector3d(double)> color;
};

/// A colour and what it means.
struct ColorKeyEntry {
  std::string label;
  Eigen::Vector3d color;  ///< In the colour space of the picture.
};

struct ColorKey {
  std::string title;  ///< May be empty.
  std::vector<ColorKeyEntry> entries;
};

/// The width of a legend with short words, pixels. @param width, height  Of the picture that it is drawn into.
int legend_width(int width, int height);

/// Which of several equal parts of the right edge, from the top, a legend is in.
struct LegendPlace {
  std::size_t part = 0, parts = 1;
};

// Both functions draw into the first three channels of a picture. A channel "A" becomes opaque in proportion to the
// opacity of the panel. The legend is on a translucent panel in the middle of a part of the right edge; its letters are
// as high as letter_height says. The panel is dark with white text, or light with black text, whichever is closer
// to the picture behind it. The picture may be scene-linear or display-referred; 1 is white.
// @throw std::invalid_argument unless the picture begins with R, G, B; if the range, the bar or the key is empty.

void draw_color_bar(Image& image, const ColorBar& bar, const LegendPlace& place = {});
void draw_color_key(Image& image, const ColorKey& key, const LegendPlace& place = {});

}  // namespace tensorray
