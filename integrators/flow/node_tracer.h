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
#include "integrators/flow/node_prediction.h"

namespace tensorray {

/// The place on the plane of `plate` of a point where light lands. That of a body's point is as the beam's source sees
/// it; parallel light needs no projection, since pixels are those of the point's projection along the plate's normal.
Eigen::Vector3d place_on(const Plate& plate, const Geometry& geometry, const Beam& beam, const Eigen::Vector3d& point);

/// A position whose light is to be traced.
struct NewPosition {
  Eigen::Vector3d origin;
  Parents parents;
};

/// Traces as few nodes as the smoothness of the landings allows, and predicts the others. Any number of threads may
/// use it at once.
class NodeTracer {
 public:
  /// @param geometry  With a plate in the plane of `plate`, maybe larger; `plate` defines pixels.
  NodeTracer(const TensorField& field, const Geometry& geometry, const Plate& plate, const Beam& beam,
             const BendingSettings& bending, const FlowSettings& settings);

  std::size_t nodes() const { return flexibilities_.size(); }

  /// The nodes at which there are lengths.
  const std::vector<std::size_t>& check_nodes() const { return check_nodes_; }

  std::size_t check_step() const { return check_nodes_.size() > 1 ? check_nodes_[1] : 1; }

  /// Sets landings, ends and lengths of the positions from `first` on, for which the map has room. Different positions
  /// may be traced at once; their parents must be traced already.
  void trace(FlowMap& map, std::size_t first, const std::vector<NewPosition>& positions);

  std::uint64_t rays() const { return rays_; }
  std::uint64_t ray_steps() const { return ray_steps_; }
  std::uint64_t tensor_samples() const { return tensor_samples_; }

 private:
  struct NodeRay {
    std::size_t position, node;
  };
  /// A position of which every `step`-th node is traced next.
  struct PartlyTraced {
    std::size_t position, step;
    NodePrediction prediction;
  };

  static void add_rays(const std::vector<PartlyTraced>& positions, bool is_first, std::vector<NodeRay>& rays);
  void trace_rays(FlowMap& map, std::size_t first, const std::vector<NewPosition>& positions,
                  const std::vector<NodeRay>& rays, std::vector<ExitFaces>& faces);
  void predict_lengths(FlowMap& map, std::size_t position, const Parents& parents) const;
  RayEnd end_of(const RayBatch& rays, std::size_t ray, const Eigen::Vector3d& origin) const;
  std::uint8_t exit_face(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const;

  const TensorField& field_;
  const Geometry& geometry_;
  const Plate plate_;
  const Beam& beam_;
  const BendingSettings& bending_;
  std::shared_ptr<RayMemory> memory_;  // Null: rays are not remembered.
  std::optional<Geometry> volume_;     // With `memory_`: the geometry without its plate.
  std::optional<Geometry> body_;       // The body alone, if it collects the light.
  double off_body_ = 0;                // Distance from its surface at which it is looked for.
  float tolerance_;                    // Of predicted landings, pixels.
  bool is_range_;
  std::vector<double> flexibilities_;  // One for each node.
  std::vector<std::size_t> check_nodes_;
  std::atomic<std::uint64_t> rays_{0}, ray_steps_{0}, tensor_samples_{0};
};

}  // namespace tensorray
