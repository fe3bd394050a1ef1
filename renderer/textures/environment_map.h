#pragma once
/// @file renderer/textures/environment_map.h
/// Light that comes from all around, from infinitely far away, as a picture tells.

#include <vector>

#include <Eigen/Core>

#include "renderer/images/image.h"
#include "renderer/sampling/distribution.h"

namespace tensorray {

/// A latitude-longitude picture, as seen from within. In its own frame +z is up: the upper edge is +z, the lower one
/// −z; the middle of the picture is +x, a quarter of its width to the left of that is +y, to the right −y, and its left
/// and right edges meet at −x.
struct EnvironmentLight {
  Image picture;                    ///< Any channels, scene-linear. What is negative or not finite counts as 0.
  Eigen::MatrixXf channel_spectra;  ///< Bands × channels: the radiance in a band of a channel that is 1; >= 0.
  Eigen::Matrix3d to_world = Eigen::Matrix3d::Identity();  ///< A rotation, from the picture's frame.
};

/// An EnvironmentLight that can be sampled. Texels are interpolated linearly; directions are chosen among texels by
/// their importance times their solid angle, and evenly within one: the density is bounded at the poles too, and it is
/// above 0 wherever there is light. Memory: the picture, and 8 bytes a texel. Immutable: any thread may use it.
class EnvironmentMap {
 public:
  /// @param importance  Of each band, >= 0, such as its luminance.
  /// @throw std::invalid_argument if the picture has no pixels, the shapes do not fit, a spectrum is negative or not
  /// finite, or `to_world` is not a rotation.
  EnvironmentMap(EnvironmentLight light, const std::vector<float>& importance);

  /// Adds the radiance that comes from `direction` (unit, world; from the viewer outwards) to that of every band.
  void add_radiance(const Eigen::Vector3d& direction, std::vector<float>& radiance) const;

  /// A unit direction in the world, from evenly spread `u` of [0, 1)².
  Eigen::Vector3d sample(const Eigen::Vector2d& u) const;

  /// The density of `sample`, in 1/steradian.
  double pdf(const Eigen::Vector3d& direction) const;

  /// The radiance, weighted by the importance, integrated over all directions.
  double importance() const { return cells_.sum(); }

 private:
  double row_height(int row) const;

  EnvironmentLight light_;
  Distribution2D cells_;  ///< Of the texels.
};

}  // namespace tensorray
