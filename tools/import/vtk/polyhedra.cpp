#include <algorithm>

#include <vtkDataArray.h>
#include <vtkIdTypeArray.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLUnstructuredGridReader.h>

#include "base/errors.h"
#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {
namespace {

using Ids = std::vector<vtkIdType>;

/// Calls `visit` for the values of part `i` of a list. @return false if the list has no such part.
template <class Visit>
bool for_each_value(const Ids& values, const Ids& ends, vtkIdType i, const Visit& visit) {
  const auto part = static_cast<std::size_t>(i);
  if (i < 0 || part >= ends.size()) return false;
  const vtkIdType begin = part == 0 ? 0 : ends[part - 1], end = ends[part];
  if (begin < 0 || end < begin || static_cast<std::size_t>(end) > values.size()) return false;
  return std::all_of(values.begin() + begin, values.begin() + end, visit);
}

/// The number of values that a list of indices, or of ends, needs.
vtkIdType greatest(const Ids& values) { return values.empty() ? 0 : *std::max_element(values.begin(), values.end()); }

/// Also reads the tables of faces of each piece of the file.
class VtuReader : public vtkXMLUnstructuredGridReader {
 public:
  static VtuReader* New();
  vtkTypeMacro(VtuReader, vtkXMLUnstructuredGridReader)

      vtkNew<vtkIdTypeArray> locations,
      faces;
  bool is_damaged = false, has_tables = false;

 protected:
  int ReadPieceData() override {
    if (Superclass::ReadPieceData() == 0) return 0;
    const vtkIdType count = NumberOfCells[Piece];
    FaceTables tables;
    tables.face_ends.assign(static_cast<std::size_t>(count), 0);
    if (table("polyhedron_to_faces")) {
      has_tables = true;
      tables.face_ends = values_of("polyhedron_offsets", count);
      tables.faces = values_of("polyhedron_to_faces", greatest(tables.face_ends));
      tables.point_ends = values_of("face_offsets", tables.faces.empty() ? 0 : greatest(tables.faces) + 1);
      tables.points = values_of("face_connectivity", greatest(tables.point_ends));
    }
    is_damaged = !append_faces(tables, StartPoint, *locations, *faces) || is_damaged;
    return 1;
  }

 private:
  vtkXMLDataElement* table(const char* name) {
    return CellElements[Piece] ? CellElements[Piece]->FindNestedElementWithNameAndAttribute("DataArray", "Name", name)
                               : nullptr;
  }

  /// The first values of an array. Empty if it has fewer.
  Ids values_of(const char* name, vtkIdType count) {
    const auto made = vtkSmartPointer<vtkAbstractArray>::Take(table(name) ? CreateArray(table(name)) : nullptr);
    auto* const array = vtkDataArray::SafeDownCast(made);
    if (!array || count <= 0) return {};
    array->SetNumberOfComponents(1);
    array->SetNumberOfTuples(count);
    if (ReadArrayValues(table(name), 0, array, 0, count) == 0) return {};
    Ids values;
    for (vtkIdType i = 0; i < count; ++i) values.push_back(static_cast<vtkIdType>(array->GetComponent(i, 0)));
    return values;
  }
};

vtkStandardNewMacro(VtuReader);

}  // namespace

bool append_faces(const FaceTables& tables, vtkIdType first_point, vtkIdTypeArray& locations, vtkIdTypeArray& faces) {
  const auto append = [&faces](const Ids& values, const Ids& ends, vtkIdType part, const auto& visit) {
    const vtkIdType start = faces.InsertNextValue(0);
    return for_each_value(values, ends, part, [&](vtkIdType value) {
      faces.SetValue(start, faces.GetValue(start) + 1);
      return visit(value);
    });
  };
  const auto add_point = [&](vtkIdType point) { return faces.InsertNextValue(first_point + point) >= 0; };
  const auto add_face = [&](vtkIdType face) { return append(tables.points, tables.point_ends, face, add_point); };
  for (std::size_t cell = 0; cell < tables.face_ends.size(); ++cell) {
    const vtkIdType start = faces.GetNumberOfValues();
    if (!append(tables.faces, tables.face_ends, static_cast<vtkIdType>(cell), add_face)) return false;
    const bool has_faces = faces.GetValue(start) > 0;
    if (!has_faces) faces.SetNumberOfValues(start);
    locations.InsertNextValue(has_faces ? start : -1);
  }
  return true;
}

vtkSmartPointer<vtkUnstructuredGrid> read_vtu(const std::filesystem::path& path) {
  vtkNew<VtuReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkUnstructuredGrid* const grid = reader->GetOutput();
  if (reader->is_damaged) fail(path, "is damaged: its polyhedra name faces that are not there; copy or write it again");
  if (reader->has_tables && grid->GetNumberOfCells() == reader->locations->GetNumberOfValues())
    grid->SetCells(grid->GetCellTypesArray(), grid->GetCells(), reader->locations, reader->faces);
  return grid;
}

}  // namespace tensorray
