#pragma once
/// @file renderer/color/file_colors.h
/// What the tags of a picture file mean: how its values become light.

#include <array>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "renderer/color/transfer_curve.h"
#include "renderer/images/color_tags.h"

namespace tensorray {

/// A curve for each channel, and then a matrix.
struct FileColors {
  std::array<TransferCurve, 3> curves;
  Eigen::Matrix3d rgb_to_xyz = Eigen::Matrix3d::Identity();  ///< XYZ relative to D65.
};

/// The colours that the tags describe. What PNG calls the strongest counts: code points, a profile, sRGB, gamma and
/// chromaticities. Chromaticities of XYZ itself mean XYZ relative to D65, unless the file says what its white is.
/// Nothing if the tags say nothing, or what the program takes for granted: sRGB for integers.
/// @param integer  Whether the file stores integers. Floats are light, unless a profile says otherwise.
/// @param grey     Whether the picture is grey. @throw std::runtime_error with the reason if the tags cannot be
/// followed.
std::optional<FileColors> file_colors(const ColorTags& tags, bool integer, bool grey);

/// Whether these are the colours of sRGB, up to how profiles of it differ.
bool is_srgb(const FileColors& colors);

}  // namespace tensorray
