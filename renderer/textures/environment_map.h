#pragma once
/// Light that comes from infinitely far away in all directions, given by a picture.

#include <vector>

#include <Eigen/Core>

#include "renderer/images/image.h"
#include "renderer/sampling/sampling.h"

namespace tensorray {

/// A latitude-longitude picture, as seen from inside. In its own frame +z is up: the upper edge is +z and the lower
/// edge −z. The middle of the picture is +x; a quarter of its width to the left is +y. The edges are −x.
struct EnvironmentLight {
  Image picture;                    ///< Any channels, scene-linear. Values that are negative or not finite count as 0.
  Eigen::MatrixXf channel_spectra;  ///< Bands × channels: the radiance in each band of a channel with value 1; >= 0.
  Eigen::Matrix3d to_world = Eigen::Matrix3d::Identity();  ///< Rotation from the frame of the picture to the world.
};

/// An EnvironmentLight that can be sampled. Texels are interpolated linearly. Sampling chooses a texel in proportion to
/// its importance times its solid angle, then a direction uniformly within the texel. The density is bounded, also at
/// the poles, and is above 0 wherever there is light. Memory: 8 bytes per texel more. Immutable.
class EnvironmentMap {
 public:
  /// @param importance  Weight of each band, >= 0, such as its luminance.
  /// @throw std::invalid_argument if there are no pixels, shapes or spectra do not fit, or `to_world` is no rotation.
  EnvironmentMap(EnvironmentLight light, const std::vector<float>& importance);

  /// Adds the radiance from `direction`. @param direction  Unit, world; from the viewer outwards.
  /// @param radiance  Of each band from `first_band` on.
  void add_radiance(const Eigen::Vector3d& direction, std::vector<float>& radiance,
                    std::ptrdiff_t first_band = 0) const;

  /// A unit direction in the world. @param u  Uniform in [0, 1)².
  Eigen::Vector3d sample(const Eigen::Vector2d& u) const;

  /// The density of `sample`, in 1/steradian.
  double pdf(const Eigen::Vector3d& direction) const;

  /// The integral over all directions of the radiance weighted by the importance.
  double importance() const { return cells_.sum(); }

 private:
  double row_height(int row) const;

  EnvironmentLight light_;
  Distribution2D cells_;  ///< The distribution over the texels.
};

}  // namespace tensorray
