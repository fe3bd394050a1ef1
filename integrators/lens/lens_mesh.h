#pragma once
/// @file integrators/lens/lens_mesh.h
/// A mesh of the landings of neighbouring rays, which may fold over itself.

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "base/progress.h"
#include "integrators/lens/lens_map.h"
#include "renderer/surfaces/planar_mesh.h"

namespace tensorray {

struct LensMesh {
  std::vector<Eigen::Vector2d> starts;  ///< Positions in the plane where rays start.
  std::vector<LensLanding> landings;    ///< One landing for each start.
  PlanarMesh mesh;  ///< Vertices are the landings' `at`. Triangles are those whose three rays landed and whose edges
                    ///< are not torn.
};

/// One of the sheets of a mesh that cover a point. Values are interpolated.
struct Sheet {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();     ///< Position in the plane of starts.
  Eigen::Matrix2d jacobian = Eigen::Matrix2d::Zero();  ///< ∂landing/∂start.
  double length = 0;
};

/// Extent and fineness of a mesh.
struct LensMeshSettings {
  Eigen::AlignedBox2d starts{Eigen::Vector2d(-0.5, -0.5), Eigen::Vector2d(0.5, 0.5)};  ///< In the plane of starts.
  Eigen::Vector2d target{1, 1};  ///< Size of the rectangle, centred in the other plane, where accuracy matters.
  Eigen::Vector2d pixel{1, 1};   ///< Size of a pixel there, world units; pixels need not be square.

  /// A rotation from directions in the plane of starts to those in the other plane, as straight light maps them.
  Eigen::Matrix2d turn = Eigen::Matrix2d::Identity();
};

/// Receives the part that is done, from 0 to 1, on the thread that called the long work.
using MeshReport = std::function<void(double part)>;

/// Triangulates the landings of a rectangle of starts.
///
/// The first mesh is regular: 4 pixels for each cell, at most 4096 cells along each side, and at most 4 cells for each
/// 16 pixels. Then, within `target`, two kinds of edges are halved: edges where a landing between the ends would lie
/// more than a tenth of a pixel off the straight line (by the Jacobians of both ends), and edges of which only one end
/// landed. An edge is not halved if it is shorter than 1/4 pixel in the starts and, by the Jacobians, in the landings,
/// or shorter than 1/16 pixel in the starts. Halving stops when there are about 4 starts for each pixel.
///
/// All of these lengths are in pixels along each side of a pixel; lengths in the starts are first mapped to the
/// landings by straight light. An edge is halved for both of its triangles, so that there are no cracks. An edge is
/// torn if the Jacobians do not explain how far apart its landings are, by more than a pixel and by more than half of
/// their distance (at the silhouette of the volume, or in the shadow of an obstacle). Torn edges have no triangles.
/// The result does not depend on the number of threads.
/// @param report  May be empty. Only `cancelled` of `progress` is used.
/// @throw Cancelled
LensMesh make_lens_mesh(const LensMap& map, double flexibility, const LensMeshSettings& settings, TraceCounts& counts,
                        const Progress& progress, const MeshReport& report = {});

/// Triangulates landings that are already traced: starts on a lattice of `columns` × `rows`, row by row.
LensMesh lattice_mesh(std::vector<Eigen::Vector2d> starts, std::vector<LensLanding> landings, int columns, int rows,
                      double pixel);

/// Finds sheets. Immutable; any number of threads may query it at once. The mesh must outlive it.
class SheetSearch {
 public:
  /// @param pixel  Size of a pixel in the plane of starts, world units. Sheets whose starts are closer than a
  /// thousandth of it count as one.
  SheetSearch(const LensMesh& mesh, double pixel) : mesh_(mesh), pixel_(pixel), search_(mesh.mesh) {}

  /// Finds all sheets that cover `point`. A point on an edge is on one sheet.
  void find(const Eigen::Vector2d& point, std::vector<Sheet>& sheets) const;

 private:
  const LensMesh& mesh_;
  double pixel_;
  PlanarMeshSearch search_;
};

}  // namespace tensorray
