#pragma once
/// Intersects rays with surfaces and returns what shading needs at the hit.

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
  /// Start of rays that leave an opaque surface: on the smooth surface that the normals of a mesh describe, which hides
  /// that the triangles are flat (Hanika 2021, "Hacking the Shadow Terminator"). It is at or above `position`.
  Eigen::Vector3d lifted_position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();          ///< Unit, geometric; points outwards.
  Eigen::Vector3d shading_normal = Eigen::Vector3d::Zero();  ///< Unit, interpolated; on the same side as `normal`.
  Eigen::Vector3f color = Eigen::Vector3f::Zero();           ///< Zero if the surface has no colours.
  std::uint32_t surface = 0;                                 ///< Index of the surface.
  std::uint32_t roughness_step = 0;                          ///< Added to the index of its material.
  std::uint32_t primitive = 0;                               ///< Index of the triangle, or of the segment of curves.
  float u = 0, v = 0;  ///< Barycentric weights of vertices 1 and 2. On a segment: position along it, and 0.
};

struct StraightRay {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), direction = Eigen::Vector3d::UnitZ();  ///< World; unit.
};

/// Values of a hit for the auxiliary planes. Those that the surface does not have are missing.
struct SurfaceData {
  std::optional<float> force, arc_length;
  std::optional<std::uint32_t> path;
};

/// Immutable; owns its surfaces. Any number of threads may query it at once.
///
/// Embree searches in single precision, in coordinates relative to the centre and the size of the scene. Distance and
/// position are then computed in double precision. Rays that leave a hit start off the surface by a millionth of the
/// scene's size: a surface that is thinner, or closer to another one, may let light through.
class SurfaceScene {
 public:
  /// @throw std::invalid_argument naming the surface by its index and the error: a vertex index or a count out of
  /// range, a value that is not finite in single precision; std::runtime_error if Embree fails.
  explicit SurfaceScene(std::vector<ShadedSurface> surfaces);

  /// The nearest surface along the unit `direction`, from either side. Rays may start anywhere. There is no hit if the
  /// origin is so far away that double precision does not resolve the scene, or if a value is not finite.
  std::optional<SurfaceHit> intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  /// The same for each of `rays`. It is faster where these go nearly alike, as those of a pixel.
  void intersect(const std::vector<StraightRay>& rays, std::vector<std::optional<SurfaceHit>>& hits) const;

  /// Whether a surface is nearer than `distance` along the unit `direction`. The last 5e-5 of the distance does not
  /// count: rounding may place the target itself there.
  bool occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                double distance = std::numeric_limits<double>::infinity()) const;

  /// Start of a ray that leaves `hit` from `position` (the hit's position or lifted_position): off the surface, on the
  /// side `side` (1: the side of the normal, −1: the other side).
  Eigen::Vector3d start(const SurfaceHit& hit, const Eigen::Vector3d& position, double side) const {
    return position + side * offset_ * hit.normal;
  }

  SurfaceData data(const SurfaceHit& hit) const;

  const std::vector<ShadedSurface>& surfaces() const;
  const Eigen::AlignedBox3d& bounds() const;  ///< Bounding box of all surfaces; empty if there are none.

 private:
  struct State;
  std::shared_ptr<State> state_;
  double offset_ = 0;
};

}  // namespace tensorray
