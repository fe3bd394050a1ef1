#pragma once
/// @file renderer/images/color_tags.h
/// What a picture file says about its colours, as it says it; renderer/color/file_colors.h says what it means.

#include <array>
#include <optional>
#include <string>

namespace tensorray {

struct ColorTags {
  std::string icc_profile;                               ///< The embedded ICC profile; empty: none.
  std::optional<std::array<double, 8>> chromaticities;   ///< x and y of red, green, blue and white.
  std::optional<std::array<double, 2>> adopted_neutral;  ///< EXR: x and y of what counts as white.
  std::optional<double> gamma;                           ///< PNG (gAMA): stored values are light to this power.
  std::optional<std::array<int, 2>> code_points;         ///< PNG (cICP): primaries and curve of ITU-T H.273.
  bool is_srgb = false;                                  ///< PNG (sRGB).
};

}  // namespace tensorray
