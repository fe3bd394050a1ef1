#include "tools/import/surfaces/face_triangles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include <Eigen/Geometry>
#include <vtkCellTypes.h>
#include <vtkDataSet.h>
#include <vtkPoints.h>

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// What lies on an edge: nothing, as it is straight; the inside of a face; or else the edge's inner point with the
/// lowest index, which distinguishes edges between the same corners.
using Curve = vtkIdType;
constexpr Curve straight = -1, inside = -2;

/// A face in coordinates of its own. The corners of three are at (0, 0), (1, 0), (0, 1), of four at (0, 0), (1, 0),
/// (1, 1), (0, 1).
struct Patch {
  std::vector<vtkIdType> corners;
  std::vector<Curve> curves;                    ///< From each corner to the next.
  std::function<Vector3d(const Vector2d&)> at;  ///< Null: the face is flat.
  bool reversed = false;                        ///< Whether the corners are clockwise as seen from outside.
};

bool is_curved(vtkDataSet& mesh, const CellFace& face) {
  return vtkCellTypes::IsLinear(static_cast<unsigned char>(mesh.GetCellType(face.cell))) == 0;
}

/// Makes triangles of faces. Those that are curved come first: straight edges follow curved ones.
class Tessellation {
 public:
  Tessellation(vtkDataSet& mesh, const MeshPoints& points, double tolerance)
      : mesh_(mesh), points_(points), tolerance_(tolerance), vertex_of_(points.positions.size(), no_vertex) {}

  /// A face with more than four corners becomes triangles about its mean point, as MeshCell divides it.
  void add(const CellFace& face) {
    const Patch patch = is_curved(mesh_, face) ? curved_patch(face) : straight_patch(face);
    const std::vector<Curve>& curves = patch.curves;
    const std::size_t n = patch.corners.size();
    std::vector<Corner> c;
    Vector3d mean = Vector3d::Zero();
    for (std::size_t k = 0; k < n; ++k) {
      c.push_back({vertex(patch.corners[k]), Vector2d(k == 1 || (n > 3 && k == 2), k >= 2)});
      mean += points_[patch.corners[k]] / static_cast<double>(n);
    }
    between_.clear();
    const Vector2d third(1.0 / 3, 1.0 / 3);
    const bool bulges = n == 3 && patch.at && (patch.at(third) - mean).norm() > tolerance_;
    if (n > 4 || bulges) {
      const Corner centre{new_vertex(bulges ? patch.at(third) : mean), third};
      for (std::size_t k = 0; k < n; ++k) divide(patch, {c[k], c[(k + 1) % n], centre}, {curves[k], inside, inside});
      return;
    }
    for (std::size_t k = 1; k + 1 < n; ++k)
      divide(patch, {c[0], c[k], c[k + 1]},
             {k == 1 ? curves[0] : inside, curves[k], k + 2 == n ? curves[k + 1] : inside});
  }

  TriangleMesh surface;

 private:
  static constexpr std::uint32_t no_vertex = std::numeric_limits<std::uint32_t>::max();

  struct Corner {
    std::uint32_t vertex;
    Vector2d at;
  };

  std::uint32_t new_vertex(const Vector3d& position) {
    surface.vertices.push_back(position);
    return static_cast<std::uint32_t>(surface.vertices.size() - 1);
  }

  std::uint32_t vertex(vtkIdType point) {
    std::uint32_t& found = vertex_of_[static_cast<std::size_t>(point)];
    if (found == no_vertex) found = new_vertex(points_[point]);
    return found;
  }

  /// The face of a linear cell. One with four corners in no plane is bilinear.
  Patch straight_patch(const CellFace& face) const {
    Patch patch{face.corners, std::vector<Curve>(face.corners.size(), straight), nullptr, false};
    if (face.corners.size() != 4) return patch;
    const Vector3d &a = points_[face.corners[0]], &b = points_[face.corners[1]], &d = points_[face.corners[3]];
    const Vector3d c2 = points_[face.corners[2]], warp = a - b + c2 - d;
    if (std::abs((c2 - a).cross(d - b).normalized().dot(warp)) > 4 * tolerance_)
      patch.at = [=](const Vector2d& c) -> Vector3d { return a + c.x() * (b - a) + c.y() * (d - a) + c.prod() * warp; };
    return patch;
  }

  /// Valid until the next call.
  Patch curved_patch(const CellFace& face) {
    if (loaded_ != face.cell) cell_.load(mesh_, face.cell);
    loaded_ = face.cell;
    vtkCell& of_vtk = *cell_.vtk().GetFace(face.index);
    const auto n = static_cast<std::size_t>(of_vtk.GetNumberOfEdges());
    Patch patch{{}, std::vector<Curve>(n, straight), nullptr, face.reversed};
    for (std::size_t k = 0; k < n; ++k)
      patch.corners.push_back(points_.representative(of_vtk.GetPointId(static_cast<int>(k))));
    Eigen::Matrix3Xd nodes(3, of_vtk.GetNumberOfPoints());
    for (Eigen::Index i = 0; i < nodes.cols(); ++i) of_vtk.Points->GetPoint(i, nodes.col(i).data());
    for (int k = 0; k < of_vtk.GetNumberOfEdges(); ++k) {
      std::vector<vtkIdType> ids;
      for (const vtkIdType id : *of_vtk.GetEdge(k)->GetPointIds()) ids.push_back(points_.representative(id));
      if (ids.size() < 3) continue;
      for (std::size_t i = 0; i < n; ++i)
        if (std::minmax(patch.corners[i], patch.corners[(i + 1) % n]) == std::minmax(ids[0], ids[1]))
          patch.curves[i] = *std::min_element(ids.begin() + 2, ids.end());
    }
    patch.at = [&of_vtk, nodes](const Vector2d& c) -> Vector3d {
      const double at[3] = {c.x(), c.y(), 0};
      Eigen::VectorXd weights(nodes.cols());
      of_vtk.InterpolateFunctions(at, weights.data());
      return nodes * weights;
    };
    return patch;
  }

  /// Whether a line between two points of a patch is farther than the tolerance from its chord.
  bool is_bent(const Patch& patch, const Vector2d& from, const Vector2d& to) const {
    constexpr double least = 1.0 / 64;  // Part of an edge that is not divided.
    if ((to - from).lpNorm<Eigen::Infinity>() <= least) return false;
    const Vector3d start = patch.at(from), chord = (patch.at(to) - start).normalized();
    for (const double part : {0.5, 0.25, 0.75}) {
      const Vector3d step = patch.at(from + part * (to - from)) - start;
      if ((step - chord.dot(step) * chord).norm() > tolerance_) return true;
    }
    return false;
  }

  /// The point at which an edge is divided, if it is. @param curve  A straight edge gets the curve that it follows.
  std::optional<Corner> middle(const Patch& patch, const Corner& a, const Corner& b, Curve& curve) {
    if (curve == inside && !patch.at) return {};
    const std::uint32_t low = std::min(a.vertex, b.vertex), high = std::max(a.vertex, b.vertex);
    if (curve == straight) {
      const auto curved = along_.lower_bound({low, high, 0});
      if (curved == along_.end() || curved->first[0] != low || curved->first[1] != high) return {};
      curve = curved->first[2];
    }
    const Vector2d at = 0.5 * (a.at + b.at);
    const auto [found, is_new] = (curve == inside ? between_ : along_).try_emplace({low, high, curve}, no_vertex);
    if (is_new && patch.at && is_bent(patch, a.at, b.at)) found->second = new_vertex(patch.at(at));
    return found->second == no_vertex ? std::nullopt : std::optional<Corner>({found->second, at});
  }

  /// Divides a triangle at the middles of edges until none is bent, the longest ones first.
  /// @param curves  Of the edges from each corner to the next.
  void divide(const Patch& patch, const std::array<Corner, 3>& c, std::array<Curve, 3> curves) {
    std::optional<Corner> cut;
    std::size_t k = 0;
    double length = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Corner &a = c[i], &b = c[(i + 1) % 3];
      const std::optional<Corner> found = middle(patch, a, b, curves[i]);
      const double of_edge = (surface.vertices[a.vertex] - surface.vertices[b.vertex]).norm();
      if (found && (!cut || of_edge > length)) cut = found, k = i, length = of_edge;
    }
    if (!cut) return add_triangle(c[0].vertex, c[1].vertex, c[2].vertex, patch.reversed);
    const std::size_t next = (k + 1) % 3, last = (k + 2) % 3;
    divide(patch, {c[k], *cut, c[last]}, {curves[k], inside, curves[last]});
    divide(patch, {*cut, c[next], c[last]}, {curves[k], curves[next], inside});
  }

  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool reversed) {
    if (a == b || b == c || c == a) return;
    surface.triangles.push_back({a, reversed ? c : b, reversed ? b : c});
  }

  vtkDataSet& mesh_;
  const MeshPoints& points_;
  double tolerance_;
  std::vector<std::uint32_t> vertex_of_;  ///< For each point.
  /// The vertices in the middle of curved edges and of their parts, by both ends and the curve, and those between edges
  /// of a face; no_vertex: it is not divided.
  std::map<std::array<vtkIdType, 3>, std::uint32_t> along_, between_;
  MeshCell cell_;
  vtkIdType loaded_ = -1;
};

}  // namespace

FaceTriangles triangles_of(vtkDataSet& mesh, const MeshPoints& points, std::vector<CellFace> faces, double tolerance) {
  std::stable_partition(faces.begin(), faces.end(), [&](const CellFace& face) { return is_curved(mesh, face); });
  Tessellation tessellation(mesh, points, tolerance);
  FaceTriangles result;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    tessellation.add(faces[i]);
    result.face_of.resize(tessellation.surface.triangles.size(), i);
  }
  result.mesh = std::move(tessellation.surface);
  return result;
}

}  // namespace tensorray
