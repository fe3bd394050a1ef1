#pragma once
/// @file renderer/shading/bending_region.h
/// A region of space in which light does not go straight, as shading sees it.

#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// The way of one band's light through the region, followed back from the viewer.
struct BentWay {
  int band = 0;
  double place = 0.5;  ///< The wavelength: 0 and 1 are the ends of the band.

  // Set by `follow_back`.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();   ///< Where it leaves the region, or meets a surface.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit; the direction in which it is followed.
  double gain = 1;                                      ///< Factor on the radiance that is found at the end of the way.
  bool arrives = false;     ///< False: nothing is known of light along this way, which counts as none.
  bool on_surface = false;  ///< Whether the way ends on a surface; otherwise it goes on straight from `position`.
};

/// A convex region, so that light that has left it does not meet it again. Any thread may use it.
class BendingRegion {
 public:
  virtual ~BendingRegion() = default;

  /// Distance at which a straight ray enters: 0 if it starts inside, infinite if it misses the region.
  virtual double entry(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const = 0;

  /// Follows a ray that enters, once for each of `ways`.
  virtual void follow_back(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                           std::vector<BentWay>& ways) const = 0;
};

}  // namespace tensorray
