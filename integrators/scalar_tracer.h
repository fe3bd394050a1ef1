#pragma once
/// @file integrators/scalar_tracer.h
/// One ray at a time in double precision: the reference for the packets of packet_kernel.h, and what they leave to it.
/// A part of bending.cpp and packet_tracer.cpp.

#include <cstdint>
#include <optional>

#include "integrators/bending.h"
#include "integrators/bending_steps.h"
#include "renderer/geometry.h"
#include "volumes/tensor_sampler.h"

namespace tensorray {

using bending_steps::Medium;
using bending_steps::State;

/// What is kept of a ray's way; null: nothing.
struct Recording {
  Way* way = nullptr;
  Track* track = nullptr;
};

/// One ray on its way, alone (N = 1) or with its derivatives along two parameters (N = 3). The volume is the field's
/// extent, a convex box, cut by a mesh of any shape.
template <int N>
class Tracer {
 public:
  Tracer(const TensorField& field, const Geometry& geometry, const BendingSettings& settings)
      : field_(field), geometry_(geometry), settings_(settings), sampler_(field) {}

  /// Follows a ray to its end; `state` says where that is, and `recording` how it came there.
  RayEnd trace(const State<N>& start, double flexibility, const Recording& recording);

  /// Follows a ray to where its way begins to bend, or (if it does not come there) to its end.
  std::optional<RayEnd> approach(const State<N>& start, const Recording& recording);

  /// Takes over a ray where its way bends: `first_step` long, world units, is its first step; 0: as long as any.
  RayEnd take_over(const State<N>& from, double flexibility, double length, std::uint32_t steps, double first_step);

  /// Takes over a ray on the face of the box where it leaves the volume.
  RayEnd take_over_leaving(const State<N>& from, double length, std::uint32_t steps);

  /// The Frobenius norm of the deviator of T here.
  double strength();

  const State<N>& state() const { return ray_; }
  double length() const { return length_; }
  const Eigen::RowVector2d& length_change() const { return length_change_; }
  std::uint32_t steps() const { return steps_; }
  std::uint64_t samples() const { return sampler_.samples(); }

 private:
  /// What light meets next; `none` while it travels freely.
  enum class Event { none, absorber, leaves_box, leaves_cut };

  RayEnd follow(double first_step);
  std::optional<RayEnd> reach_box();
  std::optional<RayEnd> cross_box();
  std::optional<RayEnd> bend(double first_step);
  RayEnd leave();
  RayEnd miss();

  Eigen::Vector3d position() const { return ray_.position(); }
  Eigen::Vector3d direction() const { return ray_.direction(); }
  RayEnd end_on(Surface surface) const { return surface == Surface::plate ? RayEnd::plate : RayEnd::obstacle; }
  State<N> step(double h, State<N>& error) { return advance(settings_.method, medium_, ray_, h, error); }
  double length_of_voxel() const { return 1 / (field_.to_index().linear() * direction()).norm(); }
  double automatic_step() const;
  double next_step() const;
  double control_step(const State<N>& error);
  void record(bool in_field);
  void go_straight(const Hit& hit);
  bool ends_before(double distance) const { return length_ + distance >= settings_.max_length; }
  void meet_surface(const Eigen::Vector3d& normal, bool bends);
  Event meet(const State<N>& next, Hit& hit) const;
  double land(const State<N>& next, double h, const Hit& hit);

  const TensorField& field_;
  const Geometry& geometry_;
  const BendingSettings& settings_;
  TensorSampler sampler_;

  Medium<N> medium_{sampler_, 0};
  State<N> ray_;
  Recording recording_;
  double length_ = 0;                 // Of the way so far, world units.
  Eigen::RowVector2d length_change_;  // Its derivatives.
  double voxel_ = 0;                  // Length of a voxel along the ray, world units.
  double adaptive_step_ = 0;          // What the error control asks for next, in voxels.
  std::uint32_t steps_ = 0;
};

}  // namespace tensorray
