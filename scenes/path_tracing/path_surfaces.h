#pragma once
/// @file scenes/path_tracing/path_surfaces.h
/// Paths as surfaces: tubes, wires, ellipses or lines.

#include <filesystem>
#include <vector>

#include "integrators/paths/paths.h"
#include "renderer/surfaces/surface.h"
#include "renderer/surfaces/tube_mesh.h"
#include "scenes/path_tracing/path_colors.h"
#include "scenes/path_tracing/path_tracing_description.h"

namespace tensorray {

/// The radius that is typical of the drawn paths, world units: where the scene does not say it, such that so many
/// parallel paths through the volume would not touch.
double typical_radius(const RadiusDescription& radius, std::size_t paths, const Eigen::AlignedBox3d& volume);

/// The paths' tubes, of any style but lines. `TubePoint::value` is the number of the path's point. Paths along which
/// there is no tensor are round, of the typical radius.
/// @param tolerance  How far triangles may be off the tube, world units.
TubeMesh path_mesh(const std::vector<Path>& paths, const PathTracingDescription& description, const PathColors& colors,
                   double typical, double tolerance);

/// The surface of that mesh, with colours and what else is known along paths.
/// @param to_working  From linear Rec. 709.
ShadedSurface path_surface(TubeMesh mesh, const std::vector<Path>& paths, const PathColors& colors,
                           const Eigen::Matrix3d& to_working);

/// Paths as round curves of one radius.
ShadedSurface line_surface(const std::vector<Path>& paths, double radius, const PathColors& colors,
                           const Eigen::Matrix3d& to_working);

/// Writes the tubes with their colours (.ply, .obj). @throw std::runtime_error naming the file.
void write_tubes(const std::filesystem::path& path, const TubeMesh& mesh, const std::vector<Path>& paths,
                 const PathColors& colors);

}  // namespace tensorray
