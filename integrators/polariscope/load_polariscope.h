#pragma once
/// @file integrators/polariscope/load_polariscope.h
/// From the settings of a scene to the light that is traced.

#include <string>
#include <vector>

#include "integrators/polariscope/polariscope.h"
#include "integrators/polariscope/polariscope_method.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// What a scene's method "polariscope" needs.
struct LoadedLightOfPolariscope {
  PolarizedLight light;
  double stress_optic = 0;  ///< C at the reference wavelength.
  double wavelength = 0;    ///< The reference wavelength, nm.
  Arrangement arrangement;  ///< Turned.
  bool is_automatic = false;
};

/// @param notes  Says what "auto" chose. @throw std::runtime_error naming the file of coefficients and the fix.
LoadedLightOfPolariscope load_polariscope(const Scene& scene, const PolariscopeDescription& settings,
                                          std::vector<std::string>& notes);

}  // namespace tensorray
