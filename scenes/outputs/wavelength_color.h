#pragma once
/// @file scenes/outputs/wavelength_color.h
/// Colours that stand for wavelengths in pictures and legends.

#include <Eigen/Core>

namespace tensorray {

/// The colour of light of one wavelength (nm) for the eye, linear Rec. 709, as saturated as a display can show it; grey
/// if the eye does not see it.
Eigen::Vector3d wavelength_color(double wavelength);

}  // namespace tensorray
