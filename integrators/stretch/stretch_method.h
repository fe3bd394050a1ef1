#pragma once
/// The method "stretch": how much the field of a scene stretches the distance of neighbouring rays
/// (integrators/stretch/stretch.h), as a grid and as a picture.

#include <memory>
#include <optional>

#include "renderer/spectra/spectrum.h"
#include "scenes/description/method.h"

namespace tensorray {

/// `integrator.stretch`.
struct StretchDescription {
  std::optional<double> length;      ///< Length over which rays are followed, world units; none: the volume's depth.
  std::optional<double> wavelength;  ///< Wavelength of the light, nm; none: 550, in RGB mode green.
  int resolution = 64;               ///< Voxels along the longest side of the grid.
  int pixels = 512;                  ///< Pixels along the longer side of the picture.
};

/// The keys of `integrator` that this method has.
struct StretchKeys {
  StretchDescription stretch;
};

inline void describe(StretchDescription& stretch, KeyVisitor& visit) {
  visit("length", stretch.length,
        "length over which light is followed, world units; default: the volume's depth along the light", above(0));
  visit("wavelength", stretch.wavelength, "wavelength of the light, nm; default: 550, in RGB mode green",
        between(observer_min, observer_max).as_knob());
  visit("resolution", stretch.resolution, "resolution of the grid: voxels along the longest side", between(2, 4096));
  visit("pixels", stretch.pixels, "resolution of the picture: pixels along the longer side",
        between(1, 32768).as_knob(32, 2048));
}

inline void describe(StretchKeys& keys, KeyVisitor& visit) {
  visit.section("stretch", keys.stretch, "stretch: light and resolution");
}

std::shared_ptr<Method> stretch_method();

}  // namespace tensorray
