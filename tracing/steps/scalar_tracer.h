#pragma once
/// @file tracing/steps/scalar_tracer.h
/// Traces one ray at a time in double precision, by any method and in any field. This is the reference for the packets
/// of packet_kernel.h, and it does what packets leave to it. A step is taken in `Tracer::bend`.

#include <cstdint>
#include <optional>
#include <vector>

#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"
#include "tracing/bending/ray_record.h"
#include "tracing/steps/bending_steps.h"
#include "tracing/steps/composition.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {

using bending_steps::RayMedium;
using bending_steps::State;

/// How far a ray has been traced.
struct Travelled {
  double length = 0;  // Length of the path so far, world units.
  Eigen::RowVector2d length_change = Eigen::RowVector2d::Zero();
  std::uint32_t steps = 0;
};

/// Traces one ray, alone (N = 1) or with its derivatives along two parameters (N = 3). The volume is the field's
/// extent, a convex box, cut by a mesh of any shape.
template <int N>
class Tracer {
 public:
  Tracer(const TensorField& field, const Geometry& geometry, const BendingSettings& settings)
      : field_(field), geometry_(geometry), settings_(settings), sampler_(field) {}

  /// Follows a ray to its end. Afterwards `state` is the end of the ray.
  /// @param strength  σ of the ray: see `strength_of`.
  /// @param record    The points on its path are added to it; null: the ray is not recorded.
  RayEnd trace(const State<N>& start, double strength, PathPoints* record);

  /// Follows a ray to the point where it begins to bend. Returns nothing there; if the ray ends first, returns why.
  std::optional<RayEnd> approach(const State<N>& start, PathPoints* record);

  /// Continues a ray at `state`. Call `follow` next if it bends there, or `leave` if it is on the face of the box.
  void take_over(const State<N>& state, double strength, const Travelled& travelled, PathPoints* record);

  /// Follows the ray from a point in the field to its end. `first_step` is the length of the first step, world units;
  /// 0: as any other step. `first_end` is where this step of `splitting4` would end, in single precision; null: not
  /// known. Where it tells what the step meets, only the part of the step up to there is taken.
  RayEnd follow(double first_step = 0, const State<N>* first_end = nullptr);

  /// Follows the ray from a face of the volume, through free space, to its end.
  RayEnd leave();

  /// Records the current point, if the ray is recorded.
  void record(bool in_field);

  /// The Frobenius norm of the deviator of T at the current point.
  double deviator_here();

  const State<N>& state() const { return ray_; }
  Travelled travelled() const { return {length_, length_change_, steps_}; }
  std::uint64_t samples() const { return sampler_.samples(); }

 private:
  /// What a step meets; `none`: nothing.
  enum class Event { none, absorber, leaves_box, leaves_cut };

  /// Where a step meets something: the distance of its plane from the beginning of the step, along its normal, and the
  /// length of the step up to there, approximately.
  struct Landing {
    Hit hit;
    double to_plane = 0, length = 0;
  };

  std::optional<RayEnd> reach(const std::optional<Hit>& entry);
  std::optional<RayEnd> reach_box();
  std::optional<RayEnd> cross_box();
  std::optional<RayEnd> bend(double first_step, const State<N>* first_end);
  RayEnd miss();

  Eigen::Vector3d position() const { return ray_.position(); }
  Eigen::Vector3d direction() const { return ray_.direction(); }
  RayEnd end_on(Surface surface) const { return surface == Surface::plate ? RayEnd::plate : RayEnd::obstacle; }
  State<N> step(double h, State<N>& error) { return advance(settings_.method, medium_, ray_, h, error); }
  double length_of_voxel() const { return 1 / (field_.to_index().linear() * direction()).norm(); }
  double automatic_step() const;
  double next_step();
  double control_step(const State<N>& error);
  void go_straight(const Hit& hit);
  bool ends_before(double distance) const { return length_ + distance >= settings_.max_length; }
  void meet_surface(const Eigen::Vector3d& normal, bool bends);
  bool is_composed() const { return settings_.method == BendingMethod::splitting4; }
  Eigen::Vector3d between(const State<N>& next, double h, const PathWeights& weights) const;
  void aim_along_path(const State<N>& next, double h, Landing& landing) const;
  void record_inner(const State<N>& next, double h);
  Event meet(const Eigen::Vector3d& from, const Eigen::Vector3d& to, Hit& hit) const;
  Event meet(const State<N>& next, double h, Landing& landing) const;
  double land(double h, const Landing& landing);

  const TensorField& field_;
  const Geometry& geometry_;
  const BendingSettings& settings_;
  const bool is_controlled_ = is_adaptive(settings_.method, settings_.step);
  TensorSampler sampler_;

  RayMedium<N> medium_{sampler_, 0};
  State<N> ray_;
  PathPoints* record_ = nullptr;      // Null: the ray is not recorded.
  double length_ = 0;                 // Length of the path so far, world units.
  Eigen::RowVector2d length_change_;  // Derivatives of length_.
  double voxel_ = 0;                  // Length of a voxel along the ray, world units.
  double adaptive_step_ = 0;          // The next step by the error control, in voxels.
  std::uint32_t steps_ = 0;
};

/// σ = s · scale of ray i of a batch. Only this function uses the field's scale.
inline double strength_of(const RayBatch& batch, std::size_t i, const BendingSettings& settings) {
  return batch.flexibility[i] * settings.scale;
}

/// The start of a ray of a batch; N = 3 if the batch has differentials.
template <int N>
State<N> start_of(const RayBatch& batch, std::size_t i) {
  State<N> start;
  start.P.col(0) = batch.position[i];
  start.V.col(0) = batch.direction[i];
  if constexpr (N == 3) {
    start.P.template rightCols<2>() = batch.differentials[i].position;
    start.V.template rightCols<2>() = batch.differentials[i].direction;
  }
  return start;
}

/// Writes the end of the tracer's ray to the batch.
template <int N>
void set_end(RayBatch& batch, std::size_t i, RayEnd end, const Tracer<N>& tracer) {
  const Travelled travelled = tracer.travelled();
  batch.end[i] = end;
  batch.position[i] = tracer.state().position();
  batch.direction[i] = tracer.state().direction();
  if constexpr (N == 3)
    batch.differentials[i] = {tracer.state().P.template rightCols<2>(), tracer.state().V.template rightCols<2>(),
                              travelled.length_change};
  if (batch.wants_log_radiance_scale) batch.log_radiance_scale[i] = tracer.state().log_radiance_scale;
  batch.length[i] = travelled.length;
  batch.steps[i] = travelled.steps;
}

}  // namespace tensorray
