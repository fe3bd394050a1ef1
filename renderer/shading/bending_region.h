#pragma once
/// @file renderer/shading/bending_region.h
/// A region of space in which light does not go straight, as shading sees it.

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/surfaces/surface_scene.h"

namespace tensorray {

/// The way of one band's light through the region.
struct BentWay {
  int band = 0;
  double place = 0.5;  ///< The wavelength: 0 and 1 are the ends of the band.
  /// Radians; by how much the end may be off, as seen from the start, and its direction. It may then be interpolated
  /// between ways of other bands that stand next to it and start alike. 0: each way is followed.
  double tolerance = 0;

  /// Where it starts; `follow_back` and `follow_light` set it to where it leaves the region, or meets a surface.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit; the direction in which it is followed.

  // Set by `follow_back` and `follow_light`.
  double gain = 1;  ///< Followed back: factor on the radiance found at its end; followed by light: on a photon's power.
  /// Followed back: factor on the radiance of photons that keep their power, whatever light keeps here: the phase space
  /// that light from the end has there, over that which it has at the start. Followed by light: the same for its way.
  double compression = 1;
  bool arrives = false;     ///< False: nothing is known of light along this way, which counts as none.
  bool on_surface = false;  ///< Whether the way ends on a surface; otherwise it goes on straight from `position`.
};

/// A convex region, so that light that has left it does not meet it again. Any thread may use it.
class BendingRegion {
 public:
  virtual ~BendingRegion() = default;

  /// Distance at which a straight ray enters: 0 if it starts inside, infinite if it misses the region.
  virtual double entry(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const = 0;

  /// Follows light of a viewer back along ways that enter, in place. One call with many ways is faster than many calls,
  /// if those of one start stand next to each other. The result of a way without a `tolerance` does not depend on the
  /// others; that of a way with one depends on those that start alike.
  virtual void follow_back(std::vector<BentWay>& ways) const = 0;

  /// The same for light that starts where the ways do.
  virtual void follow_light(std::vector<BentWay>& ways) const = 0;
};

/// The surface at the end of a way, or the one that it meets behind the region, if there is one.
std::optional<SurfaceHit> surface_at_end(const SurfaceScene& surfaces, const BentWay& way);

}  // namespace tensorray
