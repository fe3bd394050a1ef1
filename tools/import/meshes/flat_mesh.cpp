#include "tools/import/meshes/flat_mesh.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <Eigen/Geometry>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDataSet.h>
#include <vtkGenericCell.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr double flatness = 1e-6;  // Of the mesh's diagonal.
constexpr double max_squares = 1 << 21;

/// Whether only cells of one, two or three dimensions are in a mesh: the greatest dimension.
int max_dimension(vtkDataSet& mesh, vtkGenericCell& cell) {
  int dimension = 0;
  for (vtkIdType id = 0; id < mesh.GetNumberOfCells() && dimension < 3; ++id) {
    mesh.GetCell(id, &cell);
    dimension = std::max(dimension, cell.GetCellDimension());
  }
  return dimension;
}

/// Calls visit(points) with the corners of the triangles or quadrilaterals that a two-dimensional cell consists of.
template <class Visit>
void for_each_part(vtkGenericCell& cell, const Visit& visit) {
  const auto id = [&](int i) { return cell.GetPointId(i); };
  const int type = cell.GetCellType();
  if (type == VTK_TRIANGLE) return visit(std::vector<vtkIdType>{id(0), id(1), id(2)});
  if (type == VTK_QUAD) return visit(std::vector<vtkIdType>{id(0), id(1), id(2), id(3)});
  if (type == VTK_PIXEL) return visit(std::vector<vtkIdType>{id(0), id(1), id(3), id(2)});
  vtkNew<vtkIdList> corners;
  vtkNew<vtkPoints> points;
  cell.Triangulate(0, corners, points);
  for (vtkIdType i = 0; i + 2 < corners->GetNumberOfIds(); i += 3)
    visit(std::vector<vtkIdType>{corners->GetId(i), corners->GetId(i + 1), corners->GetId(i + 2)});
}

Vector3d point_of(vtkDataSet& mesh, vtkIdType id) {
  Vector3d point;
  mesh.GetPoint(id, point.data());
  return point;
}

/// Twice the area of a part along `axis`: positive if it is counter-clockwise as seen against the axis.
double signed_area(vtkDataSet& mesh, const std::vector<vtkIdType>& part, int axis) {
  Vector3d sum = Vector3d::Zero();
  const Vector3d first = point_of(mesh, part[0]);
  for (std::size_t i = 1; i + 1 < part.size(); ++i)
    sum += (point_of(mesh, part[i]) - first).cross(point_of(mesh, part[i + 1]) - first);
  return sum[axis];
}

/// The axis across which all points lie that cells have.
int axis_across(const Eigen::AlignedBox3d& box) {
  int axis = 0;
  const double thinnest = box.sizes().minCoeff(&axis);
  if (thinnest > flatness * box.diagonal().norm())
    throw std::invalid_argument(
        "the mesh has no three-dimensional cells, and its flat cells are a surface in space: a field needs tensors in "
        "a volume, or in a plane across x, y or z");
  return axis;
}

double typical_edge(vtkDataSet& mesh, vtkGenericCell& cell, int axis) {
  std::vector<double> areas;
  for (vtkIdType id = 0; id < mesh.GetNumberOfCells(); ++id) {
    mesh.GetCell(id, &cell);
    if (cell.GetCellDimension() != 2) continue;
    double area = 0;
    for_each_part(cell, [&](const auto& part) { area += 0.5 * std::abs(signed_area(mesh, part, axis)); });
    if (area > 0) areas.push_back(area);
  }
  if (areas.empty()) throw std::invalid_argument("the mesh's cells have no area");
  const auto middle = areas.begin() + static_cast<std::ptrdiff_t>(areas.size() / 2);
  std::nth_element(areas.begin(), middle, areas.end());
  return std::sqrt(*middle);
}

/// Adds a wedge or a hexahedron: a part at the lower points, and the same at the upper points.
void add_cell(vtkDataSet& mesh, std::vector<vtkIdType> part, int axis, vtkUnstructuredGrid& slab) {
  if (signed_area(mesh, part, axis) < 0) std::reverse(part.begin(), part.end());
  const std::size_t corners = part.size();
  for (std::size_t i = 0; i < corners; ++i) part.push_back(part[i] + mesh.GetNumberOfPoints());
  slab.InsertNextCell(corners == 3 ? VTK_WEDGE : VTK_HEXAHEDRON, static_cast<vtkIdType>(part.size()), part.data());
}

}  // namespace

void pad_vectors(vtkDataSet& mesh) {
  for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL}) {
    vtkDataSetAttributes& data = *mesh.GetAttributes(type);
    for (int i = 0; i < data.GetNumberOfArrays(); ++i) {
      vtkDataArray* const array = data.GetArray(i);
      if (!array || array->GetNumberOfComponents() != 2 || !array->GetName()) continue;
      const auto padded = vtkSmartPointer<vtkDataArray>::Take(array->NewInstance());
      padded->SetName(array->GetName());
      padded->SetNumberOfComponents(3);
      padded->SetNumberOfTuples(array->GetNumberOfTuples());
      padded->Fill(0);
      for (int component = 0; component < 2; ++component) padded->CopyComponent(component, array, component);
      data.AddArray(padded);  // Replaces the one of the same name, at the same index.
    }
  }
}

std::optional<FlatMesh> flat_mesh(vtkDataSet& mesh) {
  vtkNew<vtkGenericCell> cell;
  if (max_dimension(mesh, *cell) != 2) return {};
  Eigen::AlignedBox3d box;
  for (vtkIdType id = 0; id < mesh.GetNumberOfCells(); ++id) {
    mesh.GetCell(id, cell);
    if (cell->GetCellDimension() != 2) continue;
    for (vtkIdType i = 0; i < cell->GetNumberOfPoints(); ++i)
      box.extend(point_of(mesh, cell->GetPointId(static_cast<int>(i))));
  }
  FlatMesh flat;
  flat.axis = axis_across(box);
  Vector3d sizes = box.sizes();
  sizes[flat.axis] = 1;
  flat.edge = std::max(typical_edge(mesh, *cell, flat.axis), std::sqrt(sizes.prod() / max_squares));
  return flat;
}

vtkSmartPointer<vtkDataSet> slab_of(vtkDataSet& mesh, const FlatMesh& flat, double thickness) {
  const vtkIdType count = mesh.GetNumberOfPoints();
  auto slab = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(2 * count);
  slab->GetPointData()->CopyAllOn();
  slab->GetPointData()->CopyAllocate(mesh.GetPointData(), 2 * count);
  for (vtkIdType id = 0; id < 2 * count; ++id) {
    Vector3d point = point_of(mesh, id % count);
    point[flat.axis] += id < count ? -0.5 * thickness : 0.5 * thickness;
    points->SetPoint(id, point.data());
    slab->GetPointData()->CopyData(mesh.GetPointData(), id % count, id);
  }
  slab->SetPoints(points);
  slab->Allocate(mesh.GetNumberOfCells());
  slab->GetCellData()->CopyAllOn();
  slab->GetCellData()->CopyAllocate(mesh.GetCellData(), mesh.GetNumberOfCells());
  vtkNew<vtkGenericCell> cell;
  for (vtkIdType id = 0; id < mesh.GetNumberOfCells(); ++id) {
    mesh.GetCell(id, cell);
    if (cell->GetCellDimension() != 2) continue;
    for_each_part(*cell, [&](const std::vector<vtkIdType>& part) {
      slab->GetCellData()->CopyData(mesh.GetCellData(), id, slab->GetNumberOfCells());
      add_cell(mesh, part, flat.axis, *slab);
    });
  }
  if (flat.axis == 2) pad_vectors(*slab);
  return slab;
}

}  // namespace tensorray
