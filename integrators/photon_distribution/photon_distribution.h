#pragma once
/// Density of light on a plate behind a field (Zheng and Pang 2003, section on photon distribution).

#include <cstdint>
#include <functional>
#include <vector>

#include "base/process/job.h"
#include "base/process/progress.h"
#include "renderer/density/density.h"
#include "renderer/film/film.h"
#include "renderer/lights/beam.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// Which grids of the light inside the volume are returned.
enum class FluenceKind { none, all_light, bands };

struct PhotonDistribution;

struct PhotonSettings {
  BendingSettings bending;
  std::uint64_t photons = 1u << 20;  ///< Approximate number of positions that emit, in the core of the beam; > 0.
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

  /// Keeps what was traced, every now and then, as "photons" and the number of a part: as many parts as the job has.
  /// What is kept depends on the kinds of outputs: those wanted must have been from the beginning. May be null.
  Job* job = nullptr;

  /// Gets what there is so far when the job wants a picture; may be empty. Called by the calling thread, at the root.
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
  /// By channel: rays, counted where they start, and where they end. Every ray of a channel has the same power.
  std::vector<std::uint64_t> emitted;
  std::vector<EndCounts> ends;
  double ray_area = 0;  ///< Cross section of the beam that one ray stands for, world units².
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  double seconds_tracing = 0;  ///< From emission to the sums.
  double seconds_density = 0;  ///< From the sums to the film.
};

/// Emits parallel light, bends it through the field and estimates its density on the plate of `geometry`. The result is
/// the same for any number of threads, ranks and parts. Of ranks, only the root has it. That of a shard is empty.
/// @throw std::invalid_argument if a setting is out of range or `geometry` has no plate; DamagedArchive if what was
/// kept is of other light or outputs; Cancelled; as Ranks::gather.
PhotonDistribution distribute_photons(const TensorField& field, const Geometry& geometry, const Beam& beam,
                                      const std::vector<LightChannel>& channels, const PhotonSettings& settings,
                                      const Progress& progress);

}  // namespace tensorray
