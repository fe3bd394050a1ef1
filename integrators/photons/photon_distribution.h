#pragma once
/// @file integrators/photons/photon_distribution.h
/// Density of light on a plate behind a field (Zheng and Pang 2003, section on photon distribution).

#include <cstdint>
#include <functional>
#include <vector>

#include "base/process/progress.h"
#include "base/process/team.h"
#include "base/process/work.h"
#include "integrators/bending/bending.h"
#include "integrators/bending/geometry.h"
#include "integrators/bending/light_channel.h"
#include "renderer/density/density.h"
#include "renderer/film/plate_photon.h"
#include "renderer/lights/beam.h"
#include "volumes/grids/scalar_grid.h"

namespace tensorray {

/// Which grids of the light inside the volume are returned.
enum class FluenceKind { none, all_light, bands };

struct PhotonDistribution;

struct PhotonSettings {
  BendingSettings bending;
  std::uint64_t photons = 1u << 20;  ///< Approximate number of positions that emit; > 0.
  BeamPattern pattern = BeamPattern::stratified;

  /// Number of channels that each position carries, stratified; a divisor of the number of channels; 0: all.
  int channels_per_photon = 0;
  std::uint64_t seed = 0;
  bool side_light = true;  ///< Whether light that leaves the volume by a side face counts (SideFaces).
  DensitySettings density;
  bool keep_photons = false;  ///< Whether to return the photon map, which takes 44 bytes for each photon and channel.
  FluenceKind fluence = FluenceKind::none;

  /// Colour of each channel's light; or empty. With colours, the film has the channels red, green and blue instead of
  /// one for each channel. Compared with 32 channels this takes a third of the time and a tenth of the memory.
  std::vector<Eigen::Vector3d> colors;

  /// Keeps what was traced, every now and then; null: nothing is kept. It has as many units as it has parts, or as it
  /// was given. States of units depend on the kinds of outputs: those that are wanted must have been from the
  /// beginning.
  Work* work = nullptr;

  bool restarts = false;  ///< Whether a unit whose state is that of other outputs begins anew; else it is an error.

  /// Processes that trace the photons together with this one; null: it is alone.
  Team* team = nullptr;

  /// Gets what there is so far when `work` wants a picture; may be empty. Called by the calling thread, at process 0.
  std::function<void(PhotonDistribution)> show;
};

struct PhotonDistribution {
  Film irradiance;  ///< One plane for each channel, where 1 is the irradiance of the undisturbed beam in that channel;
                    ///< or their sum in colour.
  /// Empty unless `keep_photons`; ordered by emission (neighbours together), then by channel.
  std::vector<PlatePhoton> photons;
  std::vector<ScalarGrid> fluence;  ///< Empty unless `fluence` is set: all channels, then, for bands, each one; without
                                    ///< names. See fluence.h.

  std::uint64_t positions = 0;  ///< Number of positions that emitted.
  std::vector<EndCounts> ends;  ///< One entry for each channel. Every ray of a channel has the same power, so that
                                ///< emitted = deposited + missed + stopped holds exactly.
  double ray_area = 0;          ///< Cross section of the beam that one ray stands for, world units².
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  double seconds_tracing = 0;  ///< From emission to the sums.
  double seconds_density = 0;  ///< From the sums to the film.
};

/// Emits parallel light, bends it through the field and estimates its density on the plate of `geometry`.
/// The result is the same for any number of threads, processes and units. Of a team, only process 0 has it. Of work
/// that has several parts, it is what the units that were given and those of this part have: incomplete, unless all
/// units are done.
/// @throw std::invalid_argument if a setting is out of range or `geometry` has no plate; std::runtime_error if the
/// states of `work` are those of other light or outputs; Cancelled; as Team::exchange.
PhotonDistribution distribute_photons(const TensorField& field, const Geometry& geometry, const Beam& beam,
                                      const std::vector<LightChannel>& channels, const PhotonSettings& settings,
                                      const Progress& progress);

}  // namespace tensorray
