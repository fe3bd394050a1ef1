#pragma once
/// Ellipses of the tensor along a path (Zheng and Pang 2003, Eq. 8), and frames that join them.

#include <vector>

#include "tracing/bending/bending.h"

namespace tensorray {

/// How the ellipse of a tensor becomes the cross section of a tube.
struct CrossSectionSettings {
  double scale = 1;  ///< World units per unit of T; > 0.
  /// World units; > 0. No semi-axis is shorter, so that degenerate ellipses stay visible. Both limits are smooth
  /// functions of T, and change also semi-axes up to 1.25 of the least one, and from half of the greatest one.
  double min_radius = 0;
  double max_radius = 1e300;  ///< World units; larger ellipses shrink to it and keep their shape; >= min_radius.
};

/// An ellipse about a point of a path, in the plane normal to the path. It has two pairs of spanning vectors, for two
/// purposes. In each pair, a positive turn about V leads from the first vector to the second.
struct CrossSection {
  /// The principal semi-axes, normal to each other; major is not shorter than minor. The sign of the major axis does
  /// not flip from point to point. Where the ellipse passes through a circle, the two axes change places.
  Eigen::Vector3d major = Eigen::Vector3d::Zero(), minor = Eigen::Vector3d::Zero();

  /// Conjugate semi-diameters: x cos θ + y sin θ runs along the ellipse, and points of equal θ on neighbouring ellipses
  /// correspond. x and y are the images of a parallel frame under the symmetric tensor whose eigenvectors and
  /// eigenvalues are the semi-axes. They are as smooth as T: they do not twist or flip, even where the axes turn or
  /// change places.
  Eigen::Vector3d x = Eigen::Vector3d::Zero(), y = Eigen::Vector3d::Zero();
};

/// The semi-axes of T C as columns, the longer one first, where C is the unit circle in the plane normal to TᵀV. They
/// are T times the right singular vectors of T Q, where Q is an orthonormal basis of that plane. They lie in the plane
/// normal to V, because Vᵀ(T c) = (TᵀV)ᵀc = 0. Where TᵀV = 0, T maps every vector to that plane; C is then the great
/// circle of the unit sphere that has the largest image.
/// @param direction  V, unit.
Eigen::Matrix<double, 3, 2> ellipse(const Eigen::Matrix3d& tensor, const Eigen::Vector3d& direction);

/// Carries a unit vector that is normal to the curve at one point to the next point, without a turn about the curve:
/// the double reflection of Wang et al. 2008, "Computation of Rotation Minimizing Frames" (error h⁴).
/// @param normal          Unit; normal to `from_direction`.
/// @param from_direction  Of the curve at the first point; unit.
/// @param to_direction    Of the curve at the second point; unit.
Eigen::Vector3d transported(const Eigen::Vector3d& normal, const Eigen::Vector3d& from_position,
                            const Eigen::Vector3d& from_direction, const Eigen::Vector3d& to_position,
                            const Eigen::Vector3d& to_direction);

/// One cross section for each point.
/// @throw std::invalid_argument if a setting is out of range.
std::vector<CrossSection> cross_sections(const PathPoints& points, const CrossSectionSettings& settings);

/// The scale at which the median of all semi-axes of `paths` in the field is `radius`; 1 if there are none. Runs on all
/// threads.
double scale_for_radius(const std::vector<const PathPoints*>& paths, double radius);

}  // namespace tensorray
