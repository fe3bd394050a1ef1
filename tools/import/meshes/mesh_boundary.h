#pragma once
/// @file tools/import/meshes/mesh_boundary.h
/// The surface of the body around which a mesh lies.

#include <cstddef>
#include <filesystem>

class vtkDataSet;

namespace tensorray {

/// Writes the surface of the body around which the mesh lies: of its outer faces, those that have points of the mesh in
/// front of them, by more than a thousandth of its diagonal (a convex outer boundary has none; a hole's wall has),
/// oriented out of the body, which is into the mesh's cells. Binary PLY of triangles (little-endian, double) with
/// shared vertices. For a mesh that holds a whole hole the surface is closed. Points at equal positions count as one,
/// so that the seam of a grid that is wrapped around a body is no face; hidden cells are part of the body.
/// @return how many triangles; 0 (and no file) if there are none.
/// @throw std::invalid_argument if the mesh has no three-dimensional cells; std::runtime_error naming the file.
std::size_t write_boundary(vtkDataSet& mesh, const std::filesystem::path& path);

}  // namespace tensorray
