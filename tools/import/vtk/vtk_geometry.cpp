#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellTypes.h>
#include <vtkDataArray.h>
#include <vtkGenericCell.h>
#include <vtkIdTypeArray.h>
#include <vtkImageData.h>
#include <vtkPoints.h>
#include <vtkRectilinearGrid.h>
#include <vtkSmartPointer.h>
#include <vtkStructuredGrid.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>

#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

[[noreturn]] void fail_form(const Path& path, const std::string& what) {
  throw std::runtime_error(path.string() + ": is damaged, or not of the form it seems: " + what + "; write it again");
}

/// Also false for NaN. Greater coordinates make no sense in any unit, and sampling could not divide their range into
/// voxels.
bool is_coordinate(double x) { return std::abs(x) <= 1e30; }

void check_coordinates(const Path& path, const std::string& name, vtkDataArray* values) {
  for (vtkIdType i = 0; i < values->GetNumberOfTuples(); ++i)
    for (int axis = 0; axis < values->GetNumberOfComponents(); ++axis)
      if (!is_coordinate(values->GetComponent(i, axis)))
        fail_form(path, name + " " + std::to_string(i) + " is not finite, or beyond 1e30");
}

void check_image(const Path& path, vtkImageData& image) {
  const double* const bounds = image.GetBounds();
  if (!std::all_of(image.GetSpacing(), image.GetSpacing() + 3, is_coordinate) ||
      !std::all_of(image.GetOrigin(), image.GetOrigin() + 3, is_coordinate) ||
      !std::all_of(bounds, bounds + 6, is_coordinate))
    fail_form(path, "its origin or spacing is not finite, or beyond 1e30");
}

/// A legacy file may hold fewer points or coordinates than its dimensions announce.
void check_count(const Path& path, const std::string& name, vtkIdType count, vtkIdType needed) {
  if (count < needed) fail_form(path, "it has " + std::to_string(count) + " of " + std::to_string(needed) + " " + name);
}

void check_rectilinear(const Path& path, vtkRectilinearGrid& grid) {
  vtkDataArray* const coordinates[] = {grid.GetXCoordinates(), grid.GetYCoordinates(), grid.GetZCoordinates()};
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, static_cast<char>('x' + axis));
    check_count(path, name + " coordinates", coordinates[axis]->GetNumberOfTuples(), grid.GetDimensions()[axis]);
    check_coordinates(path, name + " coordinate", coordinates[axis]);
  }
}

/// The least number of points of a cell of each type. New cells of a type with a fixed number already have that
/// number.
std::array<vtkIdType, 256> min_points() {
  std::array<vtkIdType, 256> counts{};
  for (int type = 0; type <= VTK_POLYHEDRON; ++type) {
    vtkSmartPointer<vtkCell> cell;
    cell.TakeReference(vtkGenericCell::InstantiateCell(type));
    if (cell) counts[static_cast<std::size_t>(type)] = cell->GetNumberOfPoints();
  }
  return counts;
}

/// The faces of polyhedra. At each location: the number of faces, and for each face the number of its points and the
/// points.
void check_faces(const Path& path, vtkUnstructuredGrid& grid) {
  vtkIdTypeArray* const faces = grid.GetFaces();
  vtkIdTypeArray* const locations = grid.GetFaceLocations();
  const vtkIdType points = grid.GetNumberOfPoints();
  for (vtkIdType id = 0; id < grid.GetNumberOfCells(); ++id) {
    if (grid.GetCellType(id) != VTK_POLYHEDRON) continue;
    vtkIdType at = faces && locations && id < locations->GetNumberOfValues() ? locations->GetValue(id) : -1;
    const auto next = [&](vtkIdType limit) {
      const vtkIdType value = at >= 0 && at < faces->GetNumberOfValues() ? faces->GetValue(at++) : -1;
      if (value < 0 || value >= limit)
        fail_form(path, "the faces of cell " + std::to_string(id) + " have points that are not there");
      return value;
    };
    for (vtkIdType face = next(VTK_ID_MAX); face > 0; --face)
      for (vtkIdType corner = next(VTK_ID_MAX); corner > 0; --corner) next(points);
  }
}

/// Types without a class, of which VTK makes empty cells; and Bézier wedges, as VTK's (9.1) writes beyond its arrays
/// when several threads use it.
bool cannot_be_read(int type) {
  if (type == VTK_BEZIER_WEDGE) return true;
  const auto cell = vtkSmartPointer<vtkCell>::Take(vtkGenericCell::InstantiateCell(type));
  return !cell;
}

void check_types(const Path& path, vtkUnstructuredGrid& grid) {
  vtkNew<vtkCellTypes> types;
  grid.GetCellTypes(types);
  for (vtkIdType i = 0; i < types->GetNumberOfTypes(); ++i) {
    const int type = types->GetCellType(i);
    if (!cannot_be_read(type)) continue;
    const std::string name = type < VTK_NUMBER_OF_CELL_TYPES ? vtkCellTypes::GetClassNameFromTypeId(type) : "";
    throw std::runtime_error(path.string() + ": has cells of type " + std::to_string(type) +
                             (name.empty() ? "" : " (" + name + ")") +
                             ", which cannot be read; save it with linear or Lagrange hexahedra, wedges or tetrahedra");
  }
}

/// The number of points of a Lagrange or Bézier cell with these degrees along its axes; 0 for other types, −1 if there
/// is no such cell.
double points_of(int type, const std::array<double, 3>& degrees) {
  const auto [x, y, z] = degrees;
  if (!(x >= 1 && y >= 1 && z >= 1)) return -1;
  if (type == VTK_LAGRANGE_HEXAHEDRON || type == VTK_BEZIER_HEXAHEDRON) return (x + 1) * (y + 1) * (z + 1);
  if (type == VTK_LAGRANGE_TETRAHEDRON || type == VTK_BEZIER_TETRAHEDRON)
    return x == y && y == z ? (x + 1) * (x + 2) * (x + 3) / 6 : -1;
  return type == VTK_LAGRANGE_WEDGE ? (x + 1) * (x + 2) / 2 * (z + 1) : 0;
}

/// VTK takes the order of a cell from its number of points, or from an array of degrees, and reads that many points.
void check_order(const Path& path, vtkUnstructuredGrid& grid, vtkIdType id, vtkIdType points) {
  const int type = grid.GetCellType(id);
  if (points_of(type, {1, 1, 1}) == 0) return;
  if (type == VTK_LAGRANGE_WEDGE && points == 21) return;  // With a point in the middle of each face.
  vtkDataArray* const degrees = grid.GetCellData()->GetHigherOrderDegrees();
  std::array<double, 3> degree{};
  bool fits = false;
  constexpr int max_order = 10;  // VTK's.
  for (int order = 1; !degrees && !fits && order <= max_order; ++order) {
    degree.fill(order);
    fits = points_of(type, degree) == static_cast<double>(points);
  }
  if (degrees && degrees->GetNumberOfComponents() == 3) {
    degrees->GetTuple(id, degree.data());
    fits = points_of(type, degree) == static_cast<double>(points);
  }
  if (!fits)
    fail_form(path, "cell " + std::to_string(id) + " has " + std::to_string(points) +
                        " points, which fit no order of its type");
}

/// VTK does not check the point indices of cells.
void check_cells(const Path& path, vtkUnstructuredGrid& grid) {
  static const std::array<vtkIdType, 256> least = min_points();
  vtkDataArray& offsets = *grid.GetCells()->GetOffsetsArray();
  vtkDataArray& ids = *grid.GetCells()->GetConnectivityArray();
  const vtkUnsignedCharArray* const types = grid.GetCellTypesArray();
  const vtkIdType cells = grid.GetNumberOfCells();
  if (!types || types->GetNumberOfValues() < cells) fail_form(path, "it has fewer types of cells than cells");
  check_types(path, grid);
  for (vtkIdType id = 0; id < cells; ++id) {
    const auto begin = static_cast<vtkIdType>(offsets.GetComponent(id, 0));
    const auto end = static_cast<vtkIdType>(offsets.GetComponent(id + 1, 0));
    if (begin < 0 || end < begin || end > ids.GetNumberOfValues() || end - begin < least[types->GetValue(id)])
      fail_form(path, "cell " + std::to_string(id) + " has fewer points than its type needs, or a wrong offset");
    check_order(path, grid, id, end - begin);
  }
  double range[2] = {0, 0};
  if (ids.GetNumberOfValues() > 0) ids.GetRange(range, 0);
  const vtkIdType points = grid.GetNumberOfPoints();
  if (range[0] < 0 || (ids.GetNumberOfValues() > 0 && range[1] >= static_cast<double>(points))) {
    const auto wrong = static_cast<vtkIdType>(range[0] < 0 ? range[0] : range[1]);
    fail_form(path, "a cell has point " + std::to_string(wrong) + " of " + std::to_string(points) + " (from 0)");
  }
  check_faces(path, grid);
}

}  // namespace

void check_geometry(vtkDataSet& data, const Path& path) {
  if (auto* const image = vtkImageData::SafeDownCast(&data)) check_image(path, *image);
  if (auto* const grid = vtkRectilinearGrid::SafeDownCast(&data)) check_rectilinear(path, *grid);
  if (auto* const grid = vtkStructuredGrid::SafeDownCast(&data)) {
    int size[3];
    grid->GetDimensions(size);
    check_count(path, "points", grid->GetNumberOfPoints(), vtkIdType{size[0]} * size[1] * size[2]);
  }
  if (auto* const set = vtkPointSet::SafeDownCast(&data); set && set->GetPoints())
    check_coordinates(path, "point", set->GetPoints()->GetData());
  if (auto* const grid = vtkUnstructuredGrid::SafeDownCast(&data)) check_cells(path, *grid);
}

}  // namespace tensorray
