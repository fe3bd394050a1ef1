#pragma once
/// @file integrators/flow/flow_vertices.h
/// The vertices of a flow map, and where their light lands. A part of flow_map.cpp.

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "base/process/kept_results.h"
#include "base/process/team.h"
#include "integrators/flow/flow_lattice.h"
#include "integrators/flow/flow_map.h"
#include "integrators/flow/wavelength_tracer.h"

namespace tensorray {

/// Adds vertices at points of a lattice, and traces their light: on all threads, with the settings' team, and only
/// where it is not among the results that the settings keep. Not to be used by two threads at once.
class FlowVertices {
 public:
  /// @param settings  With a plate. All arguments must outlive it.
  FlowVertices(const TensorField& field, const Geometry& geometry, const Beam& beam, const BendingSettings& bending,
               const FlowSettings& settings, const Progress& progress);

  /// The index of the vertex at a point of the finest lattice, which is added if it is not there.
  std::uint32_t at(std::uint32_t patch, std::uint32_t x, std::uint32_t y, const Parents& parents = {});

  /// Traces the light of those that were added; their parents must have been traced before. @throw Cancelled; as
  /// Team::exchange.
  void trace_new();

  /// Keeps the landings of all, if the settings keep results.
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

  void trace_round(std::size_t end);
  void trace_tasks(std::size_t end, std::vector<std::uint8_t>& is_traced);
  void trace_vertices(std::size_t begin, std::size_t end);
  void exchange_landings(Team& team, std::size_t end);
  void copy_landings(std::size_t begin, std::size_t end, PartBytes& bytes);
  std::uint64_t hash_of_landings(std::size_t vertex) const;
  ResultKey key_of(std::size_t vertex) const;
  bool restore(std::size_t vertex);
  void add_kept(std::size_t begin, std::size_t end);

  const Beam& beam_;
  const FlowSettings& settings_;
  const Progress& progress_;
  WavelengthTracer tracer_;
  FlowMap map_;
  std::vector<Start> starts_;
  std::size_t traced_ = 0;        // Number of vertices that have landings.
  std::size_t added_ = 0;         // Number of those that were added to what is kept.
  const std::uint64_t map_hash_;  // Of what landings depend on, beside their vertex.
};

}  // namespace tensorray
