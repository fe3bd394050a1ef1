#pragma once
/// The surfaces of the body that a mesh is, and of the one that it surrounds.

#include <filesystem>

#include "base/geometry/triangle_mesh.h"
#include "tools/import/meshes/mesh_faces.h"

namespace tensorray {

struct BodySurface {
  /// Closed: each edge of a triangle has its opposite in another one. Oriented outwards. A point is in the body where a
  /// ray from it leaves the surface more often than it enters: where meshes do not match, shells touch or overlap.
  TriangleMesh mesh;
  /// Faces with other cells on their other side: those that have been removed, as only their diagonals differ
  /// (mesh_faces.h), and those that are left.
  std::size_t inner_faces = 0;
  double area = 0;             ///< Without inner faces; 0: not known.
  std::size_t open_edges = 0;  ///< Of polyhedra whose faces do not close.
};

/// The faces on the outside, which are most of the work of a surface.
struct BodyFaces {
  MeshPoints points;
  std::vector<CellFace> faces;
  std::size_t inner = 0;  ///< Those that have been removed.
};

/// The outside of all three-dimensional cells that carry data, with its holes: those that MeshCell loads, whose tensors
/// (with_tensors; if there are any) are finite at the cell and at all its points; as triangles_of with this tolerance.
/// Uses all threads; the result does not depend on their number.
BodyFaces body_faces(vtkDataSet& mesh);
BodySurface body_surface(vtkDataSet& mesh, const BodyFaces& faces, double tolerance);

/// Writes the surface of the body that the mesh surrounds. A face of the mesh's outside belongs to it if points of
/// the mesh lie in front of the face by more than a thousandth of the mesh's diagonal: no face of a convex outer
/// boundary has such points, but the wall of a hole has. Triangles are oriented out of the body, into the mesh's
/// cells, and approximate curved faces to 1e-4 of the diagonal. The format is binary PLY (little-endian, double) of
/// triangles with shared vertices. The surface is closed if the mesh contains the whole hole. Points at equal positions
/// count as one, so that the seam of a grid that is wrapped around a body is not a face. Hidden cells belong to the
/// body.
/// @return the number of triangles; if 0, no file is written.
/// @throw std::invalid_argument if the mesh has no three-dimensional cells; std::runtime_error naming the file.
std::size_t write_boundary(vtkDataSet& mesh, const std::filesystem::path& path);

}  // namespace tensorray
