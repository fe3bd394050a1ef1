#pragma once
/// @file renderer/color/icc_profile.h
/// ICC profiles that consist of a curve for each channel and a matrix (ICC.1:2010), which are those of cameras, screens
/// and RGB spaces.

#include <array>
#include <string>

#include <Eigen/Core>

#include "renderer/color/transfer_curve.h"

namespace tensorray {

/// RGB, or grey with equal curves and a matrix whose columns add up to the white.
struct IccProfile {
  std::array<TransferCurve, 3> curves;
  Eigen::Matrix3d rgb_to_xyz = Eigen::Matrix3d::Identity();  ///< XYZ relative to D65, as everywhere.
};

/// @param channels  Of the picture's colours: 1 or 3. @throw std::runtime_error with the reason if the profile is
/// damaged, belongs to other colours, or consists of tables (as those of printers).
IccProfile parse_icc_profile(const std::string& bytes, bool grey);

/// A profile of version 2 for a display. The same arguments give the same bytes.
/// @param name  ASCII.
std::string make_icc_profile(const std::string& name, const IccProfile& profile);

}  // namespace tensorray
