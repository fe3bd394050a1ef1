#pragma once
/// Reflectances of colours in the rendered bands, fast enough for every surface that a path meets.

#include <vector>

#include <Eigen/Core>

#include "renderer/materials/scattering.h"
#include "renderer/spectra/reflectance.h"

namespace tensorray {

/// The spectra of a ReflectanceModel at the nodes of a grid of colours, with linear interpolation. Colour is linear in
/// the spectrum, so the interpolated spectrum has the interpolated colour; if the nodes' are exact. Immutable.
class ReflectanceTable {
 public:
  /// Takes 10 to 100 ms.
  /// @param bands, xyz_to_rgb  The same as the model's.
  ReflectanceTable(const ReflectanceModel& model, const std::vector<Band>& bands, const Eigen::Matrix3d& xyz_to_rgb);

  /// Sets the reflectance of a colour in the working space.
  /// @param color        Components are clamped to [0, 1].
  /// @param reflectance  One value for each band from `first_band` on.
  void reflectance(const Eigen::Vector3f& color, BandsOut reflectance, Eigen::Index first_band = 0) const;

  /// The colour, in the working space, of the values of all bands.
  Eigen::Vector3d color(const BandsIn& values) const {
    return Eigen::Vector4d(colors_.lazyProduct(values.matrix())).head<3>();
  }

  /// The luminance (Y) of the values of all bands.
  double luminance(const BandsIn& values) const { return luminance_.dot(values.matrix()); }

  Eigen::Index bands() const { return luminance_.size(); }

 private:
  Eigen::ArrayXXf nodes_;    ///< Bands × nodes; red varies fastest.
  Eigen::Matrix4Xd colors_;  ///< The last row is 0: vectors of two or four are full.
  Eigen::VectorXd luminance_;
};

}  // namespace tensorray
