#include "tools/import/meshes/mesh_tensors.h"

#include <cctype>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
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
#include <vtkPointSet.h>
#include <vtkSmartPointer.h>
#include <vtkStructuredGrid.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>

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

vtkDataSetAttributes& attributes(vtkDataSet& mesh, bool of_cells) {
  if (of_cells) return *mesh.GetCellData();
  return *mesh.GetPointData();
}

/// Calls `visit(array, of_cells)` for the named numeric arrays, first those of points.
template <class Visit>
void for_each_array(vtkDataSet& mesh, const Visit& visit) {
  for (const bool of_cells : {false, true}) {
    vtkDataSetAttributes& data = attributes(mesh, of_cells);
    for (int i = 0; i < data.GetNumberOfArrays(); ++i) {
      vtkDataArray* array = data.GetArray(i);
      if (!array || !array->GetName()) continue;
      if (std::string(array->GetName()) != vtkDataSetAttributes::GhostArrayName()) visit(*array, of_cells);
    }
  }
}

const char* wanted(Take take) {
  return take == Take::tensor ? "a tensor has 6, 9, or more than 9 components, of a plane 4"
                              : "a vector has 3 components";
}

/// The order that the names of the first six components tell, as ParaView, CalculiX's converters and others write
/// them: XX, S_YY, xy, S13, ... The two indices may be swapped.
std::optional<TensorOrder> order_of_names(vtkDataArray& array) {
  std::string names;
  const int count = array.GetNumberOfComponents() == 4 ? 4 : 6;
  for (int i = 0; i < count; ++i) {
    const char* given = array.GetComponentName(i);
    const std::string name = given ? given : "";
    if (name.size() < 2) return {};
    std::string axes = name.substr(name.size() - 2);
    for (char& axis : axes) {
      axis = static_cast<char>(std::tolower(static_cast<unsigned char>(axis)));
      if (axis >= '1' && axis <= '3') axis = static_cast<char>('x' + (axis - '1'));
    }
    if (axes[0] > axes[1]) std::swap(axes[0], axes[1]);
    names += axes;
  }
  if (names == "xxyyzzxy") return TensorOrder::plane;
  if (names == "xxxyxyyy") return TensorOrder::two_by_two;
  if (names == "xxyyzzxyyzxz") return TensorOrder::vtk;
  if (names == "xxxyxzyyyzzz") return TensorOrder::fsl;
  if (names == "xxyyzzxyxzyz") return TensorOrder::mrtrix;
  if (names == "xxyyzzyzxzxy") return TensorOrder::voigt;
  if (names == "xxxyyyxzyzzz") return TensorOrder::lower_triangle;
  return {};
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

Array averaged_to_points(vtkDataSet& mesh, vtkDataArray& of_cells) {
  const int components = of_cells.GetNumberOfComponents();
  Array sums = new_array(mesh.GetNumberOfPoints(), components);
  std::vector<int> counts(static_cast<std::size_t>(mesh.GetNumberOfPoints()), 0);
  std::vector<double> value(static_cast<std::size_t>(components));
  MeshCell cell;
  for (vtkIdType id = 0; id < mesh.GetNumberOfCells(); ++id) {
    if (!cell.load(mesh, id)) continue;
    of_cells.GetTuple(id, value.data());
    for (int i = 0; i < cell.points(); ++i) {
      ++counts[static_cast<std::size_t>(cell.point(i))];
      double* sum = sums->GetPointer(cell.point(i) * components);
      for (std::size_t k = 0; k < value.size(); ++k) sum[k] += value[k];
    }
  }
  for (vtkIdType point = 0; point < mesh.GetNumberOfPoints(); ++point)
    for (int k = 0; k < components; ++k)
      *sums->GetPointer(point * components + k) /= counts[static_cast<std::size_t>(point)];  // 0/0 is NaN, as intended
  return sums;
}

/// The cells of a mesh that are three-dimensional and not hidden, with all points of the mesh.
vtkSmartPointer<vtkDataSet> visible_cells(vtkPointSet& mesh) {
  auto visible = vtkSmartPointer<vtkUnstructuredGrid>::New();
  visible->SetPoints(mesh.GetPoints());
  visible->Allocate(mesh.GetNumberOfCells());
  MeshCell cell;
  for (vtkIdType id = 0; id < mesh.GetNumberOfCells(); ++id)
    if (cell.load(mesh, id)) visible->InsertNextCell(cell.vtk().GetCellType(), cell.vtk().GetPointIds());
  return visible;
}

/// The mesh to differentiate on. On a curvilinear grid VTK takes differences along the grid and ignores that points
/// are hidden; on an unstructured grid it takes the mean of the cells' own derivatives.
vtkSmartPointer<vtkDataSet> differentiable(vtkDataSet& mesh) {
  auto* const curvilinear = vtkStructuredGrid::SafeDownCast(&mesh);
  if (curvilinear && (curvilinear->HasAnyBlankPoints() || curvilinear->HasAnyBlankCells()))
    return visible_cells(*curvilinear);
  auto bare = vtkSmartPointer<vtkDataSet>::Take(mesh.NewInstance());
  bare->CopyStructure(&mesh);
  return bare;
}

/// ∂v_i/∂x_j as component 3 i + j.
Array gradient_of(vtkDataSet& mesh, const Array& vectors) {
  const vtkSmartPointer<vtkDataSet> domain = differentiable(mesh);
  vectors->SetName("vector");
  domain->GetPointData()->AddArray(vectors);
  vtkNew<vtkGradientFilter> filter;
  filter->SetInputData(domain);
  filter->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "vector");
  filter->SetResultArrayName("gradient");
  // A mesh may list its surface as two-dimensional cells, which have only tangential derivatives.
  filter->SetContributingCellOption(vtkGradientFilter::DataSetMax);
  filter->Update();
  auto* const result = vtkDataSet::SafeDownCast(filter->GetOutputDataObject(0));
  vtkDataArray* const gradient = result ? result->GetPointData()->GetArray("gradient") : nullptr;
  if (!gradient || gradient->GetNumberOfComponents() != 9 || gradient->GetNumberOfTuples() != mesh.GetNumberOfPoints())
    throw std::runtime_error(fmt::format("VTK cannot differentiate on a mesh of class {}", mesh.GetClassName()));
  return point_values(*gradient);
}

void make_symmetric(vtkDoubleArray& tensors) {
  for (vtkIdType point = 0; point < tensors.GetNumberOfTuples(); ++point) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> tensor(tensors.GetPointer(9 * point));
    tensor = (0.5 * (tensor + tensor.transpose())).eval();
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

vtkSmartPointer<vtkDataSet> with_array(vtkDataSet& mesh, vtkDoubleArray& tensors) {
  auto result = vtkSmartPointer<vtkDataSet>::Take(mesh.NewInstance());
  result->CopyStructure(&mesh);
  for (const bool of_cells : {false, true})
    if (vtkDataArray* ghosts = attributes(mesh, of_cells).GetArray(vtkDataSetAttributes::GhostArrayName()))
      attributes(*result, of_cells).AddArray(ghosts);
  tensors.SetName(tensor_array);
  result->GetPointData()->AddArray(&tensors);
  return result;
}

}  // namespace

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
  if (array.GetNumberOfComponents() == 9) return TensorOrder::full;
  const std::optional<TensorOrder> said = order_of_names(array);
  if (given && said && *given != *said)
    throw std::invalid_argument(
        fmt::format("the file itself names the components of array \"{}\": they are {}, of which --order says "
                    "otherwise; leave --order out",
                    array.GetName(), component_names(array)));
  if (said) return *said;
  const int count = array.GetNumberOfComponents() == 4 ? 4 : 6;
  if (given && component_count(*given) == count) return *given;
  if (count == 4)
    throw std::invalid_argument(
        fmt::format("array \"{}\" has 4 components, a tensor of a plane in an order that it does not say: give --order "
                    "plane (xx yy zz xy) or 2x2 (xx xy yx yy)",
                    array.GetName()));
  std::string names;
  for (const std::string& name : tensor_order_names())
    if (component_count(tensor_order_of(name)) == 6) names += (names.empty() ? "" : ", ") + name;
  throw std::invalid_argument(
      fmt::format("array \"{}\" has {} components, of which the first six are a symmetric tensor, in an order that it "
                  "does not say: give --order, one of {}",
                  array.GetName(), array.GetNumberOfComponents(), names));
}

ArrayChoice choose_array(vtkDataSet& mesh, const std::string& name, Take take) {
  std::vector<ArrayChoice> choices;
  int components_of_named = 0;
  for_each_array(mesh, [&](vtkDataArray& array, bool of_cells) {
    if (!name.empty() && array.GetName() != name) return;
    components_of_named = array.GetNumberOfComponents();
    if (!suits(components_of_named, take, !name.empty())) return;
    for (const ArrayChoice& choice : choices)
      if (choice.name == array.GetName()) return;
    choices.push_back({array.GetName(), of_cells});
  });
  if (choices.size() == 1) return choices.front();
  const char* const flag = take == Take::tensor ? "--array" : take == Take::gradient ? "--gradient-of" : "--strain-of";
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
                                         const std::optional<TensorOrder>& order) {
  vtkDataArray* const given = attributes(mesh, array.of_cells).GetArray(array.name.c_str());
  if (!given || !suits(given->GetNumberOfComponents(), take, true))
    throw std::invalid_argument(
        fmt::format("no array \"{}\" of which {}; {}", array.name, wanted(take), list_of_arrays(mesh)));
  const TensorOrder known_order = take == Take::tensor ? order_in(*given, order) : TensorOrder::full;
  const Array values = array.of_cells ? averaged_to_points(mesh, *given) : point_values(*given);
  const Array tensors = take == Take::tensor ? tensors_in(values, known_order) : gradient_of(mesh, values);
  if (take == Take::strain) make_symmetric(*tensors);
  mark_unusable_points(mesh, *tensors);
  return with_array(mesh, *tensors);
}

}  // namespace tensorray
