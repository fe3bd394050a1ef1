#include "tools/import/surfaces/body_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <vector>

#include <Eigen/Geometry>
#include <vtkCellData.h>
#include <vtkCellTypes.h>
#include <vtkDataSet.h>
#include <vtkPointData.h>
#include <vtkPoints.h>

#include "tools/import/meshes/mesh_faces.h"
#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/surfaces/triangle_shells.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Tensor = Eigen::Map<const Eigen::Matrix<double, 9, 1>>;

/// From coordinates on a face with three or four corners, (0, 0), (1, 0), (0, 1) or (0, 0), (1, 0), (1, 1), (0, 1).
using FaceMap = std::function<Vector3d(const Vector2d&)>;

/// A face with three or four corners, in an order of its own.
struct Patch {
  std::vector<vtkIdType> corners;
  /// Of the edge from each corner to the next: its inner point with the lowest index, which distinguishes edges that
  /// are curved otherwise; −1: it has none.
  std::vector<vtkIdType> middles;
  FaceMap at;
  int intervals = 2;      ///< Along it, at which second differences tell how it is curved.
  bool reversed = false;  ///< Whether the corners are clockwise as seen from outside.

  Vector2d corner(std::size_t k) const {
    if (corners.size() == 3) return {k == 1, k == 2};
    return {k == 1 || k == 2, k >= 2};
  }
};

/// How many parts of the way between two points of a patch make the error of chords at most `tolerance`.
/// @param seen  Projects to the directions in which errors count.
int parts_between(const Patch& patch, const Vector2d& from, const Vector2d& to, const Matrix3d& seen,
                  double tolerance) {
  constexpr double max_parts = 64, rounding = 1e-6;
  const int n = patch.intervals;
  const auto at = [&](int i) { return patch.at(from + (static_cast<double>(i) / n) * (to - from)); };
  double bend = 0;  // The second derivative.
  for (int i = 1; i < n; ++i) bend = std::max(bend, (seen * (at(i - 1) - 2 * at(i) + at(i + 1))).norm() * n * n);
  return static_cast<int>(std::clamp(std::ceil(std::sqrt(bend / (8 * tolerance)) - rounding), 1.0, max_parts));
}

/// For an edge, along which points may be anywhere.
int parts_along(const Patch& patch, const Vector2d& from, const Vector2d& to, double tolerance) {
  const Vector3d chord = (patch.at(to) - patch.at(from)).normalized();
  return parts_between(patch, from, to, Matrix3d::Identity() - chord * chord.transpose(), tolerance);
}

/// For the inside, whose points may be anywhere in its plane: along the lines from corners to the middles of opposite
/// edges, or the diagonals and the lines between the middles of opposite edges.
int parts_inside(const Patch& patch, double tolerance) {
  const std::size_t n = patch.corners.size();
  const auto corner = [&](std::size_t k) { return patch.corner(k % n); };
  const auto middle = [&](std::size_t k) -> Vector2d { return 0.5 * (corner(k) + corner(k + 1)); };
  const auto edge = [&](std::size_t from, std::size_t to) -> Vector3d {
    return patch.at(corner(to)) - patch.at(corner(from));
  };
  const Vector3d normal = edge(0, 2).cross(n == 3 ? edge(0, 1) : edge(1, 3)).normalized();
  const Matrix3d seen = normal * normal.transpose();
  int parts = 1;
  for (std::size_t k = 0; k < (n == 3 ? 3 : 2); ++k) {
    const Vector2d opposite = n == 3 ? middle(k + 1) : corner(k + 2);
    parts = std::max(parts, parts_between(patch, corner(k), opposite, seen, tolerance));
    if (n == 4) parts = std::max(parts, parts_between(patch, middle(k), middle(k + 2), seen, tolerance));
  }
  return parts;
}

/// Makes triangles of faces.
class Tessellation {
 public:
  Tessellation(vtkDataSet& mesh, const MeshPoints& points, double tolerance)
      : mesh_(mesh), points_(points), tolerance_(tolerance), vertex_of_(points.positions.size(), no_vertex) {}

  /// Divides the edges of a curved face. To be called for all of them, before add.
  void divide_edges(const CellFace& face) {
    if (!is_curved(face)) return;
    const Patch patch = curved_patch(face);
    for (std::size_t k = 0; k < patch.corners.size(); ++k) {
      const vtkIdType a = patch.corners[k], b = patch.corners[(k + 1) % patch.corners.size()];
      const auto [edge, is_new] = edges_.try_emplace({std::min(a, b), std::max(a, b), patch.middles[k]});
      if (!is_new) continue;
      const Vector2d from = patch.corner(k), to = patch.corner((k + 1) % patch.corners.size());
      const int parts = parts_along(patch, from, to, tolerance_);
      edge->second = {vertex(a)};
      for (int i = 1; i < parts; ++i)
        edge->second.push_back(new_vertex(patch.at(from + (static_cast<double>(i) / parts) * (to - from))));
      edge->second.push_back(vertex(b));
      if (a > b) std::reverse(edge->second.begin(), edge->second.end());
    }
  }

  void add(const CellFace& face) {
    if (is_curved(face)) return add_patch(curved_patch(face));
    if (face.corners.size() > 4) return add_polygon(face);
    Patch patch;
    patch.corners = face.corners;
    patch.middles.assign(face.corners.size(), -1);
    std::vector<Vector3d> p;
    for (const vtkIdType id : face.corners) p.push_back(points_[id]);
    patch.at = [p](const Vector2d& c) -> Vector3d {
      const double opposite = p.size() == 4 ? c.x() * c.y() : 0;
      return p[0] + (c.x() - opposite) * (p[1] - p[0]) + (c.y() - opposite) * (p.back() - p[0]) +
             opposite * (p[2] - p[0]);
    };
    add_patch(patch);
  }

  TriangleMesh surface;

 private:
  static constexpr std::uint32_t no_vertex = std::numeric_limits<std::uint32_t>::max();

  bool is_curved(const CellFace& face) const {
    return vtkCellTypes::IsLinear(static_cast<unsigned char>(mesh_.GetCellType(face.cell))) == 0;
  }

  std::uint32_t new_vertex(const Vector3d& position) {
    surface.vertices.push_back(position);
    return static_cast<std::uint32_t>(surface.vertices.size() - 1);
  }

  std::uint32_t vertex(vtkIdType point) {
    std::uint32_t& found = vertex_of_[static_cast<std::size_t>(point)];
    if (found == no_vertex) found = new_vertex(points_[point]);
    return found;
  }

  /// Valid until the next call.
  Patch curved_patch(const CellFace& face) {
    if (loaded_ != face.cell) cell_.load(mesh_, face.cell);
    loaded_ = face.cell;
    vtkCell& of_vtk = *cell_.vtk().GetFace(face.index);
    Patch patch;
    patch.reversed = face.reversed;
    const int corners = of_vtk.GetNumberOfEdges();
    for (int k = 0; k < corners; ++k) patch.corners.push_back(points_.representative(of_vtk.GetPointId(k)));
    patch.middles.assign(patch.corners.size(), -1);
    Eigen::Matrix3Xd nodes(3, of_vtk.GetNumberOfPoints());
    for (Eigen::Index i = 0; i < nodes.cols(); ++i) of_vtk.Points->GetPoint(i, nodes.col(i).data());
    for (int k = 0; k < corners; ++k) {
      vtkCell& edge = *of_vtk.GetEdge(k);
      const vtkIdType a = points_.representative(edge.GetPointId(0)), b = points_.representative(edge.GetPointId(1));
      patch.intervals = std::max(patch.intervals, 2 * (static_cast<int>(edge.GetNumberOfPoints()) - 1));
      vtkIdType middle = edge.GetNumberOfPoints() > 2 ? VTK_ID_MAX : -1;
      for (int i = 2; i < edge.GetNumberOfPoints(); ++i)
        middle = std::min(middle, points_.representative(edge.GetPointId(i)));
      for (std::size_t i = 0; i < patch.corners.size(); ++i) {
        const vtkIdType from = patch.corners[i], to = patch.corners[(i + 1) % patch.corners.size()];
        if ((from == a && to == b) || (from == b && to == a)) patch.middles[i] = middle;
      }
    }
    patch.at = [&of_vtk, nodes](const Vector2d& c) -> Vector3d {
      const double at[3] = {c.x(), c.y(), 0};
      Eigen::VectorXd weights(nodes.cols());
      of_vtk.InterpolateFunctions(at, weights.data());
      return nodes * weights;
    };
    return patch;
  }

  /// The vertices along an edge, both ends included.
  std::vector<std::uint32_t> edge_between(vtkIdType a, vtkIdType b, vtkIdType middle) {
    const vtkIdType low = std::min(a, b), high = std::max(a, b);
    // A straight edge follows a curved one between the same points.
    const auto edge = edges_.lower_bound({low, high, middle});
    if (edge == edges_.end() || edge->first[0] != low || edge->first[1] != high) return {vertex(a), vertex(b)};
    std::vector<std::uint32_t> vertices = edge->second;
    if (a > b) std::reverse(vertices.begin(), vertices.end());
    return vertices;
  }

  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool reversed) {
    if (a == b || b == c || c == a) return;
    surface.triangles.push_back({a, reversed ? c : b, reversed ? b : c});
  }

  /// A polygon as triangles about its mean point, as MeshCell divides it.
  void add_polygon(const CellFace& face) {
    Vector3d mean = Vector3d::Zero();
    for (const vtkIdType id : face.corners) mean += points_[id] / static_cast<double>(face.corners.size());
    const std::uint32_t centre = new_vertex(mean);
    for (std::size_t k = 0; k < face.corners.size(); ++k) {
      const auto edge = edge_between(face.corners[k], face.corners[(k + 1) % face.corners.size()], -1);
      for (std::size_t i = 0; i + 1 < edge.size(); ++i) add_triangle(edge[i], edge[i + 1], centre, false);
    }
  }

  /// A grid of as many intervals as the face or one of its edges needs. On an edge that has fewer, several of the
  /// grid's vertices are one.
  void add_patch(const Patch& patch) {
    const std::size_t corners = patch.corners.size();
    std::vector<std::vector<std::uint32_t>> edges;
    int n = parts_inside(patch, tolerance_);
    for (std::size_t k = 0; k < corners; ++k) {
      edges.push_back(edge_between(patch.corners[k], patch.corners[(k + 1) % corners], patch.middles[k]));
      n = std::max(n, static_cast<int>(edges[k].size()) - 1);
    }
    const auto on_edge = [&](std::size_t k, int i) {
      const int parts = static_cast<int>(edges[k].size()) - 1;
      return edges[k][static_cast<std::size_t>((2 * i * parts + n) / (2 * n))];
    };
    const auto vertex_at = [&](int i, int j) {
      if (j == 0) return on_edge(0, i);
      if (corners == 3 ? i + j == n : i == n) return on_edge(1, j);
      if (corners == 3 && i == 0) return on_edge(2, n - j);
      if (corners == 4 && j == n) return on_edge(2, n - i);
      if (corners == 4 && i == 0) return on_edge(3, n - j);
      return new_vertex(patch.at(Vector2d(i, j) / n));
    };
    std::vector<std::uint32_t> below, row;
    for (int j = 0; j <= n; ++j, below.swap(row)) {
      row.clear();
      for (int i = 0; i <= (corners == 3 ? n - j : n); ++i) row.push_back(vertex_at(i, j));
      for (std::size_t i = 0; j > 0 && i + 1 < below.size(); ++i) {
        add_triangle(below[i], below[i + 1], row[i], patch.reversed);
        if (i + 1 < row.size()) add_triangle(below[i + 1], row[i + 1], row[i], patch.reversed);
      }
    }
  }

  vtkDataSet& mesh_;
  const MeshPoints& points_;
  double tolerance_;
  std::vector<std::uint32_t> vertex_of_;  ///< For each point.
  /// The vertices of edges of curved faces, from the corner with the lower index to the other; by both and the middle.
  std::map<std::array<vtkIdType, 3>, std::vector<std::uint32_t>> edges_;
  MeshCell cell_;
  vtkIdType loaded_ = -1;
};

/// Chooses the faces of cells that have finite tensors, as far as there are any.
ChooseFaces with_data(vtkDataSet& mesh) {
  const double* const of_points = made_tensors(*mesh.GetPointData());
  const double* const of_cells = made_tensors(*mesh.GetCellData());
  return [=](const MeshCell& cell, vtkIdType id, std::vector<CellFace>& faces) {
    bool is_finite = !of_cells || Tensor(of_cells + 9 * id).allFinite();
    for (int i = 0; of_points && i < cell.points(); ++i)
      is_finite = is_finite && Tensor(of_points + 9 * cell.point(i)).allFinite();
    if (!is_finite) faces.clear();
  };
}

}  // namespace

BodySurface body_surface(vtkDataSet& mesh, double tolerance) {
  const MeshPoints points = points_of(mesh);
  std::vector<CellFace> faces = outer_faces(mesh, points, with_data(mesh));
  BodySurface surface;
  surface.inner_faces = remove_crossed_faces(faces, points);
  Tessellation tessellation(mesh, points, tolerance);
  for (const CellFace& face : faces) tessellation.divide_edges(face);
  std::vector<std::size_t> ends;  // Of the triangles of each face.
  for (const CellFace& face : faces) {
    tessellation.add(face);
    ends.push_back(tessellation.surface.triangles.size());
  }
  surface.mesh = std::move(tessellation.surface);
  const std::vector<char> inner = inner_triangles(surface.mesh);
  for (std::size_t i = 0, begin = 0; i < ends.size(); begin = ends[i++]) {
    const auto from = inner.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto to = inner.begin() + static_cast<std::ptrdiff_t>(ends[i]);
    surface.inner_faces += std::find(from, to, 1) != to ? 1 : 0;
  }
  for (std::size_t i = 0; i < inner.size(); ++i)
    if (!inner[i]) surface.area += area_of(surface.mesh, i).norm();
  surface.open_edges = open_edges(surface.mesh);
  return surface;
}

}  // namespace tensorray
