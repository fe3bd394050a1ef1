#pragma once
/// @file integrators/photon_distribution/photon_sums.h
/// What photons give together. Sums of some chunks of photons can be added to those of others: the result does not
/// depend on the order, nor on which process has traced which chunk.

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "base/process/archive.h"
#include "integrators/photon_distribution/fluence.h"
#include "renderer/density/density.h"
#include "renderer/film/film.h"
#include "tracing/bending/light_channel.h"

namespace tensorray {

struct PhotonSums {
  std::uint64_t candidates = 0;  ///< Of the beam (BeamSampler), whether they emitted or not.
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  std::vector<EndCounts> ends;              ///< By channel.
  std::optional<DensityEstimator> density;  ///< The light on the plate.
  std::unique_ptr<FluenceSums> fluence;     ///< Null: not wanted.
  bool is_colored = false;                  ///< Whether the light on the plate is red, green and blue, not by channel.
  bool has_photons = false;                 ///< Whether photons are wanted.
  std::map<std::uint64_t, std::vector<PlatePhoton>> photons;  ///< By the number of their chunk.
};

/// Writes the sums, or adds those of other photons. What these sums do not want is left out.
/// @throw DamagedArchive if they are those of other light, or have not all that is wanted.
void copy_sums(Archive& archive, PhotonSums& sums);

}  // namespace tensorray
