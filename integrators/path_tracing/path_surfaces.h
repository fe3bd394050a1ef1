#pragma once
/// @file integrators/path_tracing/path_surfaces.h
/// Makes surfaces from paths: tubes, wires, ellipses or lines.

#include <filesystem>
#include <vector>

#include "integrators/path_tracing/path_colors.h"
#include "integrators/path_tracing/path_tracing_method.h"
#include "renderer/surfaces/surface.h"
#include "renderer/surfaces/tube_mesh.h"
#include "tracing/paths/paths.h"

namespace tensorray {

/// The typical radius of the drawn paths, world units. If the scene does not give it, it is small enough that this
/// number of parallel paths through the volume would not touch.
/// @param paths  Number of paths.
double typical_radius(const RadiusDescription& radius, std::size_t paths, const Eigen::AlignedBox3d& volume);

/// The tubes of the paths, for all styles except lines. `TubePoint::value` is the number of the path's point. Paths
/// whose tensors are all zero become round tubes of the typical radius.
/// @param tolerance  Greatest distance of triangles from the tube, world units.
TubeMesh path_mesh(const std::vector<Path>& paths, const PathTracingDescription& description, const PathColors& colors,
                   double typical, double tolerance);

/// The surface of the mesh, with colours, forces and arc lengths at its vertices.
/// @param to_working  Matrix from linear Rec. 709.
ShadedSurface path_surface(TubeMesh mesh, const std::vector<Path>& paths, const PathColors& colors,
                           const Eigen::Matrix3d& to_working);

/// The paths as round curves of one radius, world units.
ShadedSurface line_surface(const std::vector<Path>& paths, double radius, const PathColors& colors,
                           const Eigen::Matrix3d& to_working);

/// Writes the tubes with their colours (.ply, .obj). @throw std::runtime_error naming the file.
void write_tubes(const std::filesystem::path& path, const TubeMesh& mesh, const std::vector<Path>& paths,
                 const PathColors& colors);

}  // namespace tensorray
