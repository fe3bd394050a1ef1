#pragma once
/// @file scenes/description/spectrum_description.h
/// `light.spectrum`: an illuminant, a black body, or a file.

#include <filesystem>
#include <string>
#include <variant>

#include "renderer/spectra/spectrum.h"
#include "scenes/keys/values.h"

namespace tensorray {

struct Illuminant {
  std::string name = "D65";  ///< One of `illuminant_names`.
};

struct BlackBody {
  double kelvin = 0;  ///< 100 to 1e9.
};

using SpectrumDescription = std::variant<Illuminant, BlackBody, std::filesystem::path>;

TENSORRAY_VALUE(SpectrumDescription);

/// @throw std::runtime_error naming the file that cannot be read.
Spectrum load_spectrum(const SpectrumDescription& description);

}  // namespace tensorray
