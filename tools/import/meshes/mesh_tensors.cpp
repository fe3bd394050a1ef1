#include "tools/import/meshes/mesh_tensors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <Eigen/Core>
#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDoubleArray.h>
#include <vtkGradientFilter.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include "tools/import/meshes/cell_gradients.h"
#include "tools/import/meshes/mesh_cell.h"

namespace tensorray {
namespace {

using Array = vtkSmartPointer<vtkDoubleArray>;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// @param is_named  The user names the array. Without, four components may be anything, such as colours.
bool suits(int components, Take take, bool is_named) {
  if (take == Take::tensor) return components == 6 || components >= 9 || (components == 4 && is_named);
  return components == 3;
}

const char* wanted(Take take) {
  return take == Take::tensor ? "a tensor has 6, 9, or more than 9 components, of a plane 4"
                              : "a vector has 3 components";
}

std::string component_names(vtkDataArray& array) {
  std::string names;
  for (int i = 0; i < 6 && array.GetComponentName(i); ++i)
    names += (names.empty() ? "" : " ") + std::string(array.GetComponentName(i));
  return names;
}

Array new_array(vtkIdType points, int components) {
  auto array = Array::New();
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(points);
  array->Fill(0);
  return array;
}

Array point_values(vtkDataArray& values) {
  auto copy = Array::New();
  copy->DeepCopy(&values);
  return copy;
}

/// Makes means of sums; NaN where there is nothing.
void divide(vtkDoubleArray& sums, const std::vector<int>& counts) {
  const int components = sums.GetNumberOfComponents();
  for (vtkIdType point = 0; point < sums.GetNumberOfTuples(); ++point)
    for (int k = 0; k < components; ++k)
      *sums.GetPointer(point * components + k) /= counts[static_cast<std::size_t>(point)];
}

Array averaged_to_points(vtkDataSet& mesh, vtkDataArray& of_cells) {
  const int components = of_cells.GetNumberOfComponents();
  Array sums = new_array(mesh.GetNumberOfPoints(), components);
  std::vector<int> counts(static_cast<std::size_t>(mesh.GetNumberOfPoints()), 0);
  std::vector<double> value(static_cast<std::size_t>(components));
  MeshCell cell;
  for (vtkIdType id = 0; id < mesh.GetNumberOfCells(); ++id) {
    of_cells.GetTuple(id, value.data());
    const auto is_finite = [](double v) { return std::isfinite(v); };
    if (!std::all_of(value.begin(), value.end(), is_finite) || !cell.load(mesh, id)) continue;
    for (int i = 0; i < cell.points(); ++i) {
      ++counts[static_cast<std::size_t>(cell.point(i))];
      double* sum = sums->GetPointer(cell.point(i) * components);
      for (std::size_t k = 0; k < value.size(); ++k) sum[k] += value[k];
    }
  }
  divide(*sums, counts);
  return sums;
}

/// Whether VTK may take differences along the grid: it ignores that points are hidden, and spreads what is not finite.
bool is_whole_grid(vtkDataSet& mesh, vtkDoubleArray& vectors) {
  if (mesh.IsA("vtkUnstructuredGrid") || mesh.GetPointGhostArray() || mesh.GetCellGhostArray()) return false;
  const double* const begin = vectors.GetPointer(0);
  return std::all_of(begin, begin + vectors.GetNumberOfValues(), [](double v) { return std::isfinite(v); });
}

Array differences_along_grid(vtkDataSet& mesh, const Array& vectors) {
  const auto bare = vtkSmartPointer<vtkDataSet>::Take(mesh.NewInstance());
  bare->CopyStructure(&mesh);
  vectors->SetName("vector");
  bare->GetPointData()->AddArray(vectors);
  vtkNew<vtkGradientFilter> filter;
  filter->SetInputData(bare);
  filter->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "vector");
  filter->SetResultArrayName("gradient");
  filter->Update();
  auto* const result = vtkDataSet::SafeDownCast(filter->GetOutputDataObject(0));
  vtkDataArray* const gradient = result ? result->GetPointData()->GetArray("gradient") : nullptr;
  if (!gradient || gradient->GetNumberOfComponents() != 9 || gradient->GetNumberOfTuples() != mesh.GetNumberOfPoints())
    throw std::runtime_error(fmt::format("VTK cannot differentiate on a mesh of class {}", mesh.GetClassName()));
  return point_values(*gradient);
}

/// At each point, the mean of the derivatives that its cells have there.
Array mean_of_derivatives(vtkDataSet& mesh, vtkDoubleArray& vectors) {
  Array sums = new_array(mesh.GetNumberOfPoints(), 9);
  std::vector<int> counts(static_cast<std::size_t>(mesh.GetNumberOfPoints()), 0);
  MeshCell cell;
  Eigen::Matrix3Xd values;
  for (vtkIdType id = 0; id < mesh.GetNumberOfCells(); ++id) {
    if (!cell.load(mesh, id)) continue;
    values.resize(3, cell.points());
    for (int i = 0; i < cell.points(); ++i) vectors.GetTuple(cell.point(i), values.col(i).data());
    if (!values.allFinite()) continue;
    for (int i = 0; i < cell.points(); ++i) {
      const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> gradient = cell.gradient(values, i);
      if (!gradient.allFinite()) continue;  // The cell is flat there.
      ++counts[static_cast<std::size_t>(cell.point(i))];
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(sums->GetPointer(9 * cell.point(i))) += gradient;
    }
  }
  divide(*sums, counts);
  return sums;
}

/// ∂v_i/∂x_j as component 3 i + j.
Array gradient_of(vtkDataSet& mesh, const Array& vectors) {
  return is_whole_grid(mesh, *vectors) ? differences_along_grid(mesh, vectors) : mean_of_derivatives(mesh, *vectors);
}

/// Makes what is taken of gradients.
void take_of_gradients(Take take, vtkDoubleArray& tensors) {
  for (vtkIdType point = 0; point < tensors.GetNumberOfTuples(); ++point) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> tensor(tensors.GetPointer(9 * point));
    tensor = tensor_of_gradient(take, tensor);
  }
}

Array tensors_in(const Array& components, TensorOrder order) {
  const vtkIdType points = components->GetNumberOfTuples();
  Array tensors = new_array(points, 9);
  for (vtkIdType point = 0; point < points; ++point)
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(tensors->GetPointer(9 * point)) =
        tensor_of(components->GetPointer(point * components->GetNumberOfComponents()), order);
  return tensors;
}

void mark_unusable_points(vtkDataSet& mesh, vtkDoubleArray& tensors) {
  vtkUnsignedCharArray* const ghosts = mesh.GetPointGhostArray();
  for (vtkIdType point = 0; point < tensors.GetNumberOfTuples(); ++point) {
    Eigen::Map<Eigen::Matrix<double, 9, 1>> tensor(tensors.GetPointer(9 * point));
    if ((ghosts && is_hidden(ghosts->GetValue(point))) || !tensor.allFinite()) tensor.setConstant(not_a_number);
  }
}

/// The geometry of the mesh, with arrays of tensors, which may be null.
vtkSmartPointer<vtkDataSet> with_arrays(vtkDataSet& mesh, const Array& of_points, const Array& of_cells) {
  auto result = vtkSmartPointer<vtkDataSet>::Take(mesh.NewInstance());
  result->CopyStructure(&mesh);
  for (const bool cells : {false, true}) {
    for (const char* const kept : {vtkDataSetAttributes::GhostArrayName(), layer_array})
      if (vtkDataArray* array = attributes_of(mesh, cells).GetArray(kept))
        attributes_of(*result, cells).AddArray(array);
    if (const Array& tensors = cells ? of_cells : of_points) {
      tensors->SetName(tensor_array);
      attributes_of(*result, cells).AddArray(tensors);
    }
  }
  result->GetCellData()->SetHigherOrderDegrees(mesh.GetCellData()->GetHigherOrderDegrees());
  result->GetPointData()->SetRationalWeights(mesh.GetPointData()->GetRationalWeights());
  // VTK 9.1 keeps that a structured grid has no ghosts from when its structure was copied.
  result->UpdatePointGhostArrayCache();
  result->UpdateCellGhostArrayCache();
  return result;
}

}  // namespace

const char* flag_of(Take take) {
  constexpr const char* flags[] = {"--array", "--gradient-of", "--strain-of", "--viscous-stress-of"};
  return flags[static_cast<std::size_t>(take)];
}

vtkDataSetAttributes& attributes_of(vtkDataSet& mesh, bool of_cells) {
  return *mesh.GetAttributes(of_cells ? vtkDataObject::CELL : vtkDataObject::POINT);
}

void for_each_array(vtkDataSet& mesh, const std::function<void(vtkDataArray&, bool)>& visit) {
  for (const bool of_cells : {false, true}) {
    vtkDataSetAttributes& data = attributes_of(mesh, of_cells);
    for (int i = 0; i < data.GetNumberOfArrays(); ++i) {
      vtkDataArray* array = data.GetArray(i);
      if (!array || !array->GetName()) continue;
      const std::string name = array->GetName();
      if (name != vtkDataSetAttributes::GhostArrayName() && name != layer_array) visit(*array, of_cells);
    }
  }
}

std::string list_of_arrays(vtkDataSet& mesh) {
  std::string list;
  for_each_array(mesh, [&](vtkDataArray& array, bool of_cells) {
    const int components = array.GetNumberOfComponents();
    list += fmt::format("{}{} ({} component{}, {})", list.empty() ? "" : ", ", array.GetName(), components,
                        components == 1 ? "" : "s", of_cells ? "cells" : "points");
  });
  return list.empty() ? "there are no arrays" : "there are: " + list;
}

TensorOrder order_in(vtkDataArray& array, const std::optional<TensorOrder>& given) {
  const bool six_first = array.GetNumberOfComponents() != 9;
  const std::optional<TensorOrder> said = six_first ? order_of_names(array) : std::nullopt;
  if (given && said && *given != *said)
    throw std::invalid_argument(
        fmt::format("the file itself names the components of array \"{}\": they are {}, of which --order says "
                    "otherwise; leave --order out",
                    array.GetName(), component_names(array)));
  return chosen_order(array.GetNumberOfComponents(), said, given, fmt::format("array \"{}\"", array.GetName()));
}

ArrayChoice choose_array(vtkDataSet& mesh, const std::string& name, Take take, CellValues cell_values) {
  std::vector<ArrayChoice> choices;
  int components_of_named = 0;
  for_each_array(mesh, [&](vtkDataArray& array, bool of_cells) {
    if (!name.empty() && array.GetName() != name) return;
    components_of_named = array.GetNumberOfComponents();
    if (!suits(components_of_named, take, !name.empty())) return;
    for (ArrayChoice& choice : choices) {
      if (choice.name != array.GetName()) continue;
      choice.of_cells = cell_values == CellValues::constant;
      choice.is_at_both = true;
      return;
    }
    choices.push_back({array.GetName(), of_cells});
  });
  if (choices.size() == 1) return choices.front();
  const char* const flag = flag_of(take);
  std::string reason;
  if (!choices.empty())
    reason = fmt::format("several arrays suit, choose one with {}", flag);
  else if (name.empty())
    reason = fmt::format("no array suits ({})", wanted(take));
  else if (components_of_named == 0)
    reason = fmt::format("no array \"{}\" ({})", name, flag);
  else
    reason = fmt::format("array \"{}\" has {} component{}, and {} ({})", name, components_of_named,
                         components_of_named == 1 ? "" : "s", wanted(take), flag);
  throw std::invalid_argument(reason + "; " + list_of_arrays(mesh));
}

vtkSmartPointer<vtkDataSet> with_tensors(vtkDataSet& mesh, const ArrayChoice& array, Take take,
                                         const std::optional<TensorOrder>& order, CellValues cell_values) {
  vtkDataArray* const given = attributes_of(mesh, array.of_cells).GetArray(array.name.c_str());
  if (!given || !suits(given->GetNumberOfComponents(), take, true))
    throw std::invalid_argument(
        fmt::format("no array \"{}\" of which {}; {}", array.name, wanted(take), list_of_arrays(mesh)));
  const bool tensors_of_cells = array.of_cells && take == Take::tensor;
  if (cell_values == CellValues::constant && !tensors_of_cells)
    throw std::invalid_argument(fmt::format(
        "--cells constant needs tensors at cells, and {}: leave it out",
        take == Take::tensor ? fmt::format("array \"{}\" is at points", array.name) : "derivatives are at points"));
  const TensorOrder known_order = take == Take::tensor ? order_in(*given, order) : TensorOrder::full;
  const Array of_cells = tensors_of_cells ? tensors_in(point_values(*given), known_order) : nullptr;
  if (cell_values == CellValues::constant) return with_arrays(mesh, nullptr, of_cells);
  if (array.of_cells && take != Take::tensor) {
    const CellGradients gradients = cell_gradients(mesh, *given);
    for (const Array& tensors : {gradients.of_points, gradients.of_cells}) take_of_gradients(take, *tensors);
    mark_unusable_points(mesh, *gradients.of_points);
    return with_arrays(mesh, gradients.of_points, gradients.of_cells);
  }
  const Array values = array.of_cells ? averaged_to_points(mesh, *given) : point_values(*given);
  const Array tensors = take == Take::tensor ? tensors_in(values, known_order) : gradient_of(mesh, values);
  if (take != Take::tensor) take_of_gradients(take, *tensors);
  mark_unusable_points(mesh, *tensors);
  return with_arrays(mesh, tensors, of_cells);
}

const double* made_tensors(vtkDataSetAttributes& attributes) {
  auto* const array = vtkDoubleArray::SafeDownCast(attributes.GetArray(tensor_array));
  return array && array->GetNumberOfComponents() == 9 ? array->GetPointer(0) : nullptr;
}

}  // namespace tensorray
