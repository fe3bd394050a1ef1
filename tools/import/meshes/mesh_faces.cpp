#include "tools/import/meshes/mesh_faces.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>
#include <vtkDoubleArray.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStaticPointLocator.h>

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// SplitMix64. The sum of it over points is the key of a set of points.
std::uint64_t mixed(vtkIdType id) {
  std::uint64_t x = (static_cast<std::uint64_t>(id) + 1) * 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

std::uint64_t key_of(const std::vector<vtkIdType>& ids) {
  std::uint64_t key = 0;
  for (const vtkIdType id : ids) key += mixed(id);
  return key;
}

/// An edge of a face, from one corner to the next.
struct FaceEdge {
  vtkIdType low, high;
  std::size_t face;
  bool forward;       ///< Whether it goes from `low` to `high`.
  vtkIdType far = 0;  ///< Of a triangle: the third corner.

  bool is_same(const FaceEdge& other) const { return low == other.low && high == other.high; }
  bool operator<(const FaceEdge& other) const {
    return std::tie(low, high, face) < std::tie(other.low, other.high, other.face);
  }
};

void add_edges(const std::vector<vtkIdType>& corners, std::size_t face, std::vector<FaceEdge>& edges) {
  for (std::size_t k = 0, n = corners.size(); k < n; ++k) {
    const vtkIdType a = corners[k], b = corners[(k + 1) % n];
    edges.push_back({std::min(a, b), std::max(a, b), face, a < b, corners[(k + 2) % n]});
  }
}

/// The corners of all faces of a cell, in VTK's order.
void list_corners(const MeshCell& cell, const MeshPoints& points, std::vector<CellFace>& faces) {
  const bool divided = cell.shape() == MeshCell::Shape::tetrahedra;
  faces.resize(divided ? cell.faces().size() : static_cast<std::size_t>(cell.vtk().GetNumberOfFaces()));
  for (std::size_t i = 0; i < faces.size(); ++i) {
    std::vector<vtkIdType>& corners = faces[i].corners;
    corners.clear();
    if (divided) {
      for (const std::size_t k : cell.faces()[i])
        corners.push_back(points.representative(cell.point(static_cast<int>(k))));
    } else {
      vtkCell& face = *cell.vtk().GetFace(static_cast<int>(i));
      for (int k = 0; k < face.GetNumberOfEdges(); ++k) corners.push_back(points.representative(face.GetPointId(k)));
      if (face.GetCellType() == VTK_PIXEL) std::swap(corners[2], corners[3]);
    }
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    while (corners.size() > 1 && corners.front() == corners.back()) corners.pop_back();
  }
}

bool has_no_area(const CellFace& face) {
  const std::vector<vtkIdType>& c = face.corners;
  return c.size() < 3 || (c.size() == 4 && (c[0] == c[2] || c[1] == c[3]));
}

/// For each face of a cell, 1, or −1 if it looks the other way than the first one: neighbours run along their common
/// edge in opposite directions.
std::vector<int> turns_of(const std::vector<CellFace>& faces) {
  std::vector<FaceEdge> edges;
  for (std::size_t i = 0; i < faces.size(); ++i) add_edges(faces[i].corners, i, edges);
  std::sort(edges.begin(), edges.end());
  std::vector<int> turns(faces.size(), 0);
  for (int& start : turns) {
    if (start != 0) continue;
    start = 1;
    for (bool found = true; found;) {
      found = false;
      for (std::size_t k = 0; k + 1 < edges.size(); ++k) {
        if (!edges[k].is_same(edges[k + 1])) continue;
        int &one = turns[edges[k].face], &other = turns[edges[k + 1].face];
        if ((one == 0) == (other == 0)) continue;
        (one == 0 ? one : other) = (edges[k].forward == edges[k + 1].forward ? -1 : 1) * (one + other);
        found = true;
      }
    }
  }
  return turns;
}

/// Negative if the faces look into the cell. Of a curved cell the sense in parametric space counts, as its corners
/// alone may have another one in space.
double sense_of(const MeshCell& cell, const std::vector<CellFace>& faces, const std::vector<int>& turns,
                const MeshPoints& points) {
  const auto at = [&](vtkIdType corner) -> Vector3d {
    if (cell.is_linear()) return points[corner];
    int i = 0;
    while (points.representative(cell.point(i)) != corner) ++i;
    return Vector3d(cell.vtk().GetParametricCoords() + 3 * i);
  };
  double volume = 0;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const std::vector<vtkIdType>& c = faces[i].corners;
    const Vector3d from = at(faces[0].corners[0]), first = at(c[0]) - from;
    for (std::size_t k = 1; k + 1 < c.size(); ++k)
      volume += turns[i] * first.dot((at(c[k]) - from).cross(at(c[k + 1]) - from));
  }
  return cell.is_linear() ? volume : volume * cell.jacobian().determinant();
}

/// Finds the faces of a loaded cell.
void find_faces(const MeshCell& cell, vtkIdType id, const MeshPoints& points, std::vector<CellFace>& faces) {
  list_corners(cell, points, faces);
  for (std::size_t i = 0; i < faces.size(); ++i) faces[i].cell = id, faces[i].index = static_cast<int>(i);
  faces.erase(std::remove_if(faces.begin(), faces.end(), has_no_area), faces.end());
  const std::vector<int> turns = turns_of(faces);
  const bool is_inside_out = sense_of(cell, faces, turns, points) < 0;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    faces[i].reversed = (turns[i] < 0) != is_inside_out;
    if (faces[i].reversed) std::reverse(faces[i].corners.begin(), faces[i].corners.end());
  }
}

CellSide side_of(const CellFace& face) {
  const std::vector<vtkIdType>& c = face.corners;
  const auto lowest = static_cast<std::size_t>(std::min_element(c.begin(), c.end()) - c.begin());
  const bool turn = c[(lowest + 1) % c.size()] < c[(lowest + c.size() - 1) % c.size()];
  return {key_of(c), face.cell, face.index, turn};
}

/// Calls visit(cell, id, faces, i) with the cells `cell_at(i)` of i below `count`, on all threads; `faces` is for
/// `visit` to use again and again.
template <class CellAt, class Visit>
void for_each_cell(vtkDataSet& mesh, std::size_t count, const CellAt& cell_at, const Visit& visit) {
  if (count > 0) MeshCell().load(mesh, 0);  // Makes VTK's cached data on one thread.
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 512), [&](const auto& range) {
    MeshCell cell;
    std::vector<CellFace> faces;
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      if (const vtkIdType id = cell_at(i); cell.load(mesh, id)) visit(cell, id, faces, i);
  });
}

/// Those that are left when faces with the same corners that look in opposite directions are removed in pairs.
/// @param sides  Sorted.
std::vector<CellSide> unpaired(const std::vector<CellSide>& sides) {
  std::vector<CellSide> left;
  for (std::size_t i = 0, next = 0; i < sides.size(); i = next) {
    int sum = 0;
    for (next = i; next < sides.size() && sides[next].key == sides[i].key; ++next) sum += sides[next].turn ? 1 : -1;
    int rest = std::abs(sum);
    for (std::size_t k = i; k < next && rest > 0; ++k)
      if (sides[k].turn == (sum > 0)) left.push_back(sides[k]), --rest;
  }
  std::sort(left.begin(), left.end(),
            [](const CellSide& a, const CellSide& b) { return std::tie(a.cell, a.index) < std::tie(b.cell, b.index); });
  return left;
}

Vector3d area_of(const CellFace& face, const MeshPoints& points) { return face_measure(corners_of(face, points)).area; }

/// A quadrilateral between four points: a face, or two triangles.
struct Quad {
  std::uint64_t key;
  std::size_t first, second;
};

constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

/// The faces with four corners, and the pairs of triangles that have a common edge and look in similar directions.
std::vector<Quad> quads_of(const std::vector<CellFace>& faces, const MeshPoints& points) {
  constexpr double similar = 0.5;  // Cosine of the angle between the two.
  std::vector<FaceEdge> edges;
  std::vector<Quad> quads;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (faces[i].corners.size() == 3) add_edges(faces[i].corners, i, edges);
    if (faces[i].corners.size() == 4) quads.push_back({key_of(faces[i].corners), i, none});
  }
  tbb::parallel_sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size(); ++i)
    for (std::size_t k = i + 1; k < edges.size() && edges[k].is_same(edges[i]); ++k) {
      if (edges[k].forward == edges[i].forward || edges[k].far == edges[i].far) continue;
      const Vector3d a = area_of(faces[edges[i].face], points), b = area_of(faces[edges[k].face], points);
      if (a.dot(b) > similar * a.norm() * b.norm())
        quads.push_back({key_of(faces[edges[i].face].corners) + mixed(edges[k].far), edges[i].face, edges[k].face});
    }
  tbb::parallel_sort(quads.begin(), quads.end(), [](const Quad& a, const Quad& b) {
    return std::tie(a.key, a.first, a.second) < std::tie(b.key, b.first, b.second);
  });
  return quads;
}

}  // namespace

MeshPoints points_of(vtkDataSet& mesh) {
  MeshPoints points;
  const vtkIdType count = mesh.GetNumberOfPoints();
  points.positions.resize(static_cast<std::size_t>(count));
  points.same.resize(static_cast<std::size_t>(count));
  for (vtkIdType i = 0; i < count; ++i) mesh.GetPoint(i, points.positions[static_cast<std::size_t>(i)].data());
  vtkNew<vtkDoubleArray> numbers;
  numbers->SetNumberOfComponents(3);
  if (count > 0) numbers->SetArray(points.positions.front().data(), 3 * count, 1);
  vtkNew<vtkPoints> positions;
  positions->SetData(numbers);
  vtkNew<vtkPolyData> cloud;
  cloud->SetPoints(positions);
  vtkNew<vtkStaticPointLocator> locator;
  locator->SetDataSet(cloud);
  locator->BuildLocator();
  locator->MergePoints(0, points.same.data());
  return points;
}

bool CellSide::operator<(const CellSide& other) const {
  return std::tie(key, cell, index) < std::tie(other.key, other.cell, other.index);
}

std::vector<CellSide> sides_of(vtkDataSet& mesh, const MeshPoints& points, const ChooseFaces& choose) {
  tbb::enumerable_thread_specific<std::vector<CellSide>> parts;
  for_each_cell(
      mesh, static_cast<std::size_t>(mesh.GetNumberOfCells()), [](std::size_t i) { return static_cast<vtkIdType>(i); },
      [&](const MeshCell& cell, vtkIdType id, std::vector<CellFace>& faces, std::size_t) {
        find_faces(cell, id, points, faces);
        choose(cell, id, faces);
        std::transform(faces.begin(), faces.end(), std::back_inserter(parts.local()), side_of);
      });
  std::vector<CellSide> all;
  for (std::vector<CellSide>& part : parts) {
    all.insert(all.end(), part.begin(), part.end());
    part = {};
  }
  tbb::parallel_sort(all.begin(), all.end());
  return all;
}

std::vector<CellFace> faces_at(vtkDataSet& mesh, const MeshPoints& points, const std::vector<CellSide>& sides) {
  std::vector<CellFace> found(sides.size());
  for_each_cell(
      mesh, sides.size(), [&](std::size_t i) { return sides[i].cell; },
      [&](const MeshCell& cell, vtkIdType id, std::vector<CellFace>& faces, std::size_t i) {
        find_faces(cell, id, points, faces);
        for (const CellFace& face : faces)
          if (face.index == sides[i].index) found[i] = face;
      });
  return found;
}

std::vector<CellFace> outer_faces(vtkDataSet& mesh, const MeshPoints& points, const ChooseFaces& choose) {
  return faces_at(mesh, points, unpaired(sides_of(mesh, points, choose)));
}

FaceMeasure face_measure(const Eigen::Matrix3Xd& corners) {
  const Vector3d mean = corners.rowwise().mean();
  FaceMeasure measure{Vector3d::Zero(), Vector3d::Zero()};
  Eigen::Matrix3Xd areas(3, corners.cols());
  const auto next = [&](Eigen::Index i) { return (i + 1) % corners.cols(); };
  for (Eigen::Index i = 0; i < corners.cols(); ++i) {
    const Vector3d from = corners.col(i) - mean, to = corners.col(next(i)) - mean;
    areas.col(i) = 0.5 * from.cross(to);
    measure.area += areas.col(i);
  }
  double sum = 0;
  for (Eigen::Index i = 0; i < corners.cols(); ++i) {
    const double area = areas.col(i).dot(measure.area);
    measure.centre += area * (corners.col(i) + corners.col(next(i)) - 2 * mean) / 3;
    sum += area;
  }
  measure.centre = sum > 0 ? Vector3d(mean + measure.centre / sum) : mean;
  return measure;
}

Eigen::Matrix3Xd corners_of(const CellFace& face, const MeshPoints& points) {
  Eigen::Matrix3Xd corners(3, static_cast<Eigen::Index>(face.corners.size()));
  for (std::size_t k = 0; k < face.corners.size(); ++k)
    corners.col(static_cast<Eigen::Index>(k)) = points[face.corners[k]];
  return corners;
}

std::size_t remove_crossed_faces(std::vector<CellFace>& faces, const MeshPoints& points) {
  const std::vector<Quad> quads = quads_of(faces, points);
  const auto area = [&](const Quad& quad) {
    const Vector3d of_first = area_of(faces[quad.first], points);
    return quad.second == none ? of_first : Vector3d(of_first + area_of(faces[quad.second], points));
  };
  std::vector<bool> removed(faces.size(), false);
  const auto is_removed = [&](const Quad& quad) {
    return removed[quad.first] || (quad.second != none && removed[quad.second]);
  };
  for (std::size_t i = 0; i < quads.size(); ++i)
    for (std::size_t k = i + 1; k < quads.size() && quads[k].key == quads[i].key && !is_removed(quads[i]); ++k) {
      const Quad &a = quads[i], &b = quads[k];
      constexpr double rounding = 1e-6;
      // Those of a flat tetrahedron that has no neighbours are its own.
      if (is_removed(b) || faces[a.first].cell == faces[b.first].cell) continue;
      if ((area(a) + area(b)).norm() > rounding * area(a).norm()) continue;
      for (const std::size_t face : {a.first, a.second, b.first, b.second})
        if (face != none) removed[face] = true;
    }
  std::vector<CellFace> left;
  for (std::size_t i = 0; i < faces.size(); ++i)
    if (!removed[i]) left.push_back(std::move(faces[i]));
  const std::size_t gone = faces.size() - left.size();
  faces = std::move(left);
  return gone;
}

}  // namespace tensorray
