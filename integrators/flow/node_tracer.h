#pragma once
/// @file integrators/flow/node_tracer.h
/// Landings of one position's light at all nodes of a range of flexibilities. A part of flow_map.cpp.

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "integrators/flow/flow_map.h"

namespace tensorray {

/// The place on the plane of `plate` of a point where light lands. That of a body's point is as the beam's source sees
/// it; parallel light needs no projection, since pixels are those of the point's projection along the plate's normal.
Eigen::Vector3d place_on(const Plate& plate, const Geometry& geometry, const Beam& beam, const Eigen::Vector3d& point);

/// Traces as few nodes as the smoothness of the landings allows, and interpolates the others. Any number of threads may
/// use it at once.
class NodeTracer {
 public:
  /// @param geometry  With a plate in the plane of `plate`, maybe larger; `plate` defines pixels.
  NodeTracer(const TensorField& field, const Geometry& geometry, const Plate& plate, const Beam& beam,
             const BendingSettings& bending, const FlowSettings& settings);

  std::size_t nodes() const { return flexibilities_.size(); }

  /// The nodes that are traced for every position.
  const std::vector<std::size_t>& check_nodes() const { return check_nodes_; }

  std::size_t check_step() const { return check_nodes_.size() > 1 ? check_nodes_[1] : 1; }

  /// Writes origins.size() · nodes() landings (pixel coordinates) and ends, and the lengths of the ways at the check
  /// nodes.
  void trace(const std::vector<Eigen::Vector3d>& origins, Eigen::Vector2f* landings, RayEnd* ends, float* lengths);

  std::uint64_t rays() const { return rays_; }
  std::uint64_t ray_steps() const { return ray_steps_; }
  std::uint64_t tensor_samples() const { return tensor_samples_; }

 private:
  void trace_nodes(const std::vector<Eigen::Vector3d>& origins, const std::vector<std::size_t>& which,
                   std::size_t first, std::size_t step, Eigen::Vector2f* landings, RayEnd* ends, float* lengths);
  RayEnd end_of(const RayBatch& rays, std::size_t ray, const Eigen::Vector3d& origin) const;

  const TensorField& field_;
  const Geometry& geometry_;
  const Plate plate_;
  const Beam& beam_;
  const BendingSettings& bending_;
  std::shared_ptr<RayMemory> memory_;  // Null: rays are not remembered.
  std::optional<Geometry> volume_;     // With `memory_`: the geometry without its plate.
  std::optional<Geometry> body_;       // The body alone, if it collects the light.
  double off_body_ = 0;                // Distance from its surface at which it is looked for.
  double tolerance_;
  bool is_range_;
  std::vector<double> flexibilities_;  // One for each node.
  std::vector<std::size_t> check_nodes_;
  std::atomic<std::uint64_t> rays_{0}, ray_steps_{0}, tensor_samples_{0};
};

}  // namespace tensorray
