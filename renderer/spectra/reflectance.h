#pragma once
/// Conversion of colours to smooth reflectance spectra.

#include <array>
#include <vector>

#include <Eigen/Core>

#include "renderer/spectra/spectrum.h"

namespace tensorray {

/// A smooth spectrum, scale · σ(c₀ + c₁ x + c₂ x²), with the sigmoid σ(y) = ½ + y / (2 √(1 + y²)) and the wavelength
/// mapped to x (Jakob and Hanika 2019, "A Low-Dimensional Function Space for Efficient Spectral Upsampling"). Its
/// values are within [0, scale].
struct ReflectanceSpectrum {
  std::array<double, 3> coefficients{};
  double scale = 1;

  double at(double wavelength) const;  ///< `wavelength` in nm.
};

/// A band in the coordinates of the model.
struct BandColor {
  double position = 0;    ///< The wavelength of the band, mapped to x.
  Eigen::Vector3d color;  ///< xyz_to_rgb · xyz
};

/// Turns colours into spectra that reproduce these colours in a given light. Immutable; threads may share it.
///
/// Accuracy: exact for every colour that some reflectance, however abrupt, can have in these bands (to 1e-4 at the
/// border of these colours). With 10 or more equal bands from 380 to 730 nm of D65, A, E or a black body of 5500 K this
/// is all of Rec.709 in [0, 1]. With 8 such bands no reflectance has the brightest saturated colours. Under D65, 0.8 %
/// of the cube is then out of reach, by at most 0.08 (green and magenta). A fifth of ACEScg is with any number of
/// bands.
class ReflectanceModel {
 public:
  /// @param bands       The bands of the light, as they are rendered.
  /// @param xyz_to_rgb  To the working space, with the white of the light adapted to (1, 1, 1).
  /// Takes 10 to 300 ms. @throw std::invalid_argument if there are no bands.
  ReflectanceModel(const std::vector<Band>& bands, const Eigen::Matrix3d& xyz_to_rgb);

  /// The spectrum r with Σ_k r(λ_k) · xyz_to_rgb · xyz_k = rgb. If a reflectance can have the colour, the error is
  /// below single precision. Otherwise the error is nearly the smallest possible one (mostly within 1e-4, at worst
  /// within 0.03). The spectrum is within [0, 1]. If a component of the colour is above 1, the spectrum is that of the
  /// colour divided by its largest component, multiplied by that component. Negative values count as 0. Black, and
  /// colours that are not finite, give exactly 0. Grey (to 1e-6) gives exactly its constant mean. Takes about 1 µs.
  ReflectanceSpectrum spectrum(const Eigen::Vector3d& rgb) const;

 private:
  std::vector<BandColor> bands_;
  std::vector<Eigen::Vector3d> table_;  ///< Start values of the search: see interpolate() in the source.
};

}  // namespace tensorray
