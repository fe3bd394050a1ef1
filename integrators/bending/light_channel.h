#pragma once
/// @file integrators/bending/light_channel.h
/// The light that is bent: one flexibility for each wavelength band, or for each colour of RGB mode.

#include <array>
#include <cstdint>

#include "integrators/bending/bending.h"

namespace tensorray {

/// A channel of light: a wavelength band, or a colour in RGB mode.
struct LightChannel {
  double flexibility = 0;
  double wavelength = 0;  ///< nm; 0 in RGB mode.
  double power = 1;       ///< Fraction of the beam's power.
};

/// How many rays of one channel ended for each reason, indexed by RayEnd.
using EndCounts = std::array<std::uint64_t, ray_end_count>;

}  // namespace tensorray
