#pragma once
/// Triangles of the faces of cells, flat and curved.

#include <vector>

#include "base/geometry/triangle_mesh.h"
#include "tools/import/meshes/mesh_faces.h"

namespace tensorray {

/// Triangles that look out of the cells, and for each one the number of its face.
struct FaceTriangles {
  TriangleMesh mesh;
  std::vector<std::size_t> face_of;  ///< Different numbers for different faces, ascending.
};

/// Triangles are so small that their edges are no farther than about `tolerance` (> 0) from faces that are curved or
/// whose corners are in no plane. Faces that have an edge in common have the same vertices there.
FaceTriangles triangles_of(vtkDataSet& mesh, const MeshPoints& points, std::vector<CellFace> faces, double tolerance);

}  // namespace tensorray
