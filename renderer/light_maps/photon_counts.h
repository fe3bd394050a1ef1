#pragma once
/// @file renderer/light_maps/photon_counts.h
/// Numbers of photons of a path tracer's lights, by where they went.

#include <array>
#include <cstdint>

namespace tensorray {

/// Where photons went: they met a surface before the region (straight light, which photons do not count), landed on a
/// surface after it, left everything, or could not be followed.
enum class PhotonEnd { before, landed, escaped, stopped };
constexpr int photon_end_count = 4;

/// Photons by their end; their sum is the number of those that were emitted.
using PhotonCounts = std::array<std::uint64_t, photon_end_count>;

}  // namespace tensorray
