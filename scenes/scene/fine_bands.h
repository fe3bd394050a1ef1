#pragma once
/// @file scenes/scene/fine_bands.h
/// The light of a scene as a continuum of wavelengths: narrow bands within its channels, in which light is bent as one.

#include <cstddef>
#include <vector>

#include "renderer/spectra/spectrum.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// The flexibilities of a scene's light.
struct LightRange {
  std::vector<double> flexibilities;  ///< The two ends of a range, or those of red, green and blue.
  bool is_range = false;
};

LightRange light_range(const Scene& scene);

/// A narrow part of a channel. `begin` and `end` are places in the range of the light, from 0 to 1 (in RGB mode both
/// are the channel's place: 0, ½ or 1).
struct FineBand {
  Band band;
  double begin = 0, end = 0;
  std::size_t channel = 0;
  double weight = 1;  ///< Its part of the channel's power.
};

/// The channel that maps of the light describe: the one nearest to 550 nm, or green.
std::size_t reference_channel(const Scene& scene);

/// Its middle, as a place in the range of the light, from 0 to 1.
double reference_place(const Scene& scene);

/// @param count  Number of bands: a multiple of that of the channels. In RGB mode there is one band a channel.
std::vector<FineBand> fine_bands(const Scene& scene, int count);

}  // namespace tensorray
