#pragma once
/// @file integrators/photons/photon_distribution.h
/// The light that a field throws on a plate (Zheng and Pang 2003, section on photon distribution).

#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "integrators/bending/bending.h"
#include "integrators/bending/light_channel.h"
#include "renderer/film/density.h"
#include "renderer/film/photon_map.h"
#include "renderer/lights/beam.h"
#include "volumes/grids/scalar_grid.h"

namespace tensorray {

/// Whether to return the light inside the volume, and as how many grids.
enum class FluenceKind { none, all_light, bands };

struct PhotonSettings {
  std::uint64_t photons = 1u << 20;  ///< About how many positions emit; > 0.
  BeamPattern pattern = BeamPattern::stratified;
  int channels_per_photon =
      0;  ///< How many channels each position carries, stratified; a divisor of their number; 0: all.
  std::uint64_t seed = 0;
  DensitySettings density;
  bool keep_photons = false;  ///< Whether to return the photon map: 44 bytes a photon and channel.
  FluenceKind fluence = FluenceKind::none;

  /// Of the channels' light; or none. With colours the film is the light's picture, whose channels are red, green and
  /// blue, and takes a third of the time and a tenth of the memory that 32 channels' own planes do.
  std::vector<Eigen::Vector3d> colors;
};

struct PhotonDistribution {
  Film irradiance;    ///< A channel each, 1 being the undisturbed beam's irradiance in that channel; or
                      ///< their sum in colour.
  PhotonMap photons;  ///< Empty unless asked for; ordered by emission (neighbours together), then channel.
  std::vector<ScalarGrid> fluence;  ///< Empty unless asked for: all channels, then each one; not named. See fluence.h.

  std::uint64_t positions = 0;  ///< That emitted.
  std::vector<EndCounts> ends;  ///< A channel each. Every ray of a channel has the same power, so that emitted =
                                ///< deposited + missed + stopped holds exactly.
  double ray_area = 0;          ///< Cross section of the beam that one ray stands for, world units².
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  double seconds_tracing = 0;  ///< With emission.
  double seconds_density = 0;  ///< From landings to the film.
};

/// Emits parallel light, bends it through the field and estimates its density on the plate of `geometry`.
/// The result is the same for any number of threads.
/// @throw std::invalid_argument if a setting is out of range or `geometry` has no plate; Cancelled.
PhotonDistribution distribute_photons(const TensorField& field, const Geometry& geometry, const Beam& beam,
                                      const std::vector<LightChannel>& channels, const BendingSettings& bending,
                                      const PhotonSettings& settings, const Progress& progress);

}  // namespace tensorray
