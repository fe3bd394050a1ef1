#pragma once
/// @file integrators/flow/node_prediction.h
/// Landings of a position at the nodes of a range that are not traced: they follow from those that are, and from the
/// positions between which it lies. A part of node_tracer.cpp.

#include <array>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "integrators/flow/flow_map.h"

namespace tensorray {

constexpr std::size_t range_nodes = 33;

/// The face of the volume through which light leaves it, at each node.
using ExitFaces = std::array<std::uint8_t, range_nodes>;

/// The positions in whose middle a new one lies, all of them traced: the ends of a side, or the corners of a square.
struct Parents {
  std::array<std::uint32_t, 4> positions{};
  std::size_t count = 0;  ///< 0, 2 or 4.
};

/// The landings of a position at all nodes, of which every `step`-th is traced; step: 16, 8, 4, 2 or 1.
///
/// A polynomial through the nearest known nodes (a parabola through three, else a cubic through four) predicts the
/// others. Where all light of the parents lands, the mean of what this would have missed of theirs is added: then only
/// what differs from position to position is left as an error. Each quarter of the range is predicted on its own, as
/// soon as it can be: a kink needs all nodes only about its place.
class NodePrediction {
 public:
  /// @param plate  Width and height of the plate, pixels.
  NodePrediction(FlowMap& map, std::size_t position, const Parents& parents, const Eigen::Array2f& plate);

  /// Whether the parents differ so little in what the polynomials miss that the mean is good to within `tolerance`,
  /// pixels.
  bool parents_agree(std::size_t step, float tolerance) const;

  /// Sets the nodes that are not traced in each quarter where they can be predicted to within `tolerance`, pixels,
  /// wherever light may fall on the plate: no traced node of the quarter may be farther from what every second one
  /// predicts, and none beside it, of the same face, four times as far. Where landings are smooth, untraced nodes are
  /// then nearer by far. They are not smooth where light of the nodes leaves the volume through different faces.
  /// @param faces  Of the nodes that are known; sets those of the others.
  /// @return Whether all nodes are known.
  bool predict(std::size_t step, float tolerance, ExitFaces& faces);

  /// Whether a node is in a quarter that is not predicted yet.
  bool is_open(std::size_t node) const;

 private:
  bool landed(std::size_t node) const { return ends_[node] == RayEnd::plate; }
  bool is_on_plate(std::size_t node) const;
  bool matters(std::size_t node, std::size_t step) const;
  bool is_smooth(std::size_t quarter, std::size_t step, float tolerance, const ExitFaces& faces) const;
  bool parents_agree(std::size_t quarter, std::size_t step, float tolerance) const;
  bool is_smooth_beside_parents(std::size_t quarter, std::size_t step, float tolerance) const;
  Eigen::Vector2f between(std::size_t node, std::size_t step) const;
  void set(std::size_t quarter, std::size_t step, bool beside_parents, ExitFaces& faces);

  Eigen::Vector2f* landings_;
  RayEnd* ends_;
  std::array<const Eigen::Vector2f*, 4> parents_{};
  std::size_t parent_count_ = 0;                   // 0 if some of their light does not land.
  std::array<Eigen::Vector2f, range_nodes> mean_;  // Of the parents' landings, if their light lands.
  Eigen::Array2f plate_;
  std::array<bool, 4> is_predicted_{};  // By quarter.
};

}  // namespace tensorray
