#pragma once
/// @file renderer/color/spectrum.h
/// Spectra, the CIE 1931 observer, and the bands in which the renderer samples light.
/// Wavelengths are in nanometres everywhere.

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

/// The names that `illuminant` knows: "D65", "E", "A".
std::vector<std::string> illuminant_names();

/// A CIE standard illuminant, relative: 100 at 560 nm, 300 to 830 nm.
/// @throw std::invalid_argument if the name is unknown; the message lists the known ones.
Spectrum illuminant(const std::string& name);

/// Planck's law at `kelvin`, relative: 1 at 560 nm, 300 to 830 nm.
/// @throw std::invalid_argument unless kelvin is 100 to 1e9 (a colder body has no visible light to speak of).
Spectrum blackbody(double kelvin);

/// Reads a text file with two columns, wavelength (nm, increasing) and value (>= 0), separated by blanks, a comma or a
/// semicolon; the decimal sign is a point, '#' starts a comment, and one heading line is allowed.
/// @throw std::runtime_error naming the file, the line and the mend.
Spectrum read_spectrum(const std::filesystem::path& path);

/// The CIE 1931 2° colour matching functions, linear in a 1 nm table; zero outside 360–830 nm.
Eigen::Vector3d observer(double wavelength);

/// A range of wavelengths that is traced as one: its light travels at `wavelength`, and carries the power and the
/// colour of the whole range, so that undisturbed light keeps the colour of its illuminant for any number of bands.
struct Band {
  double wavelength = 0;  ///< The middle of the band, nm.
  double width = 0;       ///< nm, > 0.
  double power = 0;       ///< Fraction of the light's power that lies in this band; the bands' sum is 1.
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();  ///< The band's part of the light's colour; the bands' Y sum to 1.
};

/// Divides [min, max] into `count` equal bands, whose power and colour are exact integrals. min == max with count == 1
/// is monochromatic light (width 1 nm).
/// @throw std::invalid_argument if count < 1, min <= 0, min > max, min == max with count > 1, or the light has no
/// power, or no visible power, in the range.
std::vector<Band> make_bands(const Spectrum& light, double min, double max, int count);

}  // namespace tensorray
