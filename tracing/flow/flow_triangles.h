#pragma once
/// @file tracing/flow/flow_triangles.h
/// Triangles of a flow map's quads. A part of flow_map.cpp.

#include <vector>

#include "renderer/lights/beam.h"
#include "tracing/flow/flow_lattice.h"
#include "tracing/flow/flow_map.h"

namespace tensorray {

/// Adds the triangles and edges of `quads` to `map`. The quads cover the lattice once; the map has the landings of
/// their corners. A quad becomes two triangles. If a neighbour is finer, it becomes as many as there are vertices on
/// its outline, about a new vertex in its middle, whose landings are the mean of the corners'.
void add_triangles(const FlowLattice& lattice, const std::vector<Quad>& quads, const Beam& beam, FlowMap& map);

}  // namespace tensorray
