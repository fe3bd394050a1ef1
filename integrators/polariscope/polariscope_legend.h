#pragma once
/// @file integrators/polariscope/polariscope_legend.h
/// What the colours of a polariscope's picture mean.

#include <functional>

#include "integrators/polariscope/load_polariscope.h"
#include "renderer/images/image.h"

namespace tensorray {

/// The interference colours of the scene's light, from 0 to a retardance (nm, at the reference wavelength) of a plate
/// that is turned by 45° against the first polariser, and a cross of the polarisers' directions: P the first one, A the
/// analyser. For Render::draw_legend. @param greatest  Finite, > 0.
std::function<void(Image&, double exposure)> polariscope_legend(const Scene& scene,
                                                                const LoadedLightOfPolariscope& loaded,
                                                                const PolariscopeDescription& settings,
                                                                double greatest);

}  // namespace tensorray
