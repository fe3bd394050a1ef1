#pragma once
/// @file renderer/light_maps/photon_counts.h
/// Numbers of photons of a path tracer's lights, by where they went.

#include <array>
#include <cstddef>
#include <cstdint>

namespace tensorray {

/// Where photons went: they met a surface before the region (straight light, which photons do not count), landed on a
/// surface after it, left everything, or could not be followed.
enum class PhotonEnd { before, landed, escaped, stopped };
constexpr int photon_end_count = 4;

/// Photons that were emitted, counted there, and by their end, counted there: the sums are the same.
struct PhotonCounts {
  std::uint64_t emitted = 0;
  std::array<std::uint64_t, photon_end_count> ends{};

  PhotonCounts& operator+=(const PhotonCounts& more) {
    emitted += more.emitted;
    for (std::size_t end = 0; end < ends.size(); ++end) ends[end] += more.ends[end];
    return *this;
  }
  bool operator==(const PhotonCounts& other) const { return emitted == other.emitted && ends == other.ends; }
};

}  // namespace tensorray
