#pragma once
/// A region of space in which light does not go straight, as shading sees it.

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/surfaces/surface_scene.h"

namespace tensorray {

/// A ray of one band's light through the region.
struct BentRay {
  int band = 0;
  double place = 0.5;  ///< The wavelength: 0 and 1 are the ends of the band.
  /// Radians; by how much the end and its direction may be off, as seen from the start. With a tolerance, the ray may
  /// be interpolated between rays of other bands that start alike and stand next to it. 0: it is traced.
  double tolerance = 0;

  /// Its start; `trace_radiance` and `trace_importance` set it to where it leaves the region, or meets a surface.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit; in which it is traced.

  // Set by `trace_radiance` and `trace_importance`.
  double radiance_scale = 1;  ///< Factor on the radiance that is found at its end; of importance: on a photon's power.
  /// The same factor if photons keep their power, whatever is conserved here: the volume of phase space of the light at
  /// the end, over that at the start. Of importance: the same for its ray.
  double jacobian = 1;
  bool arrives = false;     ///< False: it could not be traced to its end, and brings no light.
  bool on_surface = false;  ///< Whether it ends on a surface; otherwise it goes on straight from `position`.
};

/// A convex region, so that light that has left it does not meet it again. Any thread may use it.
class BendingRegion {
 public:
  virtual ~BendingRegion() = default;

  /// Distance at which a straight ray enters: 0 if it starts inside, infinite if it misses the region.
  virtual double entry(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const = 0;

  /// Traces rays that enter back to where their light comes from, in place. One call with many rays is faster than many
  /// calls, if those of one start stand next to each other. The result of a ray without a `tolerance` does not depend
  /// on the others; that of a ray with one depends on those that start alike.
  virtual void trace_radiance(std::vector<BentRay>& rays) const = 0;

  /// Traces the rays of photons that start there, in place.
  virtual void trace_importance(std::vector<BentRay>& rays) const = 0;
};

/// The surface at the end of a ray, or the one that it meets behind the region, if there is one.
inline std::optional<SurfaceHit> surface_at_end(const SurfaceScene& surfaces, const BentRay& ray) {
  constexpr double part = 1e-5;  // Of the scene: how far before the end the surface is looked for.
  const double back = ray.on_surface ? part * surfaces.bounds().diagonal().norm() : 0;
  return surfaces.intersect(ray.position - back * ray.direction, ray.direction);
}

}  // namespace tensorray
