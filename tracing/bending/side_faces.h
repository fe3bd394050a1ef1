#pragma once
/// @file tracing/bending/side_faces.h
/// Light that leaves a volume beside its way: through the side faces of the volume's box.

#include <array>

#include <Eigen/Core>

#include "tracing/bending/bending.h"

namespace tensorray {

/// The side faces of a field's box for light of one direction: those whose outward normals are more across the light
/// than along it. Light may be so oblique that these are all faces. Then they are those through which straight light
/// does not leave the box.
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
