#pragma once
/// @file integrators/flow/flow_triangles.h
/// Triangles of a flow map's squares. A part of flow_map.cpp.

#include <vector>

#include "integrators/flow/flow_lattice.h"
#include "integrators/flow/flow_map.h"
#include "renderer/lights/beam.h"

namespace tensorray {

/// Adds the triangles and edges of `squares`, which cover the lattice once, to `map`, which has the landings of their
/// corners: two triangles a square; where a neighbour is finer, as many as there are positions about the square, and a
/// position in its middle whose landings are the mean of the corners'.
void add_triangles(const FlowLattice& lattice, const std::vector<Square>& squares, const Beam& beam, FlowMap& map);

}  // namespace tensorray
