#pragma once
/// The surface of the body inside a mesh.

#include <filesystem>

class vtkDataSet;

namespace tensorray {

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
