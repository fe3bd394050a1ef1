#pragma once
/// @file integrators/bending/scalar_tracer.h
/// One ray at a time in double precision: the reference for the packets of packet_kernel.h, and what they leave to it.
/// A part of bending.cpp and packet_tracer.cpp.

#include <cstdint>
#include <optional>
#include <vector>

#include "integrators/bending/bending.h"
#include "integrators/bending/bending_steps.h"
#include "renderer/surfaces/geometry.h"
#include "volumes/bricks/tensor_sampler.h"

namespace tensorray {

using bending_steps::RayMedium;
using bending_steps::State;

/// What is kept of a ray; null: nothing.
struct Recording {
  PathPoints* path = nullptr;
  Track* track = nullptr;
};

/// What is kept of a batch.
struct Recordings {
  std::vector<PathPoints>* paths = nullptr;
  std::vector<Track>* tracks = nullptr;

  Recording of(std::size_t ray) const { return {paths ? &(*paths)[ray] : nullptr, tracks ? &(*tracks)[ray] : nullptr}; }
  explicit operator bool() const { return paths || tracks; }
};

/// How far a ray has come.
struct Travelled {
  double length = 0;  // World units.
  Eigen::RowVector2d length_change = Eigen::RowVector2d::Zero();
  std::uint32_t steps = 0;
};

/// One ray on its way, alone (N = 1) or with its derivatives along two parameters (N = 3). The volume is the field's
/// extent, a convex box, cut by a mesh of any shape.
template <int N>
class Tracer {
 public:
  Tracer(const TensorField& field, const Geometry& geometry, const BendingSettings& settings)
      : field_(field), geometry_(geometry), settings_(settings), sampler_(field) {}

  /// Follows a ray to its end; `state` says where that is, and `recording` how it came there.
  /// @param strength  σ of the ray: see `strength_of`.
  RayEnd trace(const State<N>& start, double strength, const Recording& recording);

  /// Follows a ray to where its way begins to bend, or (if it does not come there) to its end.
  std::optional<RayEnd> approach(const State<N>& start, const Recording& recording);

  /// Takes a ray over that has come to `state`: to be followed where it bends, or, on the face of the box, to leave.
  void take_over(const State<N>& state, double strength, const Travelled& travelled, const Recording& recording);

  /// From where its way bends to its end; `first_step` long, world units, is its first step; 0: as long as any.
  RayEnd follow(double first_step = 0);

  /// In free space behind the volume, to its end.
  RayEnd leave();

  /// Keeps the point where the ray is, if it is recorded.
  void record(bool in_field);

  /// The Frobenius norm of the deviator of T here.
  double deviator_here();

  const State<N>& state() const { return ray_; }
  Travelled travelled() const { return {length_, length_change_, steps_}; }
  std::uint64_t samples() const { return sampler_.samples(); }

 private:
  /// What light meets next; `none` while it travels freely.
  enum class Event { none, absorber, leaves_box, leaves_cut };

  std::optional<RayEnd> reach(const std::optional<Hit>& entry);
  std::optional<RayEnd> reach_box();
  std::optional<RayEnd> cross_box();
  std::optional<RayEnd> bend(double first_step);
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
  Event meet(const State<N>& next, Hit& hit) const;
  double land(const State<N>& next, double h, const Hit& hit);

  const TensorField& field_;
  const Geometry& geometry_;
  const BendingSettings& settings_;
  TensorSampler sampler_;

  RayMedium<N> medium_{sampler_, 0};
  State<N> ray_;
  Recording recording_;
  double length_ = 0;                 // Of the way so far, world units.
  Eigen::RowVector2d length_change_;  // Its derivatives.
  double voxel_ = 0;                  // Length of a voxel along the ray, world units.
  double adaptive_step_ = 0;          // What the error control asks for next, in voxels.
  std::uint32_t steps_ = 0;
};

/// σ = s · scale: what ray i of a batch is bent by. Only here does the field's scale come in.
inline double strength_of(const RayBatch& batch, std::size_t i, const BendingSettings& settings) {
  return batch.flexibility[i] * settings.scale;
}

/// A ray of a batch as it starts; N = 3 if the batch has differentials.
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

/// Writes where the tracer's ray has come to.
template <int N>
void set_end(RayBatch& batch, std::size_t i, RayEnd end, const Tracer<N>& tracer) {
  const Travelled travelled = tracer.travelled();
  batch.end[i] = end;
  batch.position[i] = tracer.state().position();
  batch.direction[i] = tracer.state().direction();
  if constexpr (N == 3)
    batch.differentials[i] = {tracer.state().P.template rightCols<2>(), tracer.state().V.template rightCols<2>(),
                              travelled.length_change};
  batch.length[i] = travelled.length;
  batch.steps[i] = travelled.steps;
}

}  // namespace tensorray
