#pragma once
/// @file tracing/bending/light_channel.h
/// Channels of the light that is bent.

#include <array>
#include <cstdint>

#include "tracing/bending/bending.h"

namespace tensorray {

/// A wavelength band, or a colour in RGB mode.
struct LightChannel {
  double flexibility = 0;
  double wavelength = 0;  ///< nm; 0 in RGB mode.
  double power = 1;       ///< Fraction of the beam's power.
};

/// The number of rays of one channel that ended for each reason, indexed by RayEnd.
using EndCounts = std::array<std::uint64_t, ray_end_count>;

}  // namespace tensorray
