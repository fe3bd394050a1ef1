#pragma once
/// @file volumes/making/load_stress.h
/// The stress in an elastic half space under a load on its surface, in closed form.

#include <Eigen/Core>

namespace tensorray {

// The material fills z < 0; the load is about the origin, and pushes towards −z. Stress is tension positive, in force
// per area of the units of `load` and `position`. Any thread may call these.

/// Under a load on a point, at `position` (z <= 0, not the origin) (Boussinesq 1885; Timoshenko & Goodier, Theory of
/// Elasticity, §138).
Eigen::Matrix3d point_load_stress(const Eigen::Vector3d& position, double load, double poisson_ratio);

/// Under a load on a disc of `radius` (> 0), pressed as by a sphere: 3 load / (2π radius²) · sqrt(1 − (r/radius)²) at
/// the distance r from its middle (Hertz 1882; Huber 1904). At `position` (z <= 0). Far away, it is that of the point.
Eigen::Matrix3d disc_load_stress(const Eigen::Vector3d& position, double load, double radius, double poisson_ratio);

}  // namespace tensorray
