#pragma once
/// Colours by their CIE chromaticities, and adaptation from one white to another.

#include <array>
#include <optional>

#include <Eigen/Core>

namespace tensorray {

/// Primaries and white of an RGB space, as CIE x, y.
struct Chromaticities {
  Eigen::Vector2d red, green, blue, white;
};

Chromaticities chromaticities_of(const std::array<double, 8>& numbers);  ///< In the order of the members.
std::array<double, 8> numbers_of(const Chromaticities& colors);

// Functions: Clang 14 may initialize an object before the one that it is made of.
inline Eigen::Vector2d d65_white() { return {0.3127, 0.3290}; }
inline Eigen::Vector2d aces_white() { return {0.32168, 0.33767}; }
inline Chromaticities rec709_chromaticities() { return {{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, d65_white()}; }

/// XYZ with Y = 1.
Eigen::Vector3d xyz_of(const Eigen::Vector2d& chromaticity);

/// From linear RGB to XYZ; RGB (1, 1, 1) becomes the white with Y = 1.
Eigen::Matrix3d rgb_to_xyz(const Chromaticities& colors);

/// Bradford's chromatic adaptation from one white to another (XYZ, Y = 1). Empty if `from` is too saturated for it: a
/// cone response is below 1% of that of `to`.
std::optional<Eigen::Matrix3d> adaptation(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// The published chromaticities of a space (Rec. 709 and 2020, P3-D65, Adobe RGB, ACEScg, ACES2065-1), each with its
/// own white, if `rgb_to_xyz` agrees with them after adaptation to D65 within rounding; otherwise those of the matrix.
/// @param rgb_to_xyz  XYZ relative to D65.
Chromaticities named_chromaticities(const Eigen::Matrix3d& rgb_to_xyz);

}  // namespace tensorray
