#include "tools/import/vtk/vtk_pieces.h"

#include <limits>
#include <map>
#include <string>
#include <vector>

#include <vtkAppendFilter.h>
#include <vtkCellData.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
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

void remove_ghosts(vtkDataSet& piece) {
  if (auto* const grid = vtkUnstructuredGrid::SafeDownCast(&piece)) {
    keep_ghosts(*grid->GetCellData(), vtkDataSetAttributes::DUPLICATECELL | vtkDataSetAttributes::HIDDENCELL);
    if (auto* const ghosts =
            vtkUnsignedCharArray::SafeDownCast(grid->GetCellData()->GetArray(vtkDataSetAttributes::GhostArrayName()))) {
      // RemoveGhostCells removes only duplicates.
      for (vtkIdType i = 0; i < ghosts->GetNumberOfValues(); ++i) {
        if (ghosts->GetValue(i) != 0) ghosts->SetValue(i, vtkDataSetAttributes::DUPLICATECELL);
      }
      grid->RemoveGhostCells();
    }
    grid->GetCellData()->RemoveArray(vtkDataSetAttributes::GhostArrayName());
  }
  keep_ghosts(*piece.GetCellData(), vtkDataSetAttributes::HIDDENCELL);
  keep_ghosts(*piece.GetPointData(), vtkDataSetAttributes::HIDDENPOINT);
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

}  // namespace

DataSets data_sets_in(vtkDataObject* data) {
  DataSets pieces;
  collect(data, pieces);
  return pieces;
}

vtkSmartPointer<vtkDataSet> one_data_set(const DataSets& pieces, bool merges_points) {
  for (vtkDataSet* const piece : pieces) remove_ghosts(*piece);
  if (pieces.empty()) return nullptr;
  if (pieces.size() == 1) return pieces.front();

  complete_arrays(pieces, vtkDataObject::POINT);
  complete_arrays(pieces, vtkDataObject::CELL);
  vtkNew<vtkAppendFilter> append;
  append->SetMergePoints(merges_points);
  append->SetTolerance(0);
  append->SetOutputPointsPrecision(vtkAlgorithm::DEFAULT_PRECISION);
  for (vtkDataSet* const piece : pieces) append->AddInputData(piece);
  append->Update();
  return append->GetOutput();
}

}  // namespace tensorray
