#pragma once
/// Traces photons of directional, point and area lights through a bending region to surfaces behind and within it.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/process/progress.h"
#include "renderer/light_maps/photon_map.h"
#include "renderer/lights/bending_region.h"
#include "renderer/lights/lights.h"
#include "renderer/surfaces/plate.h"
#include "renderer/surfaces/surface_scene.h"

namespace tensorray {

class Job;

struct PhotonTracerSettings {
  std::uint64_t per_pass = 16384;  ///< Positions from which light starts, of all lights; each is at least one. Every
                                   ///< position has a photon of each band. 0: none.
  int passes = 1;                  ///< >= 1
  double radius = 1;               ///< Of the first pass, world units; > 0.
  std::uint64_t seed = 0;
  Job* job = nullptr;  ///< Whose ranks trace the photons together, and which keeps those of each pass; null: alone.
  /// Whether a light lights a surface by photons.
  std::function<bool(int light, std::uint32_t surface)> serves;
  /// Of surfaces that are rectangles, by their index: photons near an edge are mirrored at it, so that the light that
  /// their radius takes beyond it comes back.
  std::vector<std::optional<Plate>> plates;
};

/// @param corners  Of the region's hull.
/// @return the same for any number of threads: random numbers are functions of (seed, pass, light, photon, dimension).
/// @throw Cancelled; as Ranks::all_gather.
PhotonMaps trace_photons(const BendingRegion& region, const std::vector<Eigen::Vector3d>& corners,
                         const SurfaceScene& surfaces, const std::vector<Light>& lights,
                         const PhotonTracerSettings& settings, const Progress& progress);

}  // namespace tensorray
