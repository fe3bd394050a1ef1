#include "tools/import/vtk_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <stdexcept>
#include <string>

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSetReader.h>
#include <vtkDoubleArray.h>
#include <vtkExodusIIReader.h>
#include <vtkGenericCell.h>
#include <vtkIdTypeArray.h>
#include <vtkImageData.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkOpenFOAMReader.h>
#include <vtkPointData.h>
#include <vtkPointSet.h>
#include <vtkRectilinearGrid.h>
#include <vtkStructuredGrid.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLPImageDataReader.h>
#include <vtkXMLPRectilinearGridReader.h>
#include <vtkXMLPStructuredGridReader.h>
#include <vtkXMLRectilinearGridReader.h>
#include <vtkXMLStructuredGridReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include "tools/import/vtk_kind.h"
#include "tools/import/vtk_messages.h"
#include "tools/import/vtk_pieces.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

template <typename Reader>
vtkSmartPointer<vtkDataObject> read_xml(const Path& path) {
  vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutputDataObject(0);
}

/// Piece by piece: VTK's own reader of pieces strings them together with every seam's points twice.
vtkSmartPointer<vtkDataObject> read_unstructured_pieces(const Path& path) {
  auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
  unsigned int index = 0;
  for (const Path& piece : piece_files(path)) {
    blocks->SetBlock(index++, read_xml<vtkXMLUnstructuredGridReader>(piece));
  }
  return blocks;
}

/// Without these the first array of each kind alone would be read.
vtkSmartPointer<vtkDataObject> read_legacy(const Path& path) {
  vtkNew<vtkDataSetReader> reader;
  reader->SetFileName(path.c_str());
  reader->ReadAllScalarsOn();
  reader->ReadAllVectorsOn();
  reader->ReadAllNormalsOn();
  reader->ReadAllTensorsOn();
  reader->ReadAllFieldsOn();
  reader->Update();
  return reader->GetOutputDataObject(0);
}

/// The mesh as it was meshed: VTK would move its points by an array that looks like a displacement.
vtkSmartPointer<vtkDataObject> read_exodus(const Path& path) {
  vtkNew<vtkExodusIIReader> reader;
  reader->SetFileName(path.c_str());
  reader->ApplyDisplacementsOff();
  reader->UpdateInformation();
  for (const auto kind : {vtkExodusIIReader::NODAL, vtkExodusIIReader::ELEM_BLOCK}) {
    for (int i = 0; i < reader->GetNumberOfObjectArrays(kind); ++i) {
      reader->SetObjectArrayStatus(kind, reader->GetObjectArrayName(kind, i), 1);
    }
  }
  for (int i = 0; i < reader->GetNumberOfObjects(vtkExodusIIReader::ELEM_BLOCK); ++i) {
    reader->SetObjectStatus(vtkExodusIIReader::ELEM_BLOCK, i, 1);
  }
  if (const int steps = reader->GetNumberOfTimeSteps(); steps > 0) reader->SetTimeStep(steps - 1);
  reader->Update();
  return reader->GetOutputDataObject(0);
}

vtkSmartPointer<vtkDataObject> read_openfoam(const Path& path) {
  const Path dictionary = openfoam_case(path) / "system" / "controlDict";
  vtkNew<vtkOpenFOAMReader> reader;
  reader->SetFileName(dictionary.c_str());
  reader->SkipZeroTimeOff();
  reader->UpdateInformation();
  reader->DisableAllPatchArrays();
  reader->SetPatchArrayStatus("internalMesh", 1);
  reader->EnableAllCellArrays();
  reader->EnableAllPointArrays();
  if (vtkDoubleArray* const times = reader->GetTimeValues(); times && times->GetNumberOfTuples() > 0) {
    const double* const begin = times->GetPointer(0);
    reader->UpdateTimeStep(*std::max_element(begin, begin + times->GetNumberOfTuples()));
  }
  reader->Update();
  return reader->GetOutputDataObject(0);
}

vtkSmartPointer<vtkDataObject> read_kind(VtkKind kind, const Path& path) {
  switch (kind) {
    case VtkKind::legacy:
      return read_legacy(path);
    case VtkKind::image:
      return read_xml<vtkXMLImageDataReader>(path);
    case VtkKind::rectilinear:
      return read_xml<vtkXMLRectilinearGridReader>(path);
    case VtkKind::structured:
      return read_xml<vtkXMLStructuredGridReader>(path);
    case VtkKind::unstructured:
      return read_xml<vtkXMLUnstructuredGridReader>(path);
    case VtkKind::image_pieces:
      return read_xml<vtkXMLPImageDataReader>(path);
    case VtkKind::rectilinear_pieces:
      return read_xml<vtkXMLPRectilinearGridReader>(path);
    case VtkKind::structured_pieces:
      return read_xml<vtkXMLPStructuredGridReader>(path);
    case VtkKind::unstructured_pieces:
      return read_unstructured_pieces(path);
    case VtkKind::exodus:
      return read_exodus(path);
    case VtkKind::openfoam:
      return read_openfoam(path);
  }
  throw std::logic_error("read_kind: unknown kind");
}

/// So that nobody need give the order that VTK has brought OpenFOAM's symmTensors into.
void name_symmetric_components(vtkDataSet& data) {
  const char* const names[] = {"XX", "YY", "ZZ", "XY", "YZ", "XZ"};
  for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL}) {
    for (int i = 0; i < data.GetAttributes(type)->GetNumberOfArrays(); ++i) {
      vtkDataArray* const array = data.GetAttributes(type)->GetArray(i);
      if (!array || array->GetNumberOfComponents() != 6) continue;
      for (int component = 0; component < 6; ++component) array->SetComponentName(component, names[component]);
    }
  }
}

[[noreturn]] void fail_geometry(const Path& path, const std::string& what) {
  throw std::runtime_error(path.string() + ": is damaged, or not of the form it seems: " + what + "; write it again");
}

/// False of NaN too. No unit makes larger ones sensible, and sampling cannot divide their span into voxels.
bool is_coordinate(double x) { return std::abs(x) <= 1e30; }

void check_coordinates(const Path& path, const std::string& name, vtkDataArray* values) {
  for (vtkIdType i = 0; i < values->GetNumberOfTuples(); ++i) {
    for (int axis = 0; axis < values->GetNumberOfComponents(); ++axis) {
      if (is_coordinate(values->GetComponent(i, axis))) continue;
      fail_geometry(path, name + " " + std::to_string(i) + " is not finite, or beyond 1e30");
    }
  }
}

void check_image(const Path& path, vtkImageData& image) {
  const double* const bounds = image.GetBounds();
  if (std::all_of(image.GetSpacing(), image.GetSpacing() + 3, is_coordinate) &&
      std::all_of(image.GetOrigin(), image.GetOrigin() + 3, is_coordinate) &&
      std::all_of(bounds, bounds + 6, is_coordinate))
    return;
  fail_geometry(path, "its origin or spacing is not finite, or beyond 1e30");
}

/// A legacy file may hold fewer points, or coordinates of an axis, than its dimensions say.
void check_count(const Path& path, const std::string& name, vtkIdType count, vtkIdType needed) {
  if (count < needed)
    fail_geometry(path, "it has " + std::to_string(count) + " of " + std::to_string(needed) + " " + name);
}

void check_rectilinear(const Path& path, vtkRectilinearGrid& grid) {
  vtkDataArray* const coordinates[] = {grid.GetXCoordinates(), grid.GetYCoordinates(), grid.GetZCoordinates()};
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, static_cast<char>('x' + axis));
    check_count(path, name + " coordinates", coordinates[axis]->GetNumberOfTuples(), grid.GetDimensions()[axis]);
    check_coordinates(path, name + " coordinate", coordinates[axis]);
  }
}

/// How many points a cell of each type has at least: those of fixed number have it when they are made.
std::array<vtkIdType, 256> least_points() {
  std::array<vtkIdType, 256> counts{};
  for (int type = 0; type <= VTK_POLYHEDRON; ++type) {
    vtkSmartPointer<vtkCell> cell;
    cell.TakeReference(vtkGenericCell::InstantiateCell(type));
    if (cell) counts[static_cast<std::size_t>(type)] = cell->GetNumberOfPoints();
  }
  return counts;
}

/// The faces of polyhedra: at each one's location their number, and of each face its points' number and the points.
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
        fail_geometry(path, "the faces of cell " + std::to_string(id) + " have points that are not there");
      return value;
    };
    for (vtkIdType face = next(VTK_ID_MAX); face > 0; --face)
      for (vtkIdType corner = next(VTK_ID_MAX); corner > 0; --corner) next(points);
  }
}

/// VTK follows the cells' points wherever they lead.
void check_cells(const Path& path, vtkUnstructuredGrid& grid) {
  static const std::array<vtkIdType, 256> least = least_points();
  vtkDataArray& offsets = *grid.GetCells()->GetOffsetsArray();
  vtkDataArray& ids = *grid.GetCells()->GetConnectivityArray();
  const vtkUnsignedCharArray* const types = grid.GetCellTypesArray();
  const vtkIdType cells = grid.GetNumberOfCells();
  if (!types || types->GetNumberOfValues() < cells) fail_geometry(path, "it has fewer types of cells than cells");
  for (vtkIdType id = 0; id < cells; ++id) {
    const auto begin = static_cast<vtkIdType>(offsets.GetComponent(id, 0));
    const auto end = static_cast<vtkIdType>(offsets.GetComponent(id + 1, 0));
    if (begin < 0 || end < begin || end > ids.GetNumberOfValues() || end - begin < least[types->GetValue(id)])
      fail_geometry(path, "cell " + std::to_string(id) + " has fewer points than its type needs, or a wrong offset");
  }
  double range[2] = {0, 0};
  if (ids.GetNumberOfValues() > 0) ids.GetRange(range, 0);
  const vtkIdType points = grid.GetNumberOfPoints();
  if (range[0] < 0 || (ids.GetNumberOfValues() > 0 && range[1] >= static_cast<double>(points))) {
    const auto wrong = static_cast<vtkIdType>(range[0] < 0 ? range[0] : range[1]);
    fail_geometry(path, "a cell has point " + std::to_string(wrong) + " of " + std::to_string(points) + " (from 0)");
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

vtkSmartPointer<vtkDataSet> read_vtk_source(const Path& path) {
  const VtkKind kind = vtk_kind(path);
  const VtkMessages messages;
  vtkSmartPointer<vtkDataSet> result;
  try {
    const DataSets pieces = data_sets_in(read_kind(kind, path));
    messages.throw_error(path);
    for (vtkDataSet* const piece : pieces) check_geometry(*piece, path);
    result = one_data_set(pieces);
  } catch (const std::bad_alloc&) {
    throw std::runtime_error(path.string() + ": is damaged, or too large: it announces more than memory holds");
  }
  messages.throw_error(path);
  if (!result) {
    const std::string& warning = messages.first_warning();
    throw std::runtime_error(path.string() + ": holds no cells" + (warning.empty() ? "" : ": " + warning));
  }
  if (kind == VtkKind::openfoam) name_symmetric_components(*result);
  return result;
}

}  // namespace tensorray
