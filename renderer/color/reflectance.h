#pragma once
/// @file renderer/color/reflectance.h
/// From colours to smooth reflectance spectra.

#include <array>
#include <vector>

#include <Eigen/Core>

#include "renderer/color/spectrum.h"

namespace tensorray {

/// A smooth spectrum, scale · σ(c₀ + c₁ x + c₂ x²) with the sigmoid σ(y) = ½ + y / (2 √(1 + y²)) and the wavelength
/// mapped to x (Jakob and Hanika 2019, "A Low-Dimensional Function Space for Efficient Spectral Upsampling"). It is
/// within [0, scale].
struct ReflectanceSpectrum {
  std::array<double, 3> coefficients{};
  double scale = 1;

  double at(double wavelength) const;  ///< nm
};

/// A band as the model sees it.
struct BandColor {
  double position = 0;    ///< The x of its wavelength.
  Eigen::Vector3d color;  ///< xyz_to_rgb · xyz
};

/// Turns colours into spectra that give back these colours in a given light. Immutable; shared by threads.
///
/// What is exact: any colour that some reflectance, however abrupt, can have in these bands (at the very border of what
/// is possible, to 1e-4). That is all of Rec.709 in [0, 1] in 10 or more equal bands from 380 to 730 nm of D65, A, E
/// and a black body of 5500 K. With 8 such bands no reflectance has the brightest saturated colours: under D65, 0.8 %
/// of the cube is out of reach, green (0, 1, 0) and magenta (1, 0, 1) by 0.08 (ΔE 15 and 12), cyan and red by 0.03,
/// yellow and blue by 0.02; under A 0.2 %, by at most 0.02 (blue). With 9 bands it is 0.3 %, by at most 0.03. Of ACEScg
/// in [0, 1], a fifth is out of reach with any number of bands.
class ReflectanceModel {
 public:
  /// @param bands       The light: its bands, as they are rendered.
  /// @param xyz_to_rgb  To the working space, with the light's white adapted to (1, 1, 1).
  /// Takes well below a second (10 to 300 ms). @throw std::invalid_argument if there are no bands.
  ReflectanceModel(const std::vector<Band>& bands, const Eigen::Matrix3d& xyz_to_rgb);

  /// The spectrum r with Σ_k r(λ_k) · xyz_to_rgb · xyz_k = rgb. Where a reflectance can have the colour, the difference
  /// is below what single precision shows; elsewhere it is nearly the smallest possible (mostly to 1e-4, at worst to
  /// 0.03). The spectrum is within [0, 1], but colours with values above 1 have the spectrum of the colour divided by
  /// the largest value, times that value. Negative values count as 0. Black, and what is not finite, gives exactly 0,
  /// and grey (to 1e-6) exactly its constant mean. About 1 µs with 16 bands; colours out of reach take up to 20 times
  /// longer.
  ReflectanceSpectrum spectrum(const Eigen::Vector3d& rgb) const;

 private:
  std::vector<BandColor> bands_;
  std::vector<Eigen::Vector3d> table_;  ///< Where the search begins: see interpolate() in the source.
};

}  // namespace tensorray
