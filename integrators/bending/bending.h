#pragma once
/// @file integrators/bending/bending.h
/// Bends light through a tensor field by the rule (Zheng and Pang 2003, Eq. 5)
///   P' = V,  V' = σ (T V − (VᵀTV) V),  |V| = 1, with σ = s · scale.
/// Only bending_steps.h and, for packets, packet_bending-inl.h and packet_stages-inl.h contain this rule.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "integrators/bending/ray_record.h"
#include "renderer/surfaces/geometry.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

enum class BendingMethod {
  automatic,  ///< `splitting4` in a cubic field; `splitting` in a linear one, whose kinks leave no more than order 2.
  euler,      ///< The paper's Eq. 3–4: D ← normalize(D + σ h T(P) D), P ← P + h D. Order 1.
  splitting,  ///< Drift h/2, kick D ← normalize(exp(h σ T(P)) D), drift h/2. Order 2; exact in V for constant T; stable
              ///< at any step length.
  splitting4,  ///< Six such kicks between drifts (composition.h). Order 4; exact in V for constant T; stable at any
               ///< step length; adaptive, unless the step is given.
  rk4,         ///< Classical Runge–Kutta. Order 4.
  bs23,        ///< Bogacki–Shampine, adaptive. Order 3.
  dopri5,      ///< Dormand–Prince, adaptive. Order 5. The reference on smooth fields.
};

struct BendingSettings {
  BendingMethod method = BendingMethod::automatic;

  double scale = 1;  ///< Factor on every ray's flexibility: light bends by s · scale · T. Finite.

  /// Arc length of a step, in voxels along the ray (a step of 1 has length 1 in index space). 0 means automatic: ½
  /// voxel, or shorter where the field is strong, so that |σ| h ‖T − ⅓ tr(T) I‖ (Frobenius) ≤ 0.2 with the last sampled
  /// T (Eq. 9, read dimensionally). An automatic step of `splitting`, which is stable, is never shorter than 1/64
  /// voxel. Steps of `splitting4` follow its error if they are automatic, and are of at most 6 voxels. For the other
  /// adaptive methods, `step` is the length of the first step and the limit of all steps; if it is 0, the limit is 2
  /// voxels.
  double step = 0;
  double tolerance = 1e-3;  ///< Adaptive methods: greatest error estimate of a step, in voxels, and, but for
                            ///< `splitting4`, in radians; > 0. Differentials do not count.
  int max_steps = 20000;    ///< Greatest number of steps of a ray; > 0.

  /// Longest path that is followed, world units; > 0. A ray that reaches this length ends there as `missed`, inside or
  /// outside the volume.
  double max_length = std::numeric_limits<double>::infinity();
};

/// The settings with the method that `automatic` is for a field.
BendingSettings resolved(BendingSettings settings, const TensorField& field);

/// Why a ray ended. The counts are part of every render's statistics.
enum class RayEnd : std::uint8_t {
  plate,       ///< It reached the receiver.
  missed,      ///< It left the scene, or reached BendingSettings::max_length.
  obstacle,    ///< It reached an obstacle.
  step_limit,  ///< It took BendingSettings::max_steps steps.
  degenerate,  ///< It has no next direction: σ·T is not finite, or takes the direction to zero.
};
constexpr int ray_end_count = 5;
const char* to_string(RayEnd end);

/// Derivatives of a ray along two parameters (Igehy 1999, "Tracing Ray Differentials"), one column for each parameter.
struct RayDifferential {
  Eigen::Matrix<double, 3, 2> position = Eigen::Matrix<double, 3, 2>::Zero();   ///< World units per parameter.
  Eigen::Matrix<double, 3, 2> direction = Eigen::Matrix<double, 3, 2>::Zero();  ///< Radians per parameter.

  /// Derivatives of the path's length; set by `trace`. They are not zero on a surface, because neighbouring rays reach
  /// it at different lengths. At equal lengths the derivative of the position is `position` − V `length`.
  Eigen::RowVector2d length = Eigen::RowVector2d::Zero();
};

/// Rays. Each vector has one entry for each ray. Rays of one origin (the wavelengths of a photon) stand next to each
/// other.
struct RayBatch {
  std::vector<Eigen::Vector3d> position;       ///< World.
  std::vector<Eigen::Vector3d> direction;      ///< Unit.
  std::vector<double> flexibility;             ///< s; any sign.
  std::vector<RayDifferential> differentials;  ///< One for every ray, or empty. They cost about as much as three rays.
  bool wants_radiance_change = false;          ///< Only without differentials.

  // Set by `trace`.
  std::vector<RayEnd> end;
  std::vector<double> length;        ///< Length of the path, world units.
  std::vector<std::uint32_t> steps;  ///< Number of steps in the field.
  /// If wanted: Λ = ∫ σ (tr T − 3 VᵀTV) dt along each ray, the divergence of Eq. 5 in phase space. Where photons keep
  /// their power, light of strength σ has L_end = L_start e^(−Λ). A ray that is traced backwards, from the viewer, has
  /// −σ, and the radiance that it finds is multiplied by e^(+Λ). A step of `splitting` has exactly the change
  /// hσ tr T − 3 ln |exp(hσT) V|. Rays are the same with and without it.
  std::vector<double> radiance_change;
  std::uint64_t tensor_samples = 0;  ///< `trace` adds to it.

  std::size_t size() const { return position.size(); }
  void clear();
  void add(const Eigen::Vector3d& position, const Eigen::Vector3d& direction, double flexibility);
};

/// A vertex of the polyline that a ray's steps form.
struct TrackPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double length = 0;  ///< Length of the ray up to here, world units; a step is a little longer than its chord.
};

/// Vertices from the start to the end. There are no gaps within the volume, even if light leaves the cut and meets
/// nothing more. Parts may lie outside the volume. Empty if the ray meets nothing.
using Track = std::vector<TrackPoint>;

/// Follows every ray of `batch` to its end, in place: position and direction become those at the end. A ray that missed
/// stays where it last crossed the bounds (or where it started), unless there is a `max_length`. Differentials follow
/// the variational equations; they are the derivatives of the method's own steps. On a surface they are the derivatives
/// of the point where rays meet it, so that those of the position lie in the surface.
/// @param field     World frame; s · scale · T in 1/length. Light goes straight outside its extent and outside the cut.
/// @param geometry  Bounds (those of the field), cut, plate and obstacles.
/// Accuracy: the method's order on smooth fields, 2 on trilinear data. A cubic field has kinks in its third
/// derivatives: at steps much shorter than its voxels the order is 4 at most. Entry, exit and hits are located by
/// repeating the step with the length that ends on the surface, which keeps the order. Threads: `field` and `geometry`
/// are shared and immutable; one batch belongs to one thread.
/// @throw std::invalid_argument if a setting is out of range.
void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch);

/// The same, one ray at a time and in double precision. Tests compare `trace` with this reference.
void trace_reference(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                     RayBatch& batch);

/// The same as `trace`; it also records the points of each ray, at little cost. The rays are the same.
void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<RayRecord>& records);
void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<RayPoints>& points);

/// The same as `trace`; it also records a track for each ray, at almost no cost.
void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<Track>& tracks);

}  // namespace tensorray
