#include "tools/import/meshes/cell_graph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <optional>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <vtkCellType.h>
#include <vtkDataSet.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStaticCellLocator.h>
#include <vtkStaticPointLocator.h>

#include "tools/import/meshes/mesh_cell.h"

namespace tensorray {
namespace {

using Vector3 = Eigen::Vector3d;
using Ids = std::vector<vtkIdType>;

std::string walls_of(const std::string& array) { return "walls of " + array; }

std::size_t at(vtkIdType id) { return static_cast<std::size_t>(id); }

/// Calls visit(id, cell) on all threads for the cells of the mesh that MeshCell loads.
template <class Visit>
void for_each_cell(vtkDataSet& mesh, const Visit& visit) {
  using Range = tbb::blocked_range<vtkIdType>;
  MeshCell().load(mesh, 0);
  tbb::parallel_for(Range(0, mesh.GetNumberOfCells(), 1024), [&](const Range& range) {
    MeshCell cell;
    for (vtkIdType id = range.begin(); id < range.end(); ++id)
      if (cell.load(mesh, id)) visit(id, cell);
  });
}

/// A face of a cell: its corners, counter-clockwise or clockwise, and its area, which points out of the cell.
struct GraphFace {
  vtkIdType cell = 0;
  Ids corners;
  Eigen::Matrix3Xd positions;
  FaceMeasure measure;
};

GraphFace face_of(MeshCell& cell, vtkIdType id, int index) {
  vtkCell& face = *cell.vtk().GetFace(index);
  GraphFace result{id, {}, Eigen::Matrix3Xd(3, face.GetNumberOfEdges()), {}};
  for (int i = 0; i < face.GetNumberOfEdges(); ++i) {
    const int corner = face.GetCellType() == VTK_PIXEL && i > 1 ? 5 - i : i;
    result.corners.push_back(face.GetPointId(corner));
    face.GetPoints()->GetPoint(corner, result.positions.col(i).data());
  }
  result.measure = face_measure(result.positions);
  const Vector3 outwards = result.measure.centre - cell.positions().rowwise().mean();
  if (result.measure.area.dot(outwards) < 0) result.measure.area *= -1;
  return result;
}

/// The centroid of the pyramids between the cell's faces and its mean point.
Vector3 centroid(MeshCell& cell) {
  const Vector3 mean = cell.positions().rowwise().mean();
  double volume = 0;
  Vector3 moment = Vector3::Zero();
  for (int i = 0; i < cell.vtk().GetNumberOfFaces(); ++i) {
    const FaceMeasure face = face_of(cell, 0, i).measure;
    const double pyramid = face.area.dot(face.centre - mean);
    volume += pyramid;
    moment += 0.75 * pyramid * (face.centre - mean);
  }
  return volume > 0 ? Vector3(mean + moment / volume) : mean;
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
  std::optional<Wall> find(const FaceMeasure& face, vtkIdList& scratch) const {
    if (points_->GetNumberOfPoints() == 0) return {};
    locator_->FindPointsWithinRadius(tolerance_, face.centre.data(), &scratch);
    for (const vtkIdType i : scratch) {
      const double* const numbers = walls_->GetPointer(10 * i);
      const Wall wall{Vector3(numbers), Vector3(numbers + 3), static_cast<Wall::Kind>(numbers[6]),
                      Vector3(numbers + 7)};
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

/// Whether the cell has the point, which represents all at its position.
bool is_at(const CellGraph& graph, vtkIdType cell, vtkIdType point) {
  const auto from = [&](vtkIdType p) { return graph.cells.begin() + static_cast<std::ptrdiff_t>(graph.first[at(p)]); };
  return std::binary_search(from(point), from(point + 1), cell);
}

/// Appends the other cells that have all corners of a face. @return whether there are some.
bool find_across(const CellGraph& graph, const GraphFace& face, Ids& found) {
  const std::size_t before = found.size(), corner = at(graph.same[at(face.corners.front())]);
  for (std::size_t i = graph.first[corner]; i < graph.first[corner + 1]; ++i)
    if (graph.cells[i] != face.cell && std::all_of(face.corners.begin() + 1, face.corners.end(), [&](vtkIdType p) {
          return is_at(graph, graph.cells[i], graph.same[at(p)]);
        }))
      found.push_back(graph.cells[i]);
  return found.size() > before;
}

Ids coincident_points(vtkDataSet& mesh) {
  Ids same(at(mesh.GetNumberOfPoints()));
  vtkNew<vtkPoints> positions;
  positions->SetDataTypeToDouble();
  positions->SetNumberOfPoints(mesh.GetNumberOfPoints());
  for (vtkIdType i = 0; i < mesh.GetNumberOfPoints(); ++i) positions->SetPoint(i, mesh.GetPoint(i));
  vtkNew<vtkPolyData> cloud;
  cloud->SetPoints(positions);
  vtkNew<vtkStaticPointLocator> locator;
  locator->SetDataSet(cloud);
  locator->BuildLocator();
  locator->MergePoints(0, same.data());
  return same;
}

/// Fills `first` and `cells`.
void link_points(vtkDataSet& mesh, CellGraph& graph) {
  vtkNew<vtkIdList> ids;
  graph.first.assign(at(mesh.GetNumberOfPoints()) + 1, 0);
  const auto for_each_corner = [&](const auto& visit) {
    for (vtkIdType id = 0; id < mesh.GetNumberOfCells(); ++id) {
      if (!graph.used[at(id)]) continue;
      mesh.GetCellPoints(id, ids);
      for (const vtkIdType point : *ids) visit(id, at(graph.same[at(point)]));
    }
  };
  for_each_corner([&](vtkIdType, std::size_t point) { ++graph.first[point + 1]; });
  for (std::size_t i = 1; i < graph.first.size(); ++i) graph.first[i] += graph.first[i - 1];
  graph.cells.resize(graph.first.back());
  std::vector<std::size_t> next(graph.first.begin(), graph.first.end() - 1);
  for_each_corner([&](vtkIdType id, std::size_t point) { graph.cells[next[point]++] = id; });
}

/// Makes cells neighbours whose faces lie on each other without having the same corners.
void join_open_faces(std::vector<GraphFace>& faces, CellGraph& graph) {
  std::sort(faces.begin(), faces.end(),
            [](const auto& a, const auto& b) { return std::tie(a.cell, a.corners) < std::tie(b.cell, b.corners); });
  vtkNew<vtkPolyData> polygons;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  polygons->SetPoints(points);
  polygons->AllocateEstimate(static_cast<vtkIdType>(faces.size()), 4);
  for (const GraphFace& face : faces) {
    Ids ids;
    for (const auto& corner : face.positions.colwise()) ids.push_back(points->InsertNextPoint(corner.data()));
    polygons->InsertNextCell(VTK_POLYGON, static_cast<int>(ids.size()), ids.data());
  }
  if (faces.empty()) return;
  vtkNew<vtkStaticCellLocator> locator;
  locator->SetDataSet(polygons);
  locator->BuildLocator();
  vtkNew<vtkIdList> found;
  for (const GraphFace& face : faces) {
    const Eigen::AlignedBox3d box(face.positions.rowwise().minCoeff(), face.positions.rowwise().maxCoeff());
    constexpr double gap = 1e-3;  // Of curved faces that two blocks divide differently.
    const double reach = gap * box.diagonal().norm();
    const Vector3& centre = face.measure.centre;
    std::array<double, 6> bounds{};
    for (std::size_t k = 0; k < 6; ++k) bounds[k] = centre[static_cast<Eigen::Index>(k / 2)] + (k % 2 ? reach : -reach);
    locator->FindCellsWithinBounds(bounds.data(), found);
    for (const vtkIdType i : *found) {
      const GraphFace& other = faces[at(i)];
      const Vector3& area = other.measure.area;
      if (other.cell == face.cell || area.dot(face.measure.area) >= 0) continue;
      if (std::abs(area.normalized().dot(centre - other.measure.centre)) > reach) continue;
      graph.neighbours[at(face.cell)].push_back(other.cell);
    }
  }
}

/// Each cell becomes a neighbour of its neighbours.
void make_mutual(std::vector<Ids>& neighbours) {
  std::vector<std::size_t> counts;
  for (const Ids& ids : neighbours) counts.push_back(ids.size());
  for (std::size_t id = 0; id < neighbours.size(); ++id)
    for (std::size_t i = 0; i < counts[id]; ++i)
      neighbours[at(neighbours[id][i])].push_back(static_cast<vtkIdType>(id));
  tbb::parallel_for(std::size_t{0}, neighbours.size(), [&](std::size_t id) {
    Ids& ids = neighbours[id];
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  });
}

/// Finds the neighbours and the walls.
void link_cells(vtkDataSet& mesh, const WallFinder& finder, CellGraph& graph) {
  std::vector<GraphFace> open;
  std::mutex lock;
  for_each_cell(mesh, [&](vtkIdType id, MeshCell& cell) {
    if (!graph.used[at(id)]) return;
    vtkNew<vtkIdList> scratch;
    for (int i = 0; i < cell.vtk().GetNumberOfFaces(); ++i) {
      GraphFace face = face_of(cell, id, i);
      if (face.measure.area.isZero(0)) continue;
      if (const std::optional<Wall> wall = finder.find(face.measure, *scratch)) {
        graph.walls[at(id)].push_back(*wall);
      } else if (!find_across(graph, face, graph.neighbours[at(id)])) {
        const std::lock_guard<std::mutex> guard(lock);
        open.push_back(std::move(face));
      }
    }
  });
  join_open_faces(open, graph);
  make_mutual(graph.neighbours);
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

FaceMeasure face_measure(const Eigen::Matrix3Xd& corners) {
  const Vector3 mean = corners.rowwise().mean();
  FaceMeasure measure{Vector3::Zero(), Vector3::Zero()};
  Eigen::Matrix3Xd areas(3, corners.cols());
  const auto next = [&](Eigen::Index i) { return (i + 1) % corners.cols(); };
  for (Eigen::Index i = 0; i < corners.cols(); ++i) {
    const Vector3 from = corners.col(i) - mean, to = corners.col(next(i)) - mean;
    areas.col(i) = 0.5 * from.cross(to);
    measure.area += areas.col(i);
  }
  double sum = 0;
  for (Eigen::Index i = 0; i < corners.cols(); ++i) {
    const double area = areas.col(i).dot(measure.area);
    measure.centre += area * (corners.col(i) + corners.col(next(i)) - 2 * mean) / 3;
    sum += area;
  }
  measure.centre = sum > 0 ? Vector3(mean + measure.centre / sum) : mean;
  return measure;
}

CellGraph cell_graph(vtkDataSet& mesh, vtkDoubleArray& vectors) {
  CellGraph graph;
  const std::size_t count = at(mesh.GetNumberOfCells());
  graph.centres.resize(count);
  graph.used.resize(count);
  graph.neighbours.resize(count);
  graph.walls.resize(count);
  for_each_cell(mesh, [&](vtkIdType id, MeshCell& cell) {
    graph.used[at(id)] = Eigen::Map<const Vector3>(vectors.GetPointer(3 * id)).allFinite();
    graph.centres[at(id)] = centroid(cell);
  });
  graph.same = coincident_points(mesh);
  link_points(mesh, graph);
  link_cells(mesh, WallFinder(mesh, vectors), graph);
  return graph;
}

std::vector<vtkIdType> cells_around(vtkDataSet& mesh, const CellGraph& graph, vtkIdType id) {
  Ids around = graph.neighbours[at(id)];
  vtkNew<vtkIdList> points;
  mesh.GetCellPoints(id, points);
  for (const vtkIdType point : *points) {
    const std::size_t same = at(graph.same[at(point)]);
    for (std::size_t i = graph.first[same]; i < graph.first[same + 1]; ++i)
      if (graph.cells[i] != id) around.push_back(graph.cells[i]);
  }
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  return around;
}

}  // namespace tensorray
