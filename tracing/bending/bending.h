#pragma once
/// Rays: settings of how they are followed, their records and their ends. In a tensor field light bends by (Zheng and
/// Pang 2003, Eq. 5)
///   P' = V,  V' = σ (T V − (VᵀTV) V),  |V| = 1, with σ = s · scale.
/// Only bending_steps.h and, for packets, packet_step-inl.h contain this rule.

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "volumes/bricks/tensor_field.h"
#include "volumes/sampling/brick_point.h"

namespace tensorray {

/// How strongly light of each wavelength bends: s(λ) = a + b λ (Zheng and Pang 2003, Eq. 6).
struct Flexibility {
  double a = 0.75;
  double b = -0.001;  ///< 1/nm.

  double at(double wavelength) const { return a + b * wavelength; }
};

/// A wavelength band, or a colour in RGB mode.
struct LightChannel {
  double flexibility = 0;
  double wavelength = 0;  ///< nm; 0 in RGB mode.
  double power = 1;       ///< Fraction of the beam's power.
};

enum class BendingMethod {
  automatic,  ///< `splitting4` in a cubic field; `splitting` in a linear one, whose kinks leave no more than order 2.
  euler,      ///< The paper's Eq. 3–4: D ← normalize(D + σ h T(P) D), P ← P + h D. Order 1.
  splitting,  ///< Drift h/2, kick D ← normalize(exp(h σ T(P)) D), drift h/2. Order 2; exact in V for constant T; stable
              ///< at any step length.
  splitting4,  ///< Six such kicks between drifts (methods.h). Order 4; exact in V for constant T; stable at any
               ///< step length; adaptive, unless the step is given.
  rk4,         ///< Classical Runge–Kutta. Order 4.
  bs23,        ///< Bogacki–Shampine, adaptive. Order 3.
  dopri5,      ///< Dormand–Prince, adaptive. Order 5. The reference on smooth fields.
};

struct BendingSettings {
  BendingMethod method = BendingMethod::automatic;

  double scale = 1;  ///< Factor on every ray's flexibility: light bends by s · scale · T. Finite.

  /// Arc length of a step, in voxels along the ray (a step of 1 has length 1 in index space), of the finest level where
  /// the step begins. 0 means automatic: ½ voxel, or shorter where the field is strong, so that
  /// |σ| h ‖T − ⅓ tr(T) I‖ (Frobenius) ≤ 0.2 with the last sampled T (Eq. 9, read dimensionally). An automatic step of
  /// `splitting`, which is stable, is never shorter than 1/64 voxel. Steps of `splitting4` follow its error if they are
  /// automatic, and are of at most 6 voxels. For the other adaptive methods, `step` is the length of the first step and
  /// the limit of all steps; if it is 0, the limit is 2 voxels.
  double step = 0;
  double tolerance = 1e-3;  ///< Adaptive methods: greatest error estimate of a step, in voxels of level 0, and, but for
                            ///< `splitting4`, in radians; > 0. Differentials do not count.
  int max_steps = 20000;    ///< Greatest number of steps of a ray; > 0.

  /// Longest path that is followed, world units; > 0. A ray that reaches this length ends there as `missed`, inside or
  /// outside the volume.
  double max_length = std::numeric_limits<double>::infinity();
};

/// The settings with the method that `automatic` is for a field. Only `splitting4`, and `splitting` with a given step,
/// are traced in packets, in cubic fields; all else is five to six times slower.
BendingSettings resolved(BendingSettings settings, const TensorField& field);

/// Why a ray ended. The counts are part of every render's statistics.
enum class RayEnd : std::uint8_t {
  plate,       ///< It reached the receiver.
  missed,      ///< It left the scene, or reached BendingSettings::max_length.
  obstacle,    ///< It reached an obstacle.
  step_limit,  ///< It took BendingSettings::max_steps steps.
  degenerate,  ///< It has no next direction: σ·T is not finite, or takes the direction to zero.
  side,        ///< It left the volume by a side face, and is left out; set by SideFaces alone.
};
constexpr int ray_end_count = 6;
const char* to_string(RayEnd end);

/// The number of rays of one channel that ended for each reason, indexed by RayEnd.
using EndCounts = std::array<std::uint64_t, ray_end_count>;

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
  bool wants_log_radiance_scale = false;       ///< Only without differentials.

  // Set by `trace`.
  std::vector<RayEnd> end;
  std::vector<double> length;        ///< Length of the path, world units.
  std::vector<std::uint32_t> steps;  ///< Number of steps in the field.
  /// If wanted: Λ = ∫ σ (tr T − 3 VᵀTV) dt along each ray, the divergence of Eq. 5 in phase space. Where photons keep
  /// their power, light of strength σ has L_end = L_start e^(−Λ). A ray that is traced backwards, from the viewer, has
  /// −σ, and the radiance that it finds is multiplied by e^(+Λ). A step of `splitting` has exactly the change
  /// hσ tr T − 3 ln |exp(hσT) V|. Rays are the same with and without it.
  std::vector<double> log_radiance_scale;
  std::uint64_t tensor_samples = 0;  ///< `trace` adds to it.

  std::size_t size() const { return position.size(); }
  void clear();
  void add(const Eigen::Vector3d& position, const Eigen::Vector3d& direction, double flexibility);
};

/// A point of a path.
struct PathPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< V; unit.
  double length = 0;                                    ///< Length of the path up to here, world units.
  bool in_field = false;  ///< Whether the path bends here (inside the volume and the cut).

  // Set by `set_tensors`; zero where light is straight.
  Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();  ///< T of the field here.
  Eigen::Vector3d change = Eigen::Vector3d::Zero();  ///< V' here, with σ·T. Its norm is the curvature of the path.

  Eigen::Vector3d force() const { return tensor * direction; }  ///< T V; its norm is Eq. 11.
};
using PathPoints = std::vector<PathPoint>;

/// A ray after a step in the field, as the kernel has it, in single precision: most points are not needed, and
/// converting them would take longer than tracing the ray. The kernel writes each four numbers as one vector.
struct alignas(16) StepPoint {
  float position[3];   ///< From the first voxel of a brick, in voxels.
  float length;        ///< Length of the path since the ray entered the field, world units.
  float direction[3];  ///< V; unit within rounding, world axes.
  float padding;
  std::int32_t brick[3];  ///< Coordinates of the brick, in bricks.
  std::int32_t more_padding;

  BrickPoint place() const { return {{brick[0], brick[1], brick[2]}, {position[0], position[1], position[2]}}; }
};

/// The step as a point of the path, without its tensor.
/// @param entry_length  Length of the path where the ray entered the field.
PathPoint path_point(const TensorField& field, const StepPoint& step, double entry_length);

/// Points of a ray, from the start to the end. In the field there is one point for each step, from the entry to the
/// exit. A straight piece that ends on a surface has a point at each end. Where the ray enters or leaves the field
/// there are two points, one of them in the field. Empty if the ray meets nothing.
struct RayRecord {
  PathPoints before;             ///< The first points. If there are steps, the last one is the entry into the field.
  std::vector<StepPoint> steps;  ///< The points after them: steps of packets.
  PathPoints behind;             ///< The last points.

  std::size_t size() const { return before.size() + steps.size() + behind.size(); }
};

/// Point i of the ray, without its tensor.
PathPoint path_point(const TensorField& field, const RayRecord& record, std::size_t i);

/// The side faces of a field's box for light of one direction: those through which straight light does not leave it.
class SideFaces {
 public:
  /// @param field      Must outlive it.
  /// @param direction  Of straight light; not zero.
  SideFaces(const TensorField& field, const Eigen::Vector3d& direction);

  /// Gives the end `side` to the rays of a traced batch that left the box through a side face, and then reached the
  /// plate or missed it. Rays that end in the box, or have never been in it, keep their ends. Any thread may call it.
  void mark(RayBatch& batch) const;

 private:
  bool left_through(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const;

  const TensorField& field_;
  std::array<bool, 6> is_side_{};  // The lower and the upper face of each axis of index space.
};

}  // namespace tensorray
