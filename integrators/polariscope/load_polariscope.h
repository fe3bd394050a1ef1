#pragma once
/// From the settings of a scene to the light that is traced; and what the picture's colours mean.

#include <functional>
#include <string>
#include <vector>

#include "integrators/polariscope/polariscope.h"
#include "integrators/polariscope/polariscope_method.h"
#include "renderer/images/image.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// What a scene's method "polariscope" needs.
struct LoadedLightOfPolariscope {
  PolarizedLight light;
  double stress_optic = 0;  ///< C at the reference wavelength.
  double wavelength = 0;    ///< The reference wavelength, nm.
  /// What an order is: a retardance and, if units are known, the difference of principal stresses times the length that
  /// makes it (the material's fringe value).
  std::string order_note;
  Arrangement arrangement;  ///< Turned.
};

/// @param notes  Says what "auto" chose. @throw std::runtime_error naming the file of coefficients and the fix.
LoadedLightOfPolariscope load_polariscope(const Scene& scene, const PolariscopeDescription& settings,
                                          std::vector<std::string>& notes);

/// R, G and B of the light's bands, in the working space.
Eigen::Matrix3Xd band_colors(const Scene& scene);

/// What 99 of 100 of the values do not exceed; 0 if there are none. Changes their order.
double greatest_of_most(std::vector<float>& values);

/// The interference colours of the scene's light, from 0 to a retardance (nm, at the reference wavelength) of a plate
/// that is turned by 45° against the polariser, and a cross of directions: P the polariser, A the analyser. For
/// Render::draw_legend. @param greatest  Finite, > 0.
std::function<void(Image&, double exposure)> polariscope_legend(const Scene& scene,
                                                                const LoadedLightOfPolariscope& loaded,
                                                                double greatest);

}  // namespace tensorray
