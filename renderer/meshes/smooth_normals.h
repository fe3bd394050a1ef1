#pragma once
/// @file renderer/meshes/smooth_normals.h
/// Normals that let flat triangles look smooth.

#include "renderer/meshes/mesh_with_normals.h"

namespace tensorray {

/// At each corner of a triangle, the mean normal of the triangles that share the vertex and are turned against this one
/// by at most `angle` radians, weighted by their angles at the vertex (Thürmer and Wüthrich 1998), so that it does not
/// depend on how polygons were divided. The other edges stay sharp.
/// @param mesh  Vertices at equal positions are joined; no triangle has zero area.
MeshWithNormals with_smooth_normals(const TriangleMesh& mesh, double angle);

}  // namespace tensorray
