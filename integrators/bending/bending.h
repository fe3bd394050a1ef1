#pragma once
/// @file integrators/bending/bending.h
/// Bends light through a tensor field. Only bending_steps.h, and for packets packet_bending-inl.h and
/// packet_stages-inl.h, know the rule (Zheng and Pang 2003, Eq. 5):  P' = V,  V' = σ (T V − (VᵀTV) V),  |V| = 1, with
/// σ = s · scale.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "renderer/surfaces/geometry.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

enum class BendingMethod {
  euler,      ///< The paper's Eq. 3–4: D ← normalize(D + σ h T(P) D), P ← P + h D. Order 1.
  splitting,  ///< Drift h/2, kick D ← normalize(exp(h σ T(P)) D), drift h/2. Order 2; exact in V for constant T;
              ///< stable.
  rk4,        ///< Classical Runge–Kutta. Order 4.
  bs23,       ///< Bogacki–Shampine, adaptive. Order 3.
  dopri5,     ///< Dormand–Prince, adaptive. Order 5: the reference on smooth fields.
};

struct BendingSettings {
  BendingMethod method = BendingMethod::splitting;

  double scale = 1;  ///< Factor on every ray's flexibility: light is bent by s · scale · T. Finite.

  /// Arc length per step, in voxels as the ray crosses them (a step of 1 is as long as the direction's unit in index
  /// space); 0: automatic, which is ½ voxel, and shorter where the field is strong: |σ| h ‖T − ⅓ tr(T) I‖ (Frobenius) ≤
  /// 0.2 with T as last sampled (Eq. 9, read dimensionally); of `splitting`, which is stable, never below 1/64 voxel.
  /// For the adaptive methods the first and the longest step; automatic ones are at most 2 voxels long.
  double step = 0;
  double tolerance = 1e-3;  ///< Adaptive methods: error per step of the ray, not of its differentials, in voxels and in
                            ///< radians; > 0.
  int max_steps = 20000;    ///< Steps before a ray is given up; > 0.

  /// Of the path, world units; > 0. A ray that has come so far ends there, in the volume or outside, as one that
  /// missed.
  double max_length = std::numeric_limits<double>::infinity();
};

/// Why a ray ended. Never ignored: the counts are part of every render's statistics.
enum class RayEnd : std::uint8_t {
  plate,       ///< On the receiver.
  missed,      ///< Left the scene.
  obstacle,    ///< On an obstacle.
  step_limit,  ///< Took BendingSettings::max_steps steps.
  degenerate,  ///< Its direction could not be followed: σ·T is not finite, or annihilates it.
};
constexpr int ray_end_count = 5;
const char* to_string(RayEnd end);

/// How a ray changes with two parameters (Igehy 1999, "Tracing Ray Differentials"): a column each.
struct RayDifferential {
  Eigen::Matrix<double, 3, 2> position = Eigen::Matrix<double, 3, 2>::Zero();   ///< World units per parameter.
  Eigen::Matrix<double, 3, 2> direction = Eigen::Matrix<double, 3, 2>::Zero();  ///< Radians per parameter.

  /// Set by `trace`: of the path's length, as on surfaces neighbouring rays have not come equally far. The rays at
  /// equal lengths differ by `position` − V `length`.
  Eigen::RowVector2d length = Eigen::RowVector2d::Zero();
};

/// Rays, one an entry of every vector. Rays of one origin (the wavelengths of a photon) stand next to each other.
struct RayBatch {
  std::vector<Eigen::Vector3d> position;       ///< World.
  std::vector<Eigen::Vector3d> direction;      ///< Unit.
  std::vector<double> flexibility;             ///< s; any sign.
  std::vector<RayDifferential> differentials;  ///< One for every ray, or none at all: they cost about three rays.

  // Set by `trace`.
  std::vector<RayEnd> end;
  std::vector<double> length;        ///< Of the path, world units.
  std::vector<std::uint32_t> steps;  ///< Steps in the field.
  std::uint64_t tensor_samples = 0;  ///< Added to.

  std::size_t size() const { return position.size(); }
  void clear();
  void add(const Eigen::Vector3d& position, const Eigen::Vector3d& direction, double flexibility);
};

/// A recorded point of a ray's path.
struct PathPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< V; unit.
  double length = 0;                                    ///< Of the path so far, world units.
  Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();     ///< T of the field here; zero where light is straight.
  Eigen::Vector3d change = Eigen::Vector3d::Zero();     ///< V' here, by σ·T: its length is the path's curvature.
  bool in_field = false;  ///< Whether the path bends here (inside the volume and the cut).

  Eigen::Vector3d force() const { return tensor * direction; }  ///< T V, whose length is Eq. 11.
};

/// A path: from the start to the end. A ray has a point at each step in the field, from where it enters to where it
/// leaves, and one at either end of each straight piece that ends on something; two, of which one is in the field,
/// where it enters or leaves. Empty if it meets nothing.
using PathPoints = std::vector<PathPoint>;

/// A corner of the polyline that a ray's steps are.
struct TrackPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double length = 0;  ///< Of the way so far, world units; a step is a little longer than its chord.
};

/// From the start to the end; within the volume without gaps, also where light misses all else behind a cut. Empty if
/// the ray meets nothing. Parts may lie outside of the volume.
using Track = std::vector<TrackPoint>;

/// Follows every ray of `batch` to its end, in place: position and direction are then those of the end. A ray that
/// missed is left where it last crossed the bounds (or where it began), unless there is a `max_length`. Differentials
/// are carried along by the variational equations, as the derivative of the method's own steps; on a surface they are
/// those of the point where rays meet it, so that those of position lie in the surface.
/// @param field     World frame; s · scale · T in 1/length. Light goes straight outside its extent and outside the cut.
/// @param geometry  Bounds (those of the field), cut, plate and obstacles.
/// Accuracy: the method's order on smooth fields, 2 on trilinear data. Entry, exit and hits are located by repeating
/// the step with the length that ends on the surface, which keeps the order.
/// Threads: `field` and `geometry` are shared and immutable; one batch belongs to one thread.
/// @throw std::invalid_argument if a setting is out of range.
void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch);

/// The same, one ray at a time and in double precision throughout: the reference that `trace` is tested against.
void trace_reference(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                     RayBatch& batch);

/// The same, and records the paths, one a ray: the same rays, for one more tensor sample a step.
void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<PathPoints>& paths);

/// The same, and records the tracks, one a ray, at next to no cost.
void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<Track>& tracks);

}  // namespace tensorray
