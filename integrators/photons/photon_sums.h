#pragma once
/// @file integrators/photons/photon_sums.h
/// What photons give together. Sums of some chunks of photons can be added to those of others: the result does not
/// depend on the order, nor on which process has traced which chunk.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/process/team.h"
#include "integrators/bending/light_channel.h"
#include "integrators/photons/fluence.h"
#include "renderer/density/density.h"
#include "renderer/film/plate_photon.h"

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

std::string bytes_of(const PhotonSums& sums);

/// Adds the sums of other photons. What these sums do not want is left out.
/// @throw std::runtime_error if the bytes are those of other light, or have not all that is wanted.
void add_bytes(const std::string& bytes, PhotonSums& sums);

/// Gives process 0 what all others have, one after the other, so that it has the bytes of one at a time.
/// @param at_once  The most bytes of a message; > 0. @param take  Called at process 0. @throw as Team::collect.
void collect_in_turn(Team& team, const std::string& mine, std::size_t at_once,
                     const std::function<void(const std::string& bytes)>& take);

}  // namespace tensorray
