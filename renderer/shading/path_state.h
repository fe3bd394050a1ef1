#pragma once
/// @file renderer/shading/path_state.h
/// A path of light while it is followed from the camera.

#include <algorithm>

#include <Eigen/Core>

#include "renderer/materials/material.h"
#include "renderer/sampling/sampling.h"
#include "renderer/shading/shading.h"

namespace tensorray {

/// A point where a path meets a surface. The frame is the material's: +z points outwards.
struct Vertex {
  SurfaceHit hit;
  const Material* material = nullptr;
  double side = 1;            ///< 1: seen from outside, −1: from inside.
  Eigen::Vector3d point;      ///< The point that is lit.
  Eigen::Vector3d normal;     ///< Towards the viewer, as shaded.
  Eigen::Vector3d direction;  ///< Of the ray that found it.
  Eigen::Matrix3d frame;
  BandValues reflectance;  ///< In the bands of the path.
  ViewedMaterial view;     ///< With wo, the direction to the viewer.

  Eigen::Vector3d to_local(const Eigen::Vector3d& towards) const { return frame.transpose() * towards; }

  /// Start of a ray towards `wi`.
  Eigen::Vector3d start(const SurfaceScene& surfaces, const Eigen::Vector3d& wi) const {
    return surfaces.start(hit, point, wi.z() * view.wo.z() < 0 ? -side : side);
  }
};

/// A path that is followed: where it is, and how much of the light that it finds there reaches the camera.
struct PathState {
  std::size_t ray = 0;  ///< Number of the camera's ray.
  PathSampler sampler;
  int depth = 0;          ///< Number of surfaces that it has met.
  int band = -1;          ///< Its only band, after it was bent; −1: all bands.
  double stands_for = 1;  ///< The number of bands of the camera's ray for which `band` stands.
  BandValues throughput;  ///< In its bands.
  Vertex vertex;          ///< The last surface that it has met; unset before the first.

  Eigen::Index first_band() const { return std::max(band, 0); }
  BandRange bands() const { return {first_band(), throughput.size()}; }
};

/// The luminance of `values`, in the bands of the path, as if its one band stood for all of the light.
inline double brightness(const ShadedScene& scene, const PathState& path, const BandValues& values) {
  return path.band < 0 ? scene.colors.luminance(values) : values[0] / path.stands_for;
}

/// Moves the path to a surface that it has met.
/// @param direction  Of the ray that met it.
void meet_surface(const ShadedScene& scene, const SurfaceHit& hit, const Eigen::Vector3d& direction, PathState& path);

/// Sets the reflectance of a surface in the bands from `first_band` on.
/// @param reflectance  Of as many bands as are wanted.
void set_reflectance(const ShadedScene& scene, const SurfaceHit& hit, Eigen::Index first_band, BandValues& reflectance);

/// What denoisers expect as the colour of a surface, in the working space.
/// @param reflectance  Of the surface, in all bands; changed.
Eigen::Vector3f albedo(const ShadedScene& scene, const SurfaceHit& hit, BandValues& reflectance);

}  // namespace tensorray
