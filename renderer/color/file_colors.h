#pragma once
/// What the tags of a picture file mean: how its values become light.

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "renderer/color/chromaticities.h"
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

// ICC profiles, by Little CMS.

/// The conversion of a profile's colours, by its tables or its curves and matrix, to XYZ relative to D65. It takes the
/// profile's white for white (relative colorimetric). Of grey pictures, R is converted.
/// @throw std::runtime_error with the reason if the profile is damaged, or belongs to other colours.
ColorConversion icc_to_xyz(const std::string& bytes, bool grey);

/// A profile of version 2 for a display. The same arguments give the same bytes.
/// @param name   ASCII.
/// @param curve  Light at equal distances of a channel's value, from 0 to 1. One that is a power becomes its exponent.
std::string make_icc_profile(const std::string& name, const Chromaticities& colors, const std::vector<float>& curve);

}  // namespace tensorray
