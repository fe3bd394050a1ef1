#pragma once
/// @file renderer/color/file_colors.h
/// What the tags of a picture file mean: how its values become light.

#include <optional>

#include <Eigen/Core>

#include "renderer/color/color.h"
#include "renderer/images/image.h"

namespace tensorray {

/// The conversion to the working space that the tags describe. What PNG calls the strongest counts: code points, a
/// profile, sRGB, gamma and chromaticities. Chromaticities of XYZ itself mean XYZ relative to D65, unless the file says
/// what its white is. Nothing if the tags say nothing, or what the program takes for granted: sRGB for integers. An
/// empty function if the colours are those of the working space.
/// @param integer  Whether the file stores integers. Floats are light, unless a profile says otherwise.
/// @param grey     Whether the picture is grey.
/// @throw std::runtime_error with the reason if the tags cannot be followed.
std::optional<ColorConversion> file_colors(const ColorTags& tags, bool integer, bool grey,
                                           const Eigen::Matrix3d& xyz_to_working);

/// The light of a value of sRGB (IEC 61966-2-1).
double srgb_light(double value);

}  // namespace tensorray
