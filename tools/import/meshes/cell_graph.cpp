#include "tools/import/meshes/cell_graph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>
#include <vtkCellType.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStaticCellLocator.h>
#include <vtkStaticPointLocator.h>

namespace tensorray {
namespace {

using Eigen::Vector3d;
using Ids = std::vector<vtkIdType>;

std::string walls_of(const std::string& array) { return "walls of " + array; }

std::size_t at(vtkIdType id) { return static_cast<std::size_t>(id); }

/// The centroid of the pyramids between a cell's faces and its mean point.
Vector3d centroid(const MeshCell& cell, const std::vector<FaceMeasure>& faces) {
  const Vector3d mean = cell.positions().rowwise().mean();
  double volume = 0;
  Vector3d moment = Vector3d::Zero();
  for (const FaceMeasure& face : faces) {
    const double pyramid = face.area.dot(face.centre - mean);
    volume += pyramid;
    moment += 0.75 * pyramid * (face.centre - mean);
  }
  return volume > 0 ? Vector3d(mean + moment / volume) : mean;
}

/// Finds walls by the centres of their faces.
class WallFinder {
 public:
  WallFinder(vtkDataSet& mesh, vtkDoubleArray& vectors) : tolerance_(1e-6 * mesh.GetLength()) {
    const char* const name = vectors.GetName();
    walls_ = name ? vtkDoubleArray::SafeDownCast(mesh.GetFieldData()->GetArray(walls_of(name).c_str())) : nullptr;
    if (!walls_ || walls_->GetNumberOfTuples() == 0) return;
    points_->SetDataTypeToDouble();
    for (vtkIdType i = 0; i < walls_->GetNumberOfTuples(); ++i) points_->InsertNextPoint(walls_->GetPointer(10 * i));
    cloud_->SetPoints(points_);
    locator_->SetDataSet(cloud_);
    locator_->BuildLocator();
  }

  /// The wall at a face, as seen from its cell. Two that coincide are the sides of a baffle.
  std::optional<Wall> find(const FaceMeasure& face) const {
    if (points_->GetNumberOfPoints() == 0) return {};
    vtkNew<vtkIdList> found;
    locator_->FindPointsWithinRadius(tolerance_, face.centre.data(), found);
    for (const vtkIdType i : *found) {
      const double* const numbers = walls_->GetPointer(10 * i);
      const Wall wall{Vector3d(numbers), Vector3d(numbers + 3), static_cast<Wall::Kind>(numbers[6]),
                      Vector3d(numbers + 7)};
      if (wall.normal.dot(face.area) > 0) return wall;
    }
    return {};
  }

 private:
  double tolerance_;
  vtkSmartPointer<vtkDoubleArray> walls_;
  vtkNew<vtkPoints> points_;
  vtkNew<vtkPolyData> cloud_;
  vtkNew<vtkStaticPointLocator> locator_;
};

void join(vtkIdType a, vtkIdType b, CellGraph& graph) {
  if (a == b) return;
  graph.neighbours[at(a)].push_back(b);
  graph.neighbours[at(b)].push_back(a);
}

/// Whether two faces have more than two corners in common.
bool share_corners(const CellFace& a, const CellFace& b) {
  return std::count_if(a.corners.begin(), a.corners.end(), [&](vtkIdType corner) {
           return std::count(b.corners.begin(), b.corners.end(), corner) > 0;
         }) > 2;
}

/// Makes cells neighbours whose faces lie on each other without having the same corners.
void join_open_faces(const std::vector<CellFace>& faces, CellGraph& graph) {
  if (faces.empty()) return;
  vtkNew<vtkPolyData> polygons;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  polygons->SetPoints(points);
  polygons->AllocateEstimate(static_cast<vtkIdType>(faces.size()), 4);
  std::vector<FaceMeasure> measures;
  for (const CellFace& face : faces) {
    Ids ids;
    for (const vtkIdType corner : face.corners) ids.push_back(points->InsertNextPoint(graph.points[corner].data()));
    polygons->InsertNextCell(VTK_POLYGON, static_cast<int>(ids.size()), ids.data());
    measures.push_back(face_measure(corners_of(face, graph.points)));
  }
  vtkNew<vtkStaticCellLocator> locator;
  locator->SetDataSet(polygons);
  locator->BuildLocator();
  vtkNew<vtkIdList> found;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    constexpr double gap = 1e-3;  // Of curved faces that two blocks divide differently.
    const Eigen::Matrix3Xd corners = corners_of(faces[i], graph.points);
    const double reach = gap * (corners.rowwise().maxCoeff() - corners.rowwise().minCoeff()).norm();
    const Vector3d& centre = measures[i].centre;
    std::array<double, 6> bounds{};
    for (std::size_t k = 0; k < 6; ++k) bounds[k] = centre[static_cast<Eigen::Index>(k / 2)] + (k % 2 ? reach : -reach);
    locator->FindCellsWithinBounds(bounds.data(), found);
    for (const vtkIdType k : *found) {
      const FaceMeasure& other = measures[at(k)];
      if (other.area.dot(measures[i].area) >= 0) continue;
      const Vector3d normal = other.area.normalized();
      const Eigen::Matrix3Xd bent = corners_of(faces[at(k)], graph.points).colwise() - other.centre;
      // A bent face, and a part of it that is divided, are as far apart as it is bent.
      const double warp = share_corners(faces[i], faces[at(k)]) ? (normal.transpose() * bent).cwiseAbs().maxCoeff() : 0;
      if (std::abs(normal.dot(centre - other.centre)) <= reach + warp) join(faces[i].cell, faces[at(k)].cell, graph);
    }
  }
}

/// Finds the neighbours, from faces that are no walls.
void join_cells(vtkDataSet& mesh, const std::vector<CellSide>& sides, CellGraph& graph) {
  std::vector<CellSide> open;
  for (std::size_t i = 0, next = 0; i < sides.size(); i = next) {
    for (next = i + 1; next < sides.size() && sides[next].key == sides[i].key; ++next)
      for (std::size_t k = i; k < next; ++k) join(sides[k].cell, sides[next].cell, graph);
    if (next == i + 1) open.push_back(sides[i]);
  }
  join_open_faces(faces_at(mesh, graph.points, open), graph);
  tbb::parallel_for(std::size_t{0}, graph.neighbours.size(), [&](std::size_t id) {
    Ids& ids = graph.neighbours[id];
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  });
}

}  // namespace

void add_walls(vtkDataSet& mesh, const std::string& array, const std::vector<Wall>& walls) {
  vtkNew<vtkDoubleArray> numbers;
  numbers->SetName(walls_of(array).c_str());
  numbers->SetNumberOfComponents(10);
  for (const Wall& wall : walls) {
    Eigen::Matrix<double, 10, 1> one;
    one << wall.centre, wall.normal, static_cast<double>(wall.kind), wall.value;
    numbers->InsertNextTuple(one.data());
  }
  mesh.GetFieldData()->AddArray(numbers);
}

CellGraph cell_graph(vtkDataSet& mesh, vtkDoubleArray& vectors) {
  CellGraph graph;
  const std::size_t count = at(mesh.GetNumberOfCells());
  graph.centres.resize(count);
  graph.used.resize(count);
  graph.neighbours.resize(count);
  graph.walls.resize(count);
  graph.points = points_of(mesh);
  const WallFinder finder(mesh, vectors);
  const auto choose = [&](const MeshCell& cell, vtkIdType id, std::vector<CellFace>& faces) {
    std::vector<FaceMeasure> measures;
    for (const CellFace& face : faces) measures.push_back(face_measure(corners_of(face, graph.points)));
    graph.centres[at(id)] = centroid(cell, measures);
    graph.used[at(id)] = Eigen::Map<const Vector3d>(vectors.GetPointer(3 * id)).allFinite();
    std::size_t left = 0;
    for (std::size_t i = 0; i < faces.size() && graph.used[at(id)]; ++i) {
      if (measures[i].area.isZero(0)) continue;
      if (const std::optional<Wall> wall = finder.find(measures[i]))
        graph.walls[at(id)].push_back(*wall);
      else
        std::swap(faces[left++], faces[i]);
    }
    faces.resize(left);
  };
  join_cells(mesh, sides_of(mesh, graph.points, choose), graph);
  graph.cells_at.resize(at(mesh.GetNumberOfPoints()));
  vtkNew<vtkIdList> ids;
  for (vtkIdType id = 0; id < mesh.GetNumberOfCells(); ++id) {
    if (!graph.used[at(id)]) continue;
    mesh.GetCellPoints(id, ids);
    for (const vtkIdType point : *ids) graph.cells_at[at(graph.points.representative(point))].push_back(id);
  }
  return graph;
}

std::vector<vtkIdType> cells_around(vtkDataSet& mesh, const CellGraph& graph, vtkIdType id) {
  Ids around = graph.neighbours[at(id)];
  vtkNew<vtkIdList> points;
  mesh.GetCellPoints(id, points);
  for (const vtkIdType point : *points) {
    const Ids& cells = graph.cells_at[at(graph.points.representative(point))];
    std::copy_if(cells.begin(), cells.end(), std::back_inserter(around), [&](vtkIdType cell) { return cell != id; });
  }
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  return around;
}

}  // namespace tensorray
