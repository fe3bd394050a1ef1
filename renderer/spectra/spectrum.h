#pragma once
/// Spectra, the CIE 1931 observer, and the bands in which the renderer samples light. Wavelengths are in nanometres.

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// The range of the tabulated observer, in nm.
constexpr double observer_min = 360, observer_max = 830;

/// A spectral distribution per nanometre: linear between its samples, zero outside them.
struct Spectrum {
  std::vector<double> wavelengths;  ///< nm, strictly increasing, at least one.
  std::vector<double> values;       ///< One for each wavelength; finite and >= 0.

  double at(double wavelength) const;
};

/// The names that `illuminant` accepts: "D65", "E", "A".
std::vector<std::string> illuminant_names();

/// A CIE standard illuminant from 300 to 830 nm, in relative units: 100 at 560 nm.
/// @throw std::invalid_argument if the name is unknown; the message lists the known ones.
Spectrum illuminant(const std::string& name);

/// Planck's law at the temperature `kelvin` from 300 to 830 nm, in relative units: 1 at 560 nm.
/// @throw std::invalid_argument unless kelvin is 100 to 1e9 (a colder body has almost no visible light).
Spectrum blackbody(double kelvin);

/// Reads a text file with two columns: wavelength (nm, increasing) and value (>= 0), separated by blanks, a comma or a
/// semicolon. The decimal sign is a point, '#' starts a comment, and one heading line is allowed.
/// @param any_sign  Whether values below 0 are allowed.
/// @throw std::runtime_error naming the file, the line and the fix.
Spectrum read_spectrum(const std::filesystem::path& path, bool any_sign = false);

/// The CIE 1931 2° colour matching functions, interpolated linearly in a 1 nm table; zero outside 360–830 nm.
Eigen::Vector3d observer(double wavelength);

/// A range of wavelengths that is traced as one. Its light is bent as light of `wavelength`, and carries the power and
/// the colour of the whole range; therefore undisturbed light has the colour of its illuminant for any number of bands.
struct Band {
  double wavelength = 0;  ///< The middle of the band, nm.
  double width = 0;       ///< Width of the band, nm; > 0.
  double power = 0;       ///< Fraction of the power of the light that lies in this band; the sum over all bands is 1.
  /// The band's part of the colour of the light; the sum of Y over all bands is 1.
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
};

/// Divides [min, max] into `count` equal bands. Their power and colour are exact integrals. min == max with count == 1
/// is monochromatic light (width 1 nm).
/// @throw std::invalid_argument if count < 1, min <= 0, min > max, min == max with count > 1, or the light has no
/// power, or no visible power, in [min, max].
std::vector<Band> make_bands(const Spectrum& light, double min, double max, int count);

}  // namespace tensorray
