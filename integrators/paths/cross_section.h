#pragma once
/// @file integrators/paths/cross_section.h
/// The ellipses that a tensor makes along a path (Zheng and Pang 2003, Eq. 8), and frames that join them.

#include <vector>

#include "integrators/bending/bending.h"

namespace tensorray {

/// From the ellipse of the tensor to that of a tube.
struct CrossSectionSettings {
  double scale = 1;                ///< World units per unit of T; > 0.
  double least_radius = 0;         ///< World units; no semi-axis is shorter (what degenerates stays visible); > 0.
  double greatest_radius = 1e300;  ///< World units; larger ellipses shrink to it and keep their shape; >= the least.
};

/// An ellipse about a point of a path, normal to it. Two pairs of vectors span it, for two purposes; in each the
/// second one follows the first by a positive turn about V.
struct CrossSection {
  /// The semi-axes: principal, normal to each other, major no shorter than minor. The major axis does not change its
  /// sign from point to point, but where the ellipse passes through a circle the two change places.
  Eigen::Vector3d major = Eigen::Vector3d::Zero(), minor = Eigen::Vector3d::Zero();

  /// Conjugate semi-diameters: x cos θ + y sin θ runs along the ellipse, and points of equal θ correspond from point to
  /// point. They are the images of a parallel frame under the symmetric tensor whose eigenvectors and eigenvalues are
  /// the semi-axes: as smooth as T, without a twist or a flip, however the axes turn or change places.
  Eigen::Vector3d x = Eigen::Vector3d::Zero(), y = Eigen::Vector3d::Zero();
};

/// The semi-axes of T C as columns, the longer one first, where C is the unit circle in the plane normal to TᵀV: T
/// times the right singular vectors of T Q, Q an orthonormal basis of that plane. As Vᵀ(T c) = (TᵀV)ᵀc = 0 they lie in
/// the plane normal to V. Where TᵀV = 0, T takes everything to that plane; C is then the great circle of the unit
/// sphere that has the largest image.
/// @param direction  V, unit.
Eigen::Matrix<double, 3, 2> ellipse(const Eigen::Matrix3d& tensor, const Eigen::Vector3d& direction);

/// A unit vector normal to `from` at one point, carried to the next one along a curve without a turn about it: the
/// double reflection of Wang et al. 2008, "Computation of Rotation Minimizing Frames" (error h⁴).
/// @param positions, directions  Of the two points; directions are unit.
Eigen::Vector3d transported(const Eigen::Vector3d& normal, const Eigen::Vector3d& from_position,
                            const Eigen::Vector3d& from_direction, const Eigen::Vector3d& to_position,
                            const Eigen::Vector3d& to_direction);

/// One cross section for each point.
/// @throw std::invalid_argument if a setting is out of range.
std::vector<CrossSection> cross_sections(const PathPoints& points, const CrossSectionSettings& settings);

/// The scale at which the median of all semi-axes of `paths` in the field is `radius`; 1 where there is none.
double scale_for_radius(const std::vector<const PathPoints*>& paths, double radius);

}  // namespace tensorray
