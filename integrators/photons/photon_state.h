#pragma once
/// @file integrators/photons/photon_state.h
/// What a photon distribution has between two chunks of positions, as bytes.

#include <cstdint>
#include <string>
#include <vector>

#include "integrators/bending/light_channel.h"

namespace tensorray {

struct PhotonState {
  std::uint64_t next = 0;  ///< The first position that has not emitted.
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  std::vector<EndCounts> ends;  ///< By channel.
  std::string sums;             ///< Of light on the plate, as DensityEstimator or FootprintDeposit has them.
};

std::string bytes_of(const PhotonState& state);

/// @throw std::runtime_error if the bytes are not those of a state with this number of channels.
PhotonState photon_state(const std::string& bytes, std::size_t channels);

}  // namespace tensorray
