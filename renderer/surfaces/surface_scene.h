#pragma once
/// @file renderer/surfaces/surface_scene.h
/// Rays against surfaces, with what is needed to shade what they meet.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "renderer/surfaces/surface.h"

namespace tensorray {

/// Where a ray meets a surface.
struct SurfaceHit {
  double distance = 0;  ///< Along the unit direction, world units.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  /// Where rays of an opaque surface shall start: on the smooth surface that the normals of a mesh describe, which
  /// hides that the triangles are flat (Hanika 2021, "Hacking the Shadow Terminator"). On the side that the ray came
  /// from, at or above `position`.
  Eigen::Vector3d lifted_position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();          ///< Unit, geometric; outwards.
  Eigen::Vector3d shading_normal = Eigen::Vector3d::Zero();  ///< Unit, interpolated; on the same side.
  Eigen::Vector3f color = Eigen::Vector3f::Zero();           ///< If the surface has colours.
  std::uint32_t surface = 0;                                 ///< Index.
  std::uint32_t primitive = 0;                               ///< Triangle, or segment of curves.
  float u = 0, v = 0;                                        ///< Barycentric, of vertices 1 and 2; along a segment, 0.
};

/// What auxiliary planes show of a hit. What the surface does not have is missing.
struct SurfaceData {
  std::optional<float> force, arc_length;
  std::optional<std::uint32_t> path;
};

/// Immutable, and the owner of its surfaces; any number of threads may query it at once.
///
/// Embree searches in single precision, in coordinates relative to the middle and the size of the scene; distance and
/// position are then computed in double. Rays that start at a hit start off the surface by a millionth of the scene's
/// size: a surface that is thinner, or nearer to another one, may let light through.
class SurfaceScene {
 public:
  /// @throw std::invalid_argument naming the surface by its index and what is wrong: an index of a vertex or a count
  /// out of range, a value that is not finite in single precision. std::runtime_error if Embree fails (out of memory,
  /// unsupported processor).
  explicit SurfaceScene(std::vector<ShadedSurface> surfaces);
  ~SurfaceScene();
  SurfaceScene(SurfaceScene&&) noexcept;
  SurfaceScene& operator=(SurfaceScene&&) noexcept;

  /// The nearest surface along the unit `direction`, from either side. Rays may start anywhere: from so far away that
  /// double precision does not resolve the scene, and where a value is not finite, there is none.
  std::optional<SurfaceHit> intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  /// Whether something is nearer than `distance` along the unit `direction`. What is within 5e-5 of the distance of its
  /// end does not count: the target itself, as rounding has it.
  bool occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                double distance = std::numeric_limits<double>::infinity()) const;

  /// Where a ray starts that leaves `hit` at `position` (of the hit, or lifted) along `direction`: off the surface, to
  /// the side of `side` (±1: that of the normal, or the other one).
  Eigen::Vector3d start(const SurfaceHit& hit, const Eigen::Vector3d& position, double side) const {
    return position + side * offset_ * hit.normal;
  }

  SurfaceData data(const SurfaceHit& hit) const;

  const std::vector<ShadedSurface>& surfaces() const;
  const Eigen::AlignedBox3d& bounds() const;  ///< Of all surfaces; empty if there are none.

 private:
  struct State;
  std::unique_ptr<State> state_;
  double offset_ = 0;
};

}  // namespace tensorray
