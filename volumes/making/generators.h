#pragma once
/// Analytic tensor fields, sampled on a grid.

#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "volumes/grids/block_source.h"

namespace tensorray {

/// Where a generator samples. The outermost voxel centres are on the faces of the box; a single voxel along an axis is
/// in the middle.
struct GridSettings {
  Eigen::Vector3i resolution{64, 64, 64};  ///< Voxels along x, y, z; >= 1, and 1 where the box has no thickness.
  Eigen::Vector3d min{-1, -1, -1};         ///< Corner with the least coordinates, world units.
  Eigen::Vector3d max{1, 1, 1};            ///< Corner with the greatest coordinates, world units; >= min.
  int levels = 1;                          ///< Of a point load: each refines the bricks that are near the load.
};

// The parameters of each generator: plain data with defaults. `describe`, below, names them for scene files,
// command-line flags and metadata.

/// A load on the half space z < 0 (point_load_stress, disc_load_stress): stress, tension positive. The load is at the
/// centre of the face z = max.z + one voxel, so that the singular point of a point load is one voxel outside the grid.
struct PointLoad {
  double load = 1;             ///< Force pushing towards −z.
  double poisson_ratio = 0.3;  ///< In [-1, 0.5].
  double radius = 0;           ///< Of the disc that the load presses on; 0: a point.
};

/// Two loads on the same face, `separation` apart along x. Their stresses add.
struct TwoPointLoad {
  double load = 1;
  double second_load = 1;
  double separation = 0.8;
  double poisson_ratio = 0.3;
  double radius = 0;
};

/// The same tensor everywhere.
struct Constant {
  Eigen::Matrix3d tensor = Eigen::Vector3d(1, 0, -1).asDiagonal();
};

/// A constant antisymmetric tensor: T V = rate · axis × V, with unit `axis`. V turns about the axis.
struct Rotation {
  Eigen::Vector3d axis{0, 0, 1};  ///< Any length except zero.
  double rate = 1;                ///< Radians per unit of length at s = 1.
};

/// Gradient of a shear flow: T = rate · (1 + profile · (position · gradient)) · flow ⊗ gradient, with unit `flow` and
/// unit `gradient`. Non-symmetric; nilpotent if `flow` and `gradient` are perpendicular.
struct Shear {
  Eigen::Vector3d flow{1, 0, 0};
  Eigen::Vector3d gradient{0, 0, 1};
  double rate = 1;
  double profile = 0;
};

/// Velocity gradient of a Burgers vortex about the z axis: axial strain `strain`, circulation Γ = `circulation`, core
/// radius sqrt(4 ν / strain) = `core`. Non-symmetric.
struct Vortex {
  double circulation = 6.283185307179586;
  double core = 0.3;
  double strain = 0.2;
};

/// A diffusion-like field: anisotropic along a helix about the z axis, isotropic away from it. The helix passes through
/// (radius, 0, 0). The field is continuous everywhere, and smooth except on the axis.
struct Helix {
  double radius = 0.6;
  double pitch = 1.0;       ///< Rise per turn; not zero, negative for a left-handed helix.
  double thickness = 0.25;  ///< Standard deviation of the Gaussian profile across the helix.
  double along = 1.7;       ///< On the helix: the eigenvalue along it.
  double across = 0.3;      ///< On the helix: the two other eigenvalues.
  double background = 0.7;  ///< Far from the helix: all eigenvalues.
};

// `describe(generator, visit)` calls visit(key, member, meaning) for each parameter.

template <class Visit>
void describe(PointLoad& g, Visit&& visit) {
  visit("load", g.load, "force of the load, pushing towards -z");
  visit("poisson_ratio", g.poisson_ratio, "Poisson ratio of the material, -1 to 0.5");
  visit("radius", g.radius, "radius of the disc on which the load presses, as a sphere would; 0: a point");
}

template <class Visit>
void describe(TwoPointLoad& g, Visit&& visit) {
  visit("load", g.load, "force of the load at -x, pushing towards -z");
  visit("second_load", g.second_load, "force of the load at +x, pushing towards -z");
  visit("separation", g.separation, "distance between the loads along x");
  visit("poisson_ratio", g.poisson_ratio, "Poisson ratio of the material, -1 to 0.5");
  visit("radius", g.radius, "radius of the disc on which each load presses, as a sphere would; 0: a point");
}

template <class Visit>
void describe(Constant& g, Visit&& visit) {
  visit("tensor", g.tensor, "the tensor, row by row");
}

template <class Visit>
void describe(Rotation& g, Visit&& visit) {
  visit("axis", g.axis, "axis about which light turns");
  visit("rate", g.rate, "radians per unit of length at s = 1");
}

template <class Visit>
void describe(Shear& g, Visit&& visit) {
  visit("flow", g.flow, "direction of the flow");
  visit("gradient", g.gradient, "direction in which the flow's speed grows");
  visit("rate", g.rate, "shear rate");
  visit("profile", g.profile, "relative growth of the shear rate per unit of length along `gradient`");
}

template <class Visit>
void describe(Vortex& g, Visit&& visit) {
  visit("circulation", g.circulation, "circulation of the vortex");
  visit("core", g.core, "radius of the core");
  visit("strain", g.strain, "axial strain rate");
}

template <class Visit>
void describe(Helix& g, Visit&& visit) {
  visit("radius", g.radius, "radius of the helix");
  visit("pitch", g.pitch, "rise per turn");
  visit("thickness", g.thickness, "standard deviation of the tube's profile");
  visit("along", g.along, "on the helix: the eigenvalue along it");
  visit("across", g.across, "on the helix: the two other eigenvalues");
  visit("background", g.background, "isotropic value far from the helix");
}

using Generator = std::variant<PointLoad, TwoPointLoad, Constant, Rotation, Shear, Vortex, Helix>;

/// The kinds, in the order of Generator's alternatives: "point_load", "two_point_load", "constant", "rotation",
/// "shear", "vortex", "helix".
const std::vector<std::string>& generator_kinds();
std::string kind_of(const Generator& generator);

/// The generator of that kind with its defaults. @throw std::invalid_argument that lists the kinds if the kind is
/// unknown.
Generator generator_of(const std::string& kind);

/// The default grid of a kind. The box of point loads is −1…1, −1…1, −2…−voxel; other boxes are −1…1 along each axis.
/// `resolution` is the number of voxels along the longest axis of the box; voxels are cubes.
GridSettings default_grid(const Generator& generator, int resolution = 64);

/// Checks that a grid fits in memory, unless there is a bound of memory. @param bytes  For each voxel.
/// @throw std::invalid_argument with what it needs, and what there is.
void require_memory_for(const GridSettings& grid, double bytes);

/// Samples the field. The name of the result is the kind; its metadata hold kind and parameters (`tensorray:source`).
/// @throw std::invalid_argument if a parameter is out of range, or the grid does not fit in memory; the message names
/// it.
TensorGrid generate(const Generator& generator, const GridSettings& grid);

/// The same, block by block. A brick of 8³ cells is refined if it is nearer to a load than its own edge.
BlockSource generator_source(const Generator& generator, const GridSettings& grid);

// The stress in an elastic half space under a load on its surface, in closed form. The material fills z < 0; the load
// is about the origin, and pushes towards −z. Stress is tension positive, in force per area of the units of `load` and
// `position`. Any thread may call these.

/// Under a load on a point, at `position` (z <= 0, not the origin) (Boussinesq 1885; Timoshenko & Goodier, Theory of
/// Elasticity, §138).
Eigen::Matrix3d point_load_stress(const Eigen::Vector3d& position, double load, double poisson_ratio);

/// Under a load on a disc of `radius` (> 0), pressed as by a sphere: 3 load / (2π radius²) · sqrt(1 − (r/radius)²) at
/// the distance r from its middle (Hertz 1882; Huber 1904). At `position` (z <= 0). Far away, it is that of the point.
Eigen::Matrix3d disc_load_stress(const Eigen::Vector3d& position, double load, double radius, double poisson_ratio);

}  // namespace tensorray
