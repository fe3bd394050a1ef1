#include "scenes/outputs/wavelength_color.h"

#include <algorithm>

#include <Eigen/LU>

#include "renderer/color/color.h"
#include "renderer/spectra/spectrum.h"

namespace tensorray {
namespace {

constexpr double unseen = 0.5;  // Grey of wavelengths that the eye does not see.
constexpr double pale = 0.03;   // Part of white in the colour of a wavelength, which makes it reproducible.

}  // namespace

Eigen::Vector3d wavelength_color(double wavelength) {
  Eigen::Vector3d rgb = rec709_to_xyz().inverse() * observer(wavelength);
  rgb.array() -= std::min(0.0, rgb.minCoeff());
  const double greatest = rgb.maxCoeff();
  if (!(greatest > 0)) return Eigen::Vector3d::Constant(unseen);
  return rgb / greatest * (1 - pale) + Eigen::Vector3d::Constant(pale);
}

}  // namespace tensorray
