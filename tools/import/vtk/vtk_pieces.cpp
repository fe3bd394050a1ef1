#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <vtkAppendFilter.h>
#include <vtkBoundingBox.h>
#include <vtkCellData.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkGenericCell.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkRectilinearGrid.h>
#include <vtkSmartPointer.h>
#include <vtkStaticCellLocator.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>

#include "tools/import/lattices/tensor_order.h"
#include "tools/import/meshes/mesh_tensors.h"
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

vtkUnsignedCharArray* ghosts_of(vtkDataSetAttributes& attributes) {
  return vtkUnsignedCharArray::SafeDownCast(attributes.GetArray(vtkDataSetAttributes::GhostArrayName()));
}

/// The bits of ghosts, as an array with a name.
vtkNew<vtkUnsignedCharArray> masked(vtkUnsignedCharArray& ghosts, int bits, const char* name) {
  vtkNew<vtkUnsignedCharArray> marks;
  marks->SetName(name);
  for (vtkIdType i = 0; i < ghosts.GetNumberOfValues(); ++i)
    marks->InsertNextValue(static_cast<unsigned char>(ghosts.GetValue(i) & bits));
  return marks;
}

/// Marks only what is hidden; refined cells are covered by others. Copies of neighbours' cells and points have the
/// neighbours' values, and stay.
void keep_hidden(vtkDataSet& piece) {
  constexpr int cells = vtkDataSetAttributes::HIDDENCELL | vtkDataSetAttributes::REFINEDCELL;
  for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL})
    if (vtkUnsignedCharArray* const ghosts = ghosts_of(*piece.GetAttributes(type))) {
      const char* const name = vtkDataSetAttributes::GhostArrayName();
      const auto kept = masked(*ghosts, type == vtkDataObject::CELL ? cells : vtkDataSetAttributes::HIDDENPOINT, name);
      piece.GetAttributes(type)->RemoveArray(name);
      if (kept->GetValueRange()[1] > 0) piece.GetAttributes(type)->AddArray(kept);
    }
}

/// Marks points that are copies of another piece's, and may be stale.
constexpr const char* copied_points = "tensorray:copied";

/// The piece without the cells that are to be left out beside other pieces: copies of neighbours' cells, hidden cells,
/// and those with a hidden point.
vtkSmartPointer<vtkDataSet> used_part(vtkDataSet& piece) {
  vtkUnsignedCharArray* const cells = ghosts_of(*piece.GetCellData());
  vtkUnsignedCharArray* const points = ghosts_of(*piece.GetPointData());
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
  if (points) piece.GetPointData()->AddArray(masked(*points, vtkDataSetAttributes::DUPLICATEPOINT, copied_points));
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

/// The mean point of a cell, and its dimensions.
struct CellCentre {
  Eigen::Vector3d position;
  int dimensions;
};

CellCentre centre_of(vtkDataSet& set, vtkIdType id) {
  vtkNew<vtkGenericCell> cell;
  set.GetCell(id, cell);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (vtkIdType i = 0; i < cell->GetNumberOfPoints(); ++i) sum += Eigen::Vector3d(cell->GetPoints()->GetPoint(i));
  return {sum / static_cast<double>(std::max<vtkIdType>(1, cell->GetNumberOfPoints())), cell->GetCellDimension()};
}

/// Whether a cell of a data set, which must outlive this, is at a centre, and has as many dimensions.
using CellFinder = std::function<bool(const CellCentre&)>;

CellFinder cell_finder(vtkDataSet& set) {
  const auto locator = vtkSmartPointer<vtkStaticCellLocator>::New();
  locator->SetDataSet(&set);
  locator->BuildLocator();
  std::vector<double> weights(static_cast<std::size_t>(std::max(32, set.GetMaxCellSize())));
  const double squared_tolerance = 1e-12 * set.GetLength() * set.GetLength();
  return [=, cell = vtkSmartPointer<vtkGenericCell>::New()](const CellCentre& centre) mutable {
    Eigen::Vector3d position = centre.position, parametric;
    return locator->FindCell(position.data(), squared_tolerance, cell, parametric.data(), weights.data()) >= 0 &&
           cell->GetCellDimension() == centre.dimensions;
  };
}

/// Hides copies of cells where the piece has the cells themselves, whose values are never stale.
void hide_covered_copies(vtkDataSet& piece) {
  vtkUnsignedCharArray* const ghosts = ghosts_of(*piece.GetCellData());
  if (!ghosts || !piece.IsA("vtkUnstructuredGrid")) return;
  const auto copy = vtkSmartPointer<vtkDataSet>::Take(piece.NewInstance());
  copy->ShallowCopy(&piece);
  const vtkSmartPointer<vtkDataSet> own = used_part(*copy);
  if (own->GetNumberOfCells() == 0 || own->GetNumberOfCells() == piece.GetNumberOfCells()) return;
  const CellFinder has_own = cell_finder(*own);
  vtkNew<vtkUnsignedCharArray> marks;
  marks->DeepCopy(ghosts);
  for (vtkIdType cell = 0; cell < piece.GetNumberOfCells(); ++cell)
    if ((ghosts->GetValue(cell) & vtkDataSetAttributes::DUPLICATECELL) != 0 && has_own(centre_of(piece, cell)))
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

/// What arrays of one name have in common.
struct CommonArray {
  int type = VTK_DOUBLE;         ///< In which all of them can be one. NaN stands for what is missing.
  vtkDataArray* like = nullptr;  ///< The first one with names of its components, or else the first one.
  bool names_differ = false;     ///< Some name their components, but not all alike.
};

CommonArray common_array(const SameArrays& arrays) {
  CommonArray common;
  std::set<int> types;
  std::set<std::vector<std::string>> all_names;
  for (const auto& array : arrays) {
    types.insert(array ? array->GetDataType() : VTK_VOID);
    if (!array) continue;
    if (!common.like || (array->HasAComponentName() && !common.like->HasAComponentName())) common.like = array;
    std::vector<std::string> names;
    for (int i = 0; i < array->GetNumberOfComponents(); ++i) names.push_back(component_name(*array, i));
    if (array->HasAComponentName()) all_names.insert(names);
  }
  const bool is_missing = types.erase(VTK_VOID) > 0;
  const bool is_real = *types.begin() == VTK_FLOAT || *types.begin() == VTK_DOUBLE;
  if (types.size() == 1 && (is_real || !is_missing)) common.type = *types.begin();
  common.names_differ = all_names.size() > 1;
  return common;
}

vtkSmartPointer<vtkDataArray> new_array(int type) {
  return vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(type));
}

/// Makes arrays of one name alike, and adds those that are missing: vtkAppendFilter drops arrays that some of its
/// inputs lack or have as numbers of another type, and joins components by their numbers.
void unify_arrays(const DataSets& pieces, vtkDataObject::AttributeTypes type) {
  for (const auto& [name, arrays] : arrays_of(pieces, type)) {
    const CommonArray common = common_array(arrays);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      vtkSmartPointer<vtkDataArray> array = arrays[k];
      if (!array) {
        array = new_array(common.type);
        array->SetName(name.c_str());
        array->SetNumberOfComponents(common.like->GetNumberOfComponents());
        array->SetNumberOfTuples(pieces[k]->GetNumberOfElements(type));
        array->Fill(std::numeric_limits<double>::quiet_NaN());
      }
      if (common.names_differ) array = sorted_by_names(*array);
      if (array->GetDataType() != common.type) {
        const auto converted = new_array(common.type);
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

/// Gives points of `all` the values that the piece with cells from `first` on has there, if they are finite.
/// @param copies  Of the piece's copies of points alone, or of all others.
void take_values(vtkUnstructuredGrid& all, vtkIdType first, vtkDataSet& piece, bool copies) {
  vtkDataArray* const marks = piece.GetPointData()->GetArray(copied_points);  // NaN: a piece without copies.
  if (copies && !marks) return;
  vtkNew<vtkIdList> from, to;
  for (vtkIdType cell = 0; cell < piece.GetNumberOfCells(); ++cell) {
    piece.GetCellPoints(cell, from);
    all.GetCellPoints(first + cell, to);
    for (int k = 0; k < all.GetPointData()->GetNumberOfArrays(); ++k) {
      vtkDataArray* const merged = all.GetPointData()->GetArray(k);
      vtkDataArray* const values =
          merged && merged->GetName() ? piece.GetPointData()->GetArray(merged->GetName()) : nullptr;
      for (vtkIdType i = 0; values && i < from->GetNumberOfIds() && i < to->GetNumberOfIds(); ++i) {
        const vtkIdType point = from->GetId(i);
        if ((marks && marks->GetComponent(point, 0) > 0) == copies && is_finite(*values, point))
          merged->SetTuple(to->GetId(i), point, values);
      }
    }
  }
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

/// One grid of pieces that do not overlap. Each point has the values of the first piece that has it, not as a copy if
/// there is another, and finite values there.
vtkSmartPointer<vtkDataSet> merged_layer(const DataSets& pieces, bool merges_points) {
  const vtkSmartPointer<vtkUnstructuredGrid> all = appended(pieces, merges_points);
  for (const bool copies : {true, false}) {
    vtkIdType end = all->GetNumberOfCells();  // Its cells are those of the pieces, in their order.
    for (std::size_t k = pieces.size(); k-- > 0;) {
      end -= pieces[k]->GetNumberOfCells();
      take_values(*all, end, *pieces[k], copies);
    }
  }
  all->GetPointData()->RemoveArray(copied_points);
  return all;
}

struct Sampled {
  vtkSmartPointer<vtkDataSet> set;
  std::vector<CellCentre> centres;  ///< Of some cells of the highest dimensions.
  CellFinder has;                   ///< Made when it is needed.
};

Sampled sampled(vtkDataSet& set) {
  constexpr vtkIdType most = 4096;
  Sampled result{&set, {}, nullptr};
  for (vtkIdType id = 0; id < set.GetNumberOfCells(); id += (set.GetNumberOfCells() + most - 1) / most) {
    const CellCentre centre = centre_of(set, id);
    if (!result.centres.empty() && centre.dimensions > result.centres[0].dimensions) result.centres.clear();
    if (result.centres.empty() || centre.dimensions == result.centres[0].dimensions) result.centres.push_back(centre);
  }
  return result;
}

/// Whether a cell of `a` is at the centre of one of `b`.
bool has_some(Sampled& a, const Sampled& b) {
  const vtkBoundingBox box(a.set->GetBounds());
  return std::any_of(b.centres.begin(), b.centres.end(), [&](const CellCentre& centre) {
    if (!box.ContainsPoint(centre.position.data())) return false;
    if (!a.has) a.has = cell_finder(*a.set);
    return a.has(centre);
  });
}

/// Divides data sets into layers, so that none overlaps another one of its layer. Tries up to 4096 cells of each set
/// where its box intersects that of another one. Faces in common are no overlap.
std::vector<DataSets> layers_of(const DataSets& sets) {
  std::vector<std::vector<Sampled>> layers;
  std::vector<DataSets> result;
  for (vtkDataSet* const set : sets) {
    Sampled next = sampled(*set);
    const auto overlaps = [&](Sampled& other) { return has_some(other, next) || has_some(next, other); };
    std::size_t layer = 0;
    while (layer < layers.size() && std::any_of(layers[layer].begin(), layers[layer].end(), overlaps)) ++layer;
    layers.resize(std::max(layers.size(), layer + 1));
    result.resize(layers.size());
    layers[layer].push_back(std::move(next));
    result[layer].emplace_back(set);
  }
  return result;
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

/// The numbers of points along the axes of an image or a rectilinear grid; zero of other sets.
std::array<vtkIdType, 3> implied_points(vtkDataSet& set) {
  std::array<int, 3> points{};
  if (auto* const image = vtkImageData::SafeDownCast(&set)) image->GetDimensions(points.data());
  if (auto* const grid = vtkRectilinearGrid::SafeDownCast(&set)) grid->GetDimensions(points.data());
  return {points[0], points[1], points[2]};
}

}  // namespace

DataSets data_sets_in(vtkDataObject* data) {
  DataSets pieces;
  collect(data, pieces);
  return pieces;
}

bool is_same_mesh(vtkDataSet& a, vtkDataSet& b) {
  if (a.GetNumberOfPoints() != b.GetNumberOfPoints() || a.GetNumberOfCells() != b.GetNumberOfCells()) return false;
  const auto is_same_point = [&](vtkIdType i) {
    std::array<double, 3> x{}, y{};
    a.GetPoint(i, x.data());
    b.GetPoint(i, y.data());
    return x == y;
  };
  const std::array<vtkIdType, 3> points = implied_points(a);
  if (points != implied_points(b)) return false;
  if (points[0] > 0) {  // There may be more than can be looked at; all follow from those along three edges.
    const bool even = vtkImageData::SafeDownCast(&a) && vtkImageData::SafeDownCast(&b);  // From the ends of these.
    for (vtkIdType axis = 0, stride = 1; axis < 3; stride *= axis < 2 ? points[axis] : 1, ++axis)
      for (vtkIdType i = 0; i < points[axis]; i += even ? std::max<vtkIdType>(1, points[axis] - 1) : 1)
        if (!is_same_point(stride * i)) return false;
    return true;
  }
  for (vtkIdType i = 0; i < a.GetNumberOfPoints(); ++i)
    if (!is_same_point(i)) return false;
  vtkNew<vtkIdList> of_a, of_b;
  for (vtkIdType id = 0; id < a.GetNumberOfCells(); ++id) {
    a.GetCellPoints(id, of_a);
    b.GetCellPoints(id, of_b);
    if (a.GetCellType(id) != b.GetCellType(id) || of_a->GetNumberOfIds() != of_b->GetNumberOfIds() ||
        !std::equal(of_a->begin(), of_a->end(), of_b->begin()))
      return false;
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
  unify_arrays(sets, vtkDataObject::POINT);
  unify_arrays(sets, vtkDataObject::CELL);
  DataSets merged;
  for (const DataSets& layer : layers_of(sets)) merged.push_back(merged_layer(layer, merges_points));
  return merged.size() == 1 ? merged.front() : stacked(merged);
}

}  // namespace tensorray
