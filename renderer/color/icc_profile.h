#pragma once
/// @file renderer/color/icc_profile.h
/// ICC profiles, by Little CMS.

#include <string>
#include <vector>

#include "renderer/color/chromaticities.h"
#include "renderer/color/color.h"

namespace tensorray {

/// The conversion of a profile's colours, by its tables or its curves and matrix, to XYZ relative to D65. It takes the
/// profile's white for white (relative colorimetric). Of grey pictures, R is converted.
/// @throw std::runtime_error with the reason if the profile is damaged, or belongs to other colours.
ColorConversion icc_to_xyz(const std::string& bytes, bool grey);

/// A profile of version 2 for a display. The same arguments give the same bytes.
/// @param name   ASCII.
/// @param curve  Light at equal distances of a channel's value, from 0 to 1. One that is a power becomes its exponent.
std::string make_icc_profile(const std::string& name, const Chromaticities& colors, const std::vector<float>& curve);

}  // namespace tensorray
