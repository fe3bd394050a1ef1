#pragma once
/// @file renderer/materials/reflectance_table.h
/// Reflectances of colours in the bands that are rendered, fast enough for every surface that a path meets.

#include <vector>

#include <Eigen/Core>

#include "renderer/color/reflectance.h"
#include "renderer/materials/scattering.h"

namespace tensorray {

/// The spectra of a ReflectanceModel at the nodes of a grid of colours, linear between them. A colour is linear in the
/// spectrum, so that the interpolated spectrum gives the interpolated colour: exactly where the nodes' spectra do.
/// Immutable; shared by threads.
class ReflectanceTable {
 public:
  /// @param bands, xyz_to_rgb  As those of the model. Takes 10 to 100 ms.
  ReflectanceTable(const ReflectanceModel& model, const std::vector<Band>& bands, const Eigen::Matrix3d& xyz_to_rgb);

  /// Of a colour of the working space; its components are clamped to [0, 1]. @param reflectance  One for each band.
  void reflectance(const Eigen::Vector3f& color, BandsOut reflectance) const;

  /// The colour, in the working space, of bands with these values.
  Eigen::Vector3f color(const BandsIn& values) const { return (colors_ * values.matrix()).cast<float>(); }

  /// The Y of bands with these values.
  double luminance(const BandsIn& values) const { return luminance_.dot(values.matrix()); }

  Eigen::Index bands() const { return luminance_.size(); }

 private:
  Eigen::ArrayXXf nodes_;  ///< Bands × nodes, red fastest.
  Eigen::Matrix3Xd colors_;
  Eigen::VectorXd luminance_;
};

}  // namespace tensorray
