#pragma once
/// Colours for the values along a path, and the surfaces of paths: tubes, wires, ellipses or lines.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "integrators/path_tracing/path_tracing_method.h"
#include "renderer/charts/color_bar.h"
#include "renderer/charts/colormap.h"
#include "renderer/images/image.h"
#include "renderer/surfaces/surface.h"
#include "renderer/surfaces/tube_mesh.h"
#include "scenes/scene/scene.h"
#include "tracing/paths/paths.h"

namespace tensorray {

/// Draws a legend of colours over a picture. `from_rec709`: to the picture's colours.
using SurfaceLegend = std::function<void(Image&, const Eigen::Matrix3d& from_rec709, const LegendPlace& place)>;

/// That of a bar. @param color  At a position from 0 to 1, linear Rec. 709.
SurfaceLegend bar_legend(const std::string& title, const ValueRange& range,
                         const std::function<Eigen::Vector3d(double)>& color);

/// Its name and unit, as the title of a legend.
std::string invariant_title(Invariant which, const FieldUnits& units);

/// How the points of paths are coloured.
struct PathColors {
  /// The colour of each point of each path, linear Rec. 709, 0 to 1. Empty: paths have the colour of their material.
  std::vector<std::vector<Eigen::Vector3d>> of_points;
  SurfaceLegend legend;  ///< May be empty.
};

/// Chooses the range of values if the description does not give it. If colours are those of wavelengths, paths that lie
/// in one another have the mean of their colours: light is white, or whatever its wavelengths give, until they part.
/// @param paths   Those of one seed stand beside each other, by wavelength.
/// @param radius  Paths nearer to each other than this lie in one another, world units.
PathColors path_colors(const PathColorDescription& description, const std::vector<Path>& paths, double radius,
                       const FieldUnits& units);

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
