#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <vtkAppendFilter.h>
#include <vtkCellData.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkIntArray.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkRectilinearGrid.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>

#include "tools/import/lattices/tensor_order.h"
#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/vtk/overlaps.h"
#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {
namespace {

/// Collects shallow copies, so that arrays can be added and removed.
void collect(vtkDataObject* data, DataSets& pieces) {
  if (auto* const tree = vtkCompositeDataSet::SafeDownCast(data)) {
    vtkSmartPointer<vtkCompositeDataIterator> leaf;
    leaf.TakeReference(tree->NewIterator());
    for (leaf->InitTraversal(); !leaf->IsDoneWithTraversal(); leaf->GoToNextItem())
      collect(leaf->GetCurrentDataObject(), pieces);
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

/// Marks points that are copies of another piece's, and may be stale.
constexpr const char* copied_points = "tensorray:copied";

void mark_copied_points(vtkDataSet& piece, const vtkUnsignedCharArray& ghosts) {
  vtkNew<vtkUnsignedCharArray> marks;
  marks->SetName(copied_points);
  for (vtkIdType i = 0; i < ghosts.GetNumberOfValues(); ++i)
    marks->InsertNextValue(ghosts.GetValue(i) & vtkDataSetAttributes::DUPLICATEPOINT);
  piece.GetPointData()->AddArray(marks);
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
  if (points) mark_copied_points(piece, *points);
  for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL})
    piece.GetAttributes(type)->RemoveArray(vtkDataSetAttributes::GhostArrayName());
  vtkNew<vtkAppendFilter> to_unstructured;
  to_unstructured->AddInputData(&piece);
  to_unstructured->Update();
  const vtkSmartPointer<vtkUnstructuredGrid> grid = to_unstructured->GetOutput();
  grid->GetCellData()->AddArray(marks);
  grid->RemoveGhostCells();  // Those that are marked as copies.
  grid->GetCellData()->RemoveArray(vtkDataSetAttributes::GhostArrayName());
  return grid;
}

/// Hides copies of cells where the piece has the cells themselves, whose values are never stale.
void hide_covered_copies(vtkDataSet& piece) {
  const auto* const ghosts = ghosts_of(*piece.GetCellData());
  if (!ghosts || !piece.IsA("vtkUnstructuredGrid")) return;
  const auto copy = vtkSmartPointer<vtkDataSet>::Take(piece.NewInstance());
  copy->ShallowCopy(&piece);
  const vtkSmartPointer<vtkDataSet> own = used_part(*copy);
  if (own->GetNumberOfCells() == 0 || own->GetNumberOfCells() == piece.GetNumberOfCells()) return;
  CellFinder finder(*own);
  vtkNew<vtkUnsignedCharArray> marks;
  marks->DeepCopy(const_cast<vtkUnsignedCharArray*>(ghosts));  // It is only read.
  for (vtkIdType cell = 0; cell < piece.GetNumberOfCells(); ++cell)
    if ((ghosts->GetValue(cell) & vtkDataSetAttributes::DUPLICATECELL) != 0 && finder.has(centre_of(piece, cell)))
      marks->SetValue(cell, ghosts->GetValue(cell) | vtkDataSetAttributes::HIDDENCELL);
  piece.GetCellData()->AddArray(marks);
}

/// The arrays with a name, by piece; null where a piece has none.
using SameArrays = std::vector<vtkSmartPointer<vtkDataArray>>;

std::map<std::string, SameArrays> arrays_of(const DataSets& pieces, vtkDataObject::AttributeTypes type) {
  std::map<std::string, SameArrays> named;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    vtkDataSetAttributes& data = *pieces[k]->GetAttributes(type);
    for (int i = 0; i < data.GetNumberOfArrays(); ++i)
      if (vtkDataArray* const array = data.GetArray(i); array && array->GetName()) {
        SameArrays& arrays = named[array->GetName()];
        arrays.resize(pieces.size());
        arrays[k] = array;
      }
  }
  return named;
}

/// The type in which all of them can be one array. NaN stands for what is missing.
int common_type(const SameArrays& arrays) {
  std::set<int> types;
  for (const auto& array : arrays) types.insert(array ? array->GetDataType() : VTK_VOID);
  const bool is_missing = types.erase(VTK_VOID) > 0;
  const bool is_real = *types.begin() == VTK_FLOAT || *types.begin() == VTK_DOUBLE;
  return types.size() == 1 && (is_real || !is_missing) ? *types.begin() : VTK_DOUBLE;
}

/// Whether arrays name their components, but not all alike.
bool names_differ(const SameArrays& arrays) {
  std::set<std::vector<std::string>> all;
  for (const auto& array : arrays) {
    if (!array || !array->HasAComponentName()) continue;
    std::vector<std::string> names;
    for (int i = 0; i < array->GetNumberOfComponents(); ++i) names.push_back(component_name(*array, i));
    all.insert(names);
  }
  return all.size() > 1;
}

/// The first array with names of its components, or else the first one.
vtkDataArray& first_named(const SameArrays& arrays) {
  vtkDataArray* first = nullptr;
  for (const auto& array : arrays) {
    if (array && array->HasAComponentName()) return *array;
    if (!first) first = array;
  }
  return *first;
}

vtkSmartPointer<vtkDataArray> missing_array(vtkDataArray& like, int type, vtkIdType count) {
  auto filled = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(type));
  filled->SetName(like.GetName());
  filled->SetNumberOfComponents(like.GetNumberOfComponents());
  filled->SetNumberOfTuples(count);
  filled->Fill(std::numeric_limits<double>::quiet_NaN());
  return filled;
}

/// Makes arrays of one name alike, and adds those that are missing: vtkAppendFilter drops arrays that some of its
/// inputs lack or have as numbers of another type, and joins components by their numbers.
void unify_arrays(const DataSets& pieces, vtkDataObject::AttributeTypes type) {
  for (const auto& [name, arrays] : arrays_of(pieces, type)) {
    const int number_type = common_type(arrays);
    const bool sorts = names_differ(arrays);
    vtkDataArray& like = first_named(arrays);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      vtkSmartPointer<vtkDataArray> array = arrays[k];
      if (!array) array = missing_array(like, number_type, pieces[k]->GetNumberOfElements(type));
      if (sorts) array = sorted_by_names(*array);
      if (array->GetDataType() != number_type) {
        const auto converted = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(number_type));
        converted->DeepCopy(array);
        array = converted;
      }
      pieces[k]->GetAttributes(type)->AddArray(array);
    }
  }
}

bool is_finite(vtkDataArray& array, vtkIdType tuple) {
  for (int i = 0; i < array.GetNumberOfComponents(); ++i)
    if (!std::isfinite(array.GetComponent(tuple, i))) return false;
  return true;
}

/// A piece, the arrays of its points that it had from the beginning, and which of its points are copies.
struct Piece {
  vtkSmartPointer<vtkDataSet> set;
  std::set<std::string> known;
  vtkSmartPointer<vtkUnsignedCharArray> copies;  ///< Null: none.
};

/// Gives points of `all` the values that the piece with cells from `first` on has there, if they are finite.
/// @param copies  Of the piece's copies of points alone, or of all others.
void take_values(vtkUnstructuredGrid& all, vtkIdType first, const Piece& piece, bool copies) {
  vtkNew<vtkIdList> from, to;
  for (vtkIdType cell = 0; cell < piece.set->GetNumberOfCells(); ++cell) {
    piece.set->GetCellPoints(cell, from);
    all.GetCellPoints(first + cell, to);
    for (const std::string& name : piece.known) {
      vtkDataArray* const values = piece.set->GetPointData()->GetArray(name.c_str());
      vtkDataArray* const merged = all.GetPointData()->GetArray(name.c_str());
      for (vtkIdType i = 0; merged && i < from->GetNumberOfIds() && i < to->GetNumberOfIds(); ++i) {
        const vtkIdType point = from->GetId(i);
        if ((piece.copies && piece.copies->GetValue(point) != 0) == copies && is_finite(*values, point))
          merged->SetTuple(to->GetId(i), point, values);
      }
    }
  }
}

/// Gives each point of `all` the values of the first piece that has it, not as a copy if there is another, and finite
/// values there. The cells of `all` are those of the pieces, in their order.
void take_known_values(vtkUnstructuredGrid& all, const std::vector<Piece>& pieces) {
  for (const bool copies : {true, false}) {
    vtkIdType end = all.GetNumberOfCells();
    for (std::size_t k = pieces.size(); k-- > 0;) {
      end -= pieces[k].set->GetNumberOfCells();
      if (copies && !pieces[k].copies) continue;
      take_values(all, end, pieces[k], copies);
    }
  }
}

std::set<std::string> point_arrays(vtkDataSet& piece) {
  std::set<std::string> names;
  for (int i = 0; i < piece.GetPointData()->GetNumberOfArrays(); ++i)
    if (vtkDataArray* const array = piece.GetPointData()->GetArray(i); array && array->GetName())
      names.insert(array->GetName());
  return names;
}

vtkSmartPointer<vtkUnstructuredGrid> appended(const DataSets& sets, bool merges_points) {
  vtkNew<vtkAppendFilter> append;
  append->SetMergePoints(merges_points);
  append->SetTolerance(0);
  append->SetOutputPointsPrecision(vtkAlgorithm::DEFAULT_PRECISION);
  for (vtkDataSet* const set : sets) append->AddInputData(set);
  append->Update();
  return append->GetOutput();
}

/// One grid of pieces that do not overlap.
vtkSmartPointer<vtkDataSet> merged_layer(const std::vector<Piece>& pieces, bool merges_points) {
  DataSets sets;
  for (const Piece& piece : pieces) sets.push_back(piece.set);
  const vtkSmartPointer<vtkUnstructuredGrid> all = appended(sets, merges_points);
  take_known_values(*all, pieces);
  return all;
}

/// One grid of layers, which share no points, so that none takes values of another, and which its cells name.
vtkSmartPointer<vtkDataSet> stacked(const DataSets& layers) {
  for (std::size_t i = 0; i < layers.size(); ++i) {
    vtkNew<vtkIntArray> numbers;
    numbers->SetName(layer_array);
    numbers->SetNumberOfValues(layers[i]->GetNumberOfCells());
    numbers->FillValue(static_cast<int>(i));
    layers[i]->GetCellData()->AddArray(numbers);
  }
  return appended(layers, false);
}

bool is_same_image(vtkImageData& a, vtkImageData& b) {
  const double* const of_a = a.GetIndexToPhysicalMatrix()->GetData();
  const double* const of_b = b.GetIndexToPhysicalMatrix()->GetData();
  return std::equal(a.GetExtent(), a.GetExtent() + 6, b.GetExtent()) && std::equal(of_a, of_a + 16, of_b);
}

bool is_same_grid(vtkRectilinearGrid& a, vtkRectilinearGrid& b) {
  const auto is_equal = [](vtkDataArray* one, vtkDataArray* other) {
    if (!one || !other || one->GetNumberOfTuples() != other->GetNumberOfTuples()) return one == other;
    for (vtkIdType i = 0; i < one->GetNumberOfTuples(); ++i)
      if (one->GetComponent(i, 0) != other->GetComponent(i, 0)) return false;
    return true;
  };
  return is_equal(a.GetXCoordinates(), b.GetXCoordinates()) && is_equal(a.GetYCoordinates(), b.GetYCoordinates()) &&
         is_equal(a.GetZCoordinates(), b.GetZCoordinates());
}

}  // namespace

DataSets data_sets_in(vtkDataObject* data) {
  DataSets pieces;
  collect(data, pieces);
  return pieces;
}

bool is_same_mesh(vtkDataSet& a, vtkDataSet& b) {
  if (a.GetNumberOfPoints() != b.GetNumberOfPoints() || a.GetNumberOfCells() != b.GetNumberOfCells()) return false;
  if (vtkImageData::SafeDownCast(&a) && vtkImageData::SafeDownCast(&b))
    return is_same_image(*vtkImageData::SafeDownCast(&a), *vtkImageData::SafeDownCast(&b));
  if (vtkRectilinearGrid::SafeDownCast(&a) && vtkRectilinearGrid::SafeDownCast(&b))
    return is_same_grid(*vtkRectilinearGrid::SafeDownCast(&a), *vtkRectilinearGrid::SafeDownCast(&b));
  vtkNew<vtkIdList> of_a, of_b;
  for (vtkIdType id = 0; id < a.GetNumberOfCells(); ++id) {
    a.GetCellPoints(id, of_a);
    b.GetCellPoints(id, of_b);
    if (a.GetCellType(id) != b.GetCellType(id) || of_a->GetNumberOfIds() != of_b->GetNumberOfIds() ||
        !std::equal(of_a->begin(), of_a->end(), of_b->begin()))
      return false;
  }
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
    hide_covered_copies(*given.front());
    keep_hidden(*given.front());
    return given.front();
  }
  DataSets sets;
  for (vtkDataSet* const piece : given) sets.push_back(used_part(*piece));
  std::vector<Piece> pieces;
  for (const auto& set : sets) {
    const vtkSmartPointer<vtkUnsignedCharArray> copies =
        vtkUnsignedCharArray::SafeDownCast(set->GetPointData()->GetArray(copied_points));
    set->GetPointData()->RemoveArray(copied_points);
    pieces.push_back({set, point_arrays(*set), copies});
  }
  unify_arrays(sets, vtkDataObject::POINT);
  unify_arrays(sets, vtkDataObject::CELL);
  const std::vector<int> layers = overlapping_layers(sets);
  DataSets merged;
  for (int layer = 0; layer <= *std::max_element(layers.begin(), layers.end()); ++layer) {
    std::vector<Piece> of_layer;
    for (std::size_t k = 0; k < pieces.size(); ++k)
      if (layers[k] == layer) of_layer.push_back(pieces[k]);
    merged.push_back(merged_layer(of_layer, merges_points));
  }
  return merged.size() == 1 ? merged.front() : stacked(merged);
}

}  // namespace tensorray
