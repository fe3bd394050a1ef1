#pragma once
/// @file integrators/packets/kernel_rays.h
/// Rays and settings of the kernel.

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "integrators/bending/bending.h"
#include "integrators/bending/ray_record.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray::packets {

/// A ray in the field.
struct KernelRay {
  BrickPoint place;
  std::array<float, 3> direction;  ///< V; unit, world axes.
  float strength = 0;              ///< σ = s · scale.
  float norm = 0;                  ///< Norm of the deviator of T as last sampled; 0 if it does not make steps shorter.
  double length = 0;               ///< Length of the path, world units; the kernel adds to it.
  std::uint32_t steps = 0;         ///< Number of steps; the kernel adds to it.
  float log_radiance_scale = 0;    ///< Λ in the kernel, if it is wanted.
  std::int8_t axis = -1;           ///< Axis of the face of the extent where the ray left; -1: it has not left.
  float step = 0;                  ///< If the ray has not left: length of its next step, world units; 0: not known.
  bool lands = false;              ///< Whether this step meets a surface. Without it, the step would end at
  std::array<float, 3> end{}, end_direction{};  ///< a position as that of `place`, with this direction.
};

/// Derivatives of a ray along two parameters: voxels, in index space, and radians.
struct KernelDifferential {
  float position[2][3], direction[2][3];
};

struct KernelRays {
  std::vector<KernelRay> rays;
  std::vector<KernelDifferential> differentials;  ///< One for every ray, or empty.
  std::vector<std::vector<StepPoint>*> points;    ///< One list for every ray, to which the kernel adds; or empty.
  bool wants_log_radiance_scale = false;          ///< Only without differentials: see RayBatch.
};

/// Whether the step from one point to another meets a surface, so that packets cannot take it. Called where surfaces
/// are near.
using MeetsSurface = std::function<bool(const Eigen::Vector3d& from, const Eigen::Vector3d& to)>;

struct KernelSettings {
  BendingMethod method = BendingMethod::splitting;
  float step = 0;       ///< Voxels; 0: automatic.
  float tolerance = 0;  ///< Adaptive methods: voxels and radians.
  std::uint32_t max_steps = 0;
  float max_length = 0;          ///< World units; limit of the whole path, `KernelRay::length` included.
  MeetsSurface meets_surface;    ///< Null if there are no surfaces within the field.
  Eigen::AlignedBox3d surfaces;  ///< Box around these surfaces, index space.
};

}  // namespace tensorray::packets
