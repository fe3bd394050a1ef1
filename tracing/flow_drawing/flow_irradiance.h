#pragma once
/// The irradiance that the disk of a distant light, or a point light, gives a surface through the field, band by band.

#include <cstdint>
#include <optional>
#include <vector>

#include "base/process/progress.h"
#include "renderer/film/film.h"
#include "renderer/surfaces/plate.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"

namespace tensorray {

class Job;

struct LandingLight {
  std::optional<Eigen::Vector3d> source;                  ///< Of a point light: where it is, outside the volume.
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< Unit; in which the light of a disk's centre travels.
  double angle = 0;                                       ///< Angle from the disk's centre to its rim, radians.
  int passes = 1;  ///< Directions within the disk that are traced; >= 1. A light without a disk needs one.
  std::vector<double> flexibilities;  ///< At the ends of the bands: one more than there are bands; monotonic.
};

struct FlowIrradianceSettings {
  BendingSettings bending;
  int resolution = 64;         ///< Pixels along the longer side of the part of the plate where light lands.
  std::size_t rays = 1 << 16;  ///< Vertices of the flow map, at most, for each direction.
  Job* job = nullptr;          ///< Whose ranks compute the light together, and which keeps that of each direction;
                               ///< null: alone.
  std::uint64_t number = 0;    ///< Of this light among all that are kept.
};

struct FlowIrradiance {
  Plate plate;      ///< The part of the surface where light lands, with its pixels.
  Film irradiance;  ///< A plane for each band; 1 is the irradiance of the beam on a surface that faces it; of a point
                    ///< light, that at a distance of 1.
  std::vector<float> straight;  ///< The part of each pixel on which light through the volume would land without field.
                                ///< Empty: not known, of a disk's light on a body, or that grazes the plate.
  std::vector<float> folds;     ///< Number of sheets of the map at the middle of each pixel, for light of the middle of
                                ///< the range, from the first direction.
};

/// Traces the flow map of the light that enters the volume to the plane of `plate`, or to the body of `surfaces`.
/// Surfaces of `surfaces` (bounds, cut, obstacles; its plate is ignored) stop light.
/// @param plate  The whole surface. For a body, a plane behind all of it that faces the light: the points of the body
///               are projected on it, from the source if there is one.
/// @return nothing if no light lands, or if the light meets the plane before the volume. The same for any number of
/// threads, and at all ranks of any number. @throw Cancelled; as Ranks::all_gather.
std::optional<FlowIrradiance> flow_irradiance(const TensorField& field, const Surfaces& surfaces, const Plate& plate,
                                              const LandingLight& light, const FlowIrradianceSettings& settings,
                                              const Progress& progress);

}  // namespace tensorray
