#pragma once
/// @file tracing/flow/flow_vertices.h
/// The vertices of a flow map, and where their light lands.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "base/process/job.h"
#include "tracing/flow/flow_lattice.h"
#include "tracing/flow/flow_map.h"
#include "tracing/flow/wavelength_tracer.h"

namespace tensorray {

/// What the landings of a vertex depend on, beside the map's settings: where its light starts, and a hash of the
/// landings of its parents.
using VertexKey = std::array<std::uint64_t, 3>;

/// Adds vertices at points of a lattice, and traces their light: on all threads, with the ranks of the settings' job,
/// and only where it is not among the landings that the job keeps. Not to be used by two threads at once.
class FlowVertices {
 public:
  /// @param settings  With a plate. All arguments must outlive it.
  FlowVertices(const TensorField& field, const Geometry& geometry, const Beam& beam, const BendingSettings& bending,
               const FlowSettings& settings, const Progress& progress);

  /// The index of the vertex at a point of the finest lattice, which is added if it is not there.
  std::uint32_t at(std::uint32_t patch, std::uint32_t x, std::uint32_t y, const Parents& parents = {});

  /// Traces the light of those that were added; their parents must have been traced before. @throw Cancelled; as
  /// Ranks::all_gather; DamagedArchive.
  void trace_new();

  /// Keeps the landings of all, if the map is kept, and is that of a shard or took long.
  void keep();

  /// The wavelength samples at which there are lengths.
  const std::vector<std::size_t>& check_samples() const { return tracer_.check_samples(); }

  const FlowMap& map() const { return map_; }  ///< Without triangles and edges.

  /// The map, with the numbers of rays.
  FlowMap take();

  FlowLattice lattice;

 private:
  /// Where light of a vertex starts.
  struct Start {
    Eigen::Vector2d origin;  // Of its rays, in the beam's frame.
    Parents parents;
  };

  struct KeyHash {
    std::size_t operator()(const VertexKey& key) const;
  };

  void trace_vertices(std::size_t begin, std::size_t end);
  void copy_landings(std::size_t begin, std::size_t end, Archive& archive);
  std::size_t landing_bytes() const;
  std::uint64_t hash_of_landings(std::size_t vertex) const;
  VertexKey key_of(std::size_t vertex) const;
  std::string name_of(std::size_t part) const;
  void find_kept();
  bool restore(std::size_t vertex);

  const Beam& beam_;
  const FlowSettings& settings_;
  const Progress& progress_;
  WavelengthTracer tracer_;
  FlowMap map_;
  std::vector<Start> starts_;
  std::size_t traced_ = 0;                                         // Number of vertices that have landings.
  std::vector<Result> found_;                                      // What the job has kept of this map.
  std::unordered_map<VertexKey, std::string_view, KeyHash> kept_;  // Landings in it.
};

}  // namespace tensorray
