#include "tools/import/vtk/vtk_pieces.h"

#include <array>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <vtkAppendFilter.h>
#include <vtkCellData.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>

namespace tensorray {
namespace {

/// Collects shallow copies, so that arrays can be added and removed.
void collect(vtkDataObject* data, DataSets& pieces) {
  if (auto* const tree = vtkCompositeDataSet::SafeDownCast(data)) {
    vtkSmartPointer<vtkCompositeDataIterator> leaf;
    leaf.TakeReference(tree->NewIterator());
    for (leaf->InitTraversal(); !leaf->IsDoneWithTraversal(); leaf->GoToNextItem()) {
      collect(leaf->GetCurrentDataObject(), pieces);
    }
  } else if (auto* const set = vtkDataSet::SafeDownCast(data); set && set->GetNumberOfCells() > 0) {
    pieces.emplace_back().TakeReference(set->NewInstance());
    pieces.back()->ShallowCopy(set);
  }
}

/// Keeps only `bits` of the ghost array of `attributes`; removes the array if all its values become zero.
void keep_ghosts(vtkDataSetAttributes& attributes, unsigned char bits) {
  const char* const name = vtkDataSetAttributes::GhostArrayName();
  const auto* const ghosts = vtkUnsignedCharArray::SafeDownCast(attributes.GetArray(name));
  if (!ghosts) return;
  vtkNew<vtkUnsignedCharArray> kept;
  kept->SetName(name);
  kept->SetNumberOfValues(ghosts->GetNumberOfValues());
  bool any = false;
  for (vtkIdType i = 0; i < kept->GetNumberOfValues(); ++i) {
    kept->SetValue(i, ghosts->GetValue(i) & bits);
    any = any || kept->GetValue(i) != 0;
  }
  attributes.RemoveArray(name);
  if (any) attributes.AddArray(kept);
}

/// Marks only what is hidden; refined cells are covered by others. Copies of neighbours' cells and points have the
/// neighbours' values, and stay.
void keep_hidden(vtkDataSet& piece) {
  keep_ghosts(*piece.GetCellData(), vtkDataSetAttributes::HIDDENCELL | vtkDataSetAttributes::REFINEDCELL);
  keep_ghosts(*piece.GetPointData(), vtkDataSetAttributes::HIDDENPOINT);
}

const vtkUnsignedCharArray* ghosts_of(vtkDataSetAttributes& attributes) {
  return vtkUnsignedCharArray::SafeDownCast(attributes.GetArray(vtkDataSetAttributes::GhostArrayName()));
}

/// The piece without the cells that are to be left out beside other pieces: copies of neighbours' cells, hidden cells,
/// and those with a hidden point.
vtkSmartPointer<vtkDataSet> used_part(vtkDataSet& piece) {
  const auto* const cells = ghosts_of(*piece.GetCellData());
  const auto* const points = ghosts_of(*piece.GetPointData());
  if (!cells && !points) return &piece;
  constexpr unsigned char used = 0, copy = vtkDataSetAttributes::DUPLICATECELL;
  constexpr unsigned char unused =
      vtkDataSetAttributes::DUPLICATECELL | vtkDataSetAttributes::HIDDENCELL | vtkDataSetAttributes::REFINEDCELL;
  vtkNew<vtkUnsignedCharArray> marks;
  marks->SetName(vtkDataSetAttributes::GhostArrayName());
  vtkNew<vtkIdList> ids;
  for (vtkIdType cell = 0; cell < piece.GetNumberOfCells(); ++cell) {
    bool is_unused = cells && (cells->GetValue(cell) & unused) != 0;
    piece.GetCellPoints(cell, ids);
    for (vtkIdType i = 0; points && i < ids->GetNumberOfIds(); ++i)
      is_unused = is_unused || (points->GetValue(ids->GetId(i)) & vtkDataSetAttributes::HIDDENPOINT) != 0;
    marks->InsertNextValue(is_unused ? copy : used);
  }
  for (vtkDataSetAttributes* const data : {static_cast<vtkDataSetAttributes*>(piece.GetPointData()),
                                           static_cast<vtkDataSetAttributes*>(piece.GetCellData())})
    data->RemoveArray(vtkDataSetAttributes::GhostArrayName());
  vtkNew<vtkAppendFilter> to_unstructured;
  to_unstructured->AddInputData(&piece);
  to_unstructured->Update();
  const vtkSmartPointer<vtkUnstructuredGrid> grid = to_unstructured->GetOutput();
  grid->GetCellData()->AddArray(marks);
  grid->RemoveGhostCells();  // Those that are marked as copies.
  grid->GetCellData()->RemoveArray(vtkDataSetAttributes::GhostArrayName());
  return grid;
}

/// Adds missing arrays, because vtkAppendFilter drops arrays that some of its inputs lack.
void complete_arrays(const DataSets& pieces, vtkDataObject::AttributeTypes type) {
  std::map<std::string, vtkDataArray*> wanted;
  for (vtkDataSet* const piece : pieces) {
    vtkDataSetAttributes& arrays = *piece->GetAttributes(type);
    for (int i = 0; i < arrays.GetNumberOfArrays(); ++i) {
      if (vtkDataArray* const array = arrays.GetArray(i); array && array->GetName()) wanted[array->GetName()] = array;
    }
  }
  for (vtkDataSet* const piece : pieces) {
    for (const auto& [name, like] : wanted) {
      if (piece->GetAttributes(type)->HasArray(name.c_str())) continue;
      vtkSmartPointer<vtkDataArray> filled;
      filled.TakeReference(like->NewInstance());
      filled->SetName(name.c_str());
      filled->SetNumberOfComponents(like->GetNumberOfComponents());
      filled->SetNumberOfTuples(piece->GetNumberOfElements(type));
      const bool real = like->GetDataType() == VTK_FLOAT || like->GetDataType() == VTK_DOUBLE;
      filled->Fill(real ? std::numeric_limits<double>::quiet_NaN() : 0.0);
      piece->GetAttributes(type)->AddArray(filled);
    }
  }
}

/// Gives each point of `all` the values of the first piece that has it and the array. The cells of `all` are those of
/// the pieces, in their order.
void take_known_values(vtkUnstructuredGrid& all, const DataSets& pieces,
                       const std::vector<std::set<std::string>>& known) {
  vtkNew<vtkIdList> from, to;
  vtkIdType end = all.GetNumberOfCells();
  for (std::size_t k = pieces.size(); k-- > 0;) {
    vtkDataSet& piece = *pieces[k];
    end -= piece.GetNumberOfCells();
    for (vtkIdType cell = 0; cell < piece.GetNumberOfCells(); ++cell) {
      piece.GetCellPoints(cell, from);
      all.GetCellPoints(end + cell, to);
      for (const std::string& name : known[k]) {
        vtkDataArray* const values = piece.GetPointData()->GetArray(name.c_str());
        vtkDataArray* const merged = all.GetPointData()->GetArray(name.c_str());
        for (vtkIdType i = 0; merged && i < from->GetNumberOfIds() && i < to->GetNumberOfIds(); ++i)
          merged->SetTuple(to->GetId(i), from->GetId(i), values);
      }
    }
  }
}

/// The names of the numeric arrays at points.
std::set<std::string> point_arrays(vtkDataSet& piece) {
  std::set<std::string> names;
  for (int i = 0; i < piece.GetPointData()->GetNumberOfArrays(); ++i)
    if (vtkDataArray* const array = piece.GetPointData()->GetArray(i); array && array->GetName())
      names.insert(array->GetName());
  return names;
}

}  // namespace

DataSets data_sets_in(vtkDataObject* data) {
  DataSets pieces;
  collect(data, pieces);
  return pieces;
}

bool is_same_mesh(vtkDataSet& a, vtkDataSet& b) {
  if (a.GetNumberOfPoints() != b.GetNumberOfPoints() || a.GetNumberOfCells() != b.GetNumberOfCells()) return false;
  for (vtkIdType i = 0; i < a.GetNumberOfPoints(); ++i) {
    std::array<double, 3> x{}, y{};
    a.GetPoint(i, x.data());
    b.GetPoint(i, y.data());
    if (x != y) return false;
  }
  return true;
}

vtkSmartPointer<vtkDataSet> one_data_set(const DataSets& given, bool merges_points) {
  if (given.empty()) return nullptr;
  if (given.size() == 1) {
    keep_hidden(*given.front());
    return given.front();
  }
  DataSets pieces;
  std::vector<std::set<std::string>> known;
  for (vtkDataSet* const piece : given) {
    pieces.push_back(used_part(*piece));
    known.push_back(point_arrays(*pieces.back()));
  }
  complete_arrays(pieces, vtkDataObject::POINT);
  complete_arrays(pieces, vtkDataObject::CELL);
  vtkNew<vtkAppendFilter> append;
  append->SetMergePoints(merges_points);
  append->SetTolerance(0);
  append->SetOutputPointsPrecision(vtkAlgorithm::DEFAULT_PRECISION);
  for (vtkDataSet* const piece : pieces) append->AddInputData(piece);
  append->Update();
  const vtkSmartPointer<vtkUnstructuredGrid> all = append->GetOutput();
  take_known_values(*all, pieces, known);
  return all;
}

}  // namespace tensorray
