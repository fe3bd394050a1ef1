#pragma once
/// @file integrators/lens/lens_mesh.h
/// A mesh of neighbouring rays' landings, which may fold over itself.

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "base/progress.h"
#include "integrators/lens/lens_map.h"
#include "renderer/surfaces/planar_mesh.h"

namespace tensorray {

struct LensMesh {
  std::vector<Eigen::Vector2d> starts;  ///< In the plane where rays start.
  std::vector<LensLanding> landings;    ///< One for each start.
  PlanarMesh mesh;                      ///< Vertices are the landings' `at`; triangles are those whose rays all landed
                                        ///< and between whose rays the map is not torn.
};

/// One of the sheets of a mesh that cover a point.
struct Sheet {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();     ///< Interpolated, as the others.
  Eigen::Matrix2d jacobian = Eigen::Matrix2d::Zero();  ///< Of the landing by the start.
  double length = 0;
};

/// How fine a mesh becomes.
struct LensMeshSettings {
  Eigen::AlignedBox2d starts{Eigen::Vector2d(-0.5, -0.5), Eigen::Vector2d(0.5, 0.5)};  ///< In their plane.
  Eigen::Vector2d target{1, 1};  ///< Of the rectangle about the other plane's centre in which accuracy matters.
  Eigen::Vector2d pixel{1, 1};   ///< Size of a pixel there, world units: pixels need not be square.

  /// Takes directions in the plane of starts to those in the other plane that straight light has: a rotation.
  Eigen::Matrix2d turn = Eigen::Matrix2d::Identity();
};

/// Told the part that is done, from 0 to 1, by the thread that called the long work.
using MeshReport = std::function<void(double part)>;

/// Triangulates the landings of a rectangle of starts: first a regular one, 4 pixels a cell (at most 4096 cells along
/// either side, and 4 for each 16 pixels); then, within `target`, edges are halved where the landing between their ends
/// would lie more than a tenth of a pixel beside the straight line (by the Jacobians of both ends), and where one end
/// landed and the other did not. That ends where edges are shorter than 1/4 pixel, in the starts and, by the Jacobians,
/// in the landings, or than 1/16 pixel in the starts, or when there are some 4 starts for each pixel. All of these
/// lengths are counted in pixels along each side of a pixel; those of the starts as straight light takes them to the
/// landings. An edge halved is halved for both of its triangles, so that there are no cracks. Edges that are torn (the
/// landings are apart by a pixel more than the Jacobians explain: the volume's silhouette, an obstacle's shadow) have
/// no triangles. The result does not depend on the number of threads.
/// @param report  May be empty. Of `progress` only `cancelled` is looked at.
/// @throw Cancelled
LensMesh make_lens_mesh(const LensMap& map, double flexibility, const LensMeshSettings& settings, TraceCounts& counts,
                        const Progress& progress, const MeshReport& report = {});

/// Triangulates landings that are there: starts on a lattice of `columns` × `rows`, row by row.
LensMesh lattice_mesh(std::vector<Eigen::Vector2d> starts, std::vector<LensLanding> landings, int columns, int rows,
                      double pixel);

/// Finds sheets. Immutable; any number of threads may query it at once. The mesh must outlive it.
class SheetSearch {
 public:
  /// @param pixel  Of the plane of starts, world units: sheets whose starts are closer than a thousandth are one.
  SheetSearch(const LensMesh& mesh, double pixel) : mesh_(mesh), pixel_(pixel), search_(mesh.mesh) {}

  /// All sheets that cover `point`; a point on an edge is on one sheet.
  void find(const Eigen::Vector2d& point, std::vector<Sheet>& sheets) const;

 private:
  const LensMesh& mesh_;
  double pixel_;
  PlanarMeshSearch search_;
};

}  // namespace tensorray
