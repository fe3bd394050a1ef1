#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDoubleArray.h>
#include <vtkImageData.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkRectilinearGrid.h>
#include <vtkSmartPointer.h>
#include <vtkStructuredGrid.h>
#include <vtkUnstructuredGrid.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/hdf5/hdf5_meshes.h"
#include "tools/import/hdf5/xdmf_document.h"
#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {
namespace {

using Element = XmlElement;

/// A type of cells: its names, its number in mixed topologies, VTK's type, and its points (0: any number).
struct CellKind {
  std::vector<const char*> names;
  int number, type, points;
};

const std::vector<CellKind>& cell_kinds() {
  static const std::vector<CellKind> kinds = {
      {{"polyvertex"}, 1, VTK_POLY_VERTEX, 0},
      {{"polyline"}, 2, VTK_POLY_LINE, 0},
      {{"polygon"}, 3, VTK_POLYGON, 0},
      {{"triangle"}, 4, VTK_TRIANGLE, 3},
      {{"quadrilateral"}, 5, VTK_QUAD, 4},
      {{"tetrahedron"}, 6, VTK_TETRA, 4},
      {{"pyramid"}, 7, VTK_PYRAMID, 5},
      {{"wedge"}, 8, VTK_WEDGE, 6},
      {{"hexahedron"}, 9, VTK_HEXAHEDRON, 8},
      {{"edge_3", "edge3"}, 34, VTK_QUADRATIC_EDGE, 3},
      {{"quadrilateral_9", "quad_9"}, 35, VTK_BIQUADRATIC_QUAD, 9},
      {{"triangle_6", "tri_6"}, 36, VTK_QUADRATIC_TRIANGLE, 6},
      {{"quadrilateral_8", "quad_8"}, 37, VTK_QUADRATIC_QUAD, 8},
      {{"tetrahedron_10", "tet_10"}, 38, VTK_QUADRATIC_TETRA, 10},
      {{"pyramid_13"}, 39, VTK_QUADRATIC_PYRAMID, 13},
      {{"wedge_15"}, 40, VTK_QUADRATIC_WEDGE, 15},
      {{"wedge_18"}, 41, VTK_BIQUADRATIC_QUADRATIC_WEDGE, 18},
      {{"hexahedron_20", "hex_20"}, 48, VTK_QUADRATIC_HEXAHEDRON, 20},
      {{"hexahedron_24", "hex_24"}, 49, VTK_BIQUADRATIC_QUADRATIC_HEXAHEDRON, 24},
      {{"hexahedron_27", "hex_27"}, 50, VTK_TRIQUADRATIC_HEXAHEDRON, 27}};
  return kinds;
}

/// The grid that is being read.
struct Grid {
  const XdmfDocument& document;
  Element& element;

  [[noreturn]] void fail(const std::string& what) const {
    const std::string name = xml_attribute(element, {"Name"});
    tensorray::fail(document.path(), "its grid '" + escaped(name) + "' " + what);
  }

  /// The only element with a name; it may be a reference to another one.
  Element& child(const char* name) const {
    const std::vector<Element*> found = document.children(element, {name});
    if (found.empty()) fail(std::string("has no ") + name + "; write it again");
    const std::string reference = xml_attribute(*found.front(), {"Reference"});
    if (reference.empty()) return *found.front();
    const std::string path = lower_case(reference) == "xml" ? xml_text(*found.front()) : reference;
    const std::vector<Element*> there = document.find(path, *found.front());
    if (there.empty()) fail(std::string("has a ") + name + " that refers to what is not there: " + escaped(path));
    return *there.front();
  }

  std::vector<XdmfValues> values_in(Element& parent, std::size_t needed) const {
    std::vector<XdmfValues> values;
    for (Element* const item : document.children(parent, {"DataItem"})) values.push_back(xdmf_values(document, *item));
    if (values.size() < needed) fail("lacks numbers; write it again");
    return values;
  }
};

std::string type_of(Element& element, std::initializer_list<const char*> names) {
  return lower_case(xml_attribute(element, names));
}

void require_type(const Grid& grid, Element& geometry, std::initializer_list<const char*> types) {
  const std::string type = type_of(geometry, {"GeometryType", "Type"});
  if (std::none_of(types.begin(), types.end(), [&type](const char* one) { return type == one; }))
    grid.fail("has a geometry of the type " + escaped(type) + ", which does not fit its topology");
}

vtkSmartPointer<vtkPoints> points_of(const Grid& grid, Element& geometry) {
  const std::string type = type_of(geometry, {"GeometryType", "Type"});
  auto points = vtkSmartPointer<vtkPoints>::New();
  const int axes = type == "xy" || type == "x_y" ? 2 : 3;
  const bool is_apart = type == "x_y_z" || type == "x_y";
  if (!type.empty()) require_type(grid, geometry, {"xyz", "xy", "x_y_z", "x_y"});
  const std::vector<XdmfValues> values = grid.values_in(geometry, is_apart ? static_cast<std::size_t>(axes) : 1);
  const vtkIdType numbers = values[0].numbers->GetNumberOfTuples(), count = is_apart ? numbers : numbers / axes;
  for (const XdmfValues& one : values)
    if (one.numbers->GetNumberOfTuples() != numbers) grid.fail("has coordinates of different numbers of points");
  if (!is_apart && numbers % axes != 0) grid.fail("has coordinates that are no points");
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(count);
  for (vtkIdType i = 0; i < count; ++i) {
    double point[3] = {0, 0, 0};
    for (int axis = 0; axis < axes; ++axis)
      point[axis] = is_apart ? values[static_cast<std::size_t>(axis)].numbers->GetComponent(i, 0)
                             : values[0].numbers->GetComponent(i * axes + axis, 0);
    points->SetPoint(i, point);
  }
  return points;
}

/// Numbers of points along x, y and z; the file has them from the slowest axis to the fastest.
std::vector<int> structured_size(const Grid& grid, Element& topology) {
  std::vector<std::uint64_t> extents = integers_in(xml_attribute(topology, {"Dimensions", "NumberOfElements"}));
  std::reverse(extents.begin(), extents.end());
  extents.resize(3, 1);
  std::vector<int> size;
  double product = 1;
  for (const std::uint64_t extent : extents) {
    product *= static_cast<double>(extent);
    if (extent < 1 || extent > 1u << 30 || product > 1e15)
      grid.fail("has a topology without sizes, or with senseless ones; write it again");
    size.push_back(static_cast<int>(extent));
  }
  return size;
}

/// @param rank  2 or 3 axes, of which the file has the slowest first.
vtkSmartPointer<vtkDataSet> image_of(const Grid& grid, Element& topology, Element& geometry, std::size_t rank) {
  require_type(grid, geometry, {"origin_dxdydz", "origin_dxdy"});
  const std::vector<XdmfValues> values = grid.values_in(geometry, 2);
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(structured_size(grid, topology).data());
  double origin[3] = {0, 0, 0}, spacing[3] = {1, 1, 1};
  for (std::size_t i = 0; i < rank; ++i) {
    const auto from = static_cast<vtkIdType>(rank - 1 - i);
    if (values[0].numbers->GetNumberOfTuples() <= from || values[1].numbers->GetNumberOfTuples() <= from)
      grid.fail("has no origin or no spacing");
    origin[i] = values[0].numbers->GetComponent(from, 0);
    spacing[i] = values[1].numbers->GetComponent(from, 0);
  }
  if (rank == 2) spacing[2] = 0;
  image->SetOrigin(origin);
  image->SetSpacing(spacing);
  return image;
}

vtkSmartPointer<vtkDataSet> rectilinear_of(const Grid& grid, Element& topology, Element& geometry) {
  require_type(grid, geometry, {"vxvyvz", "vxvy"});
  const std::vector<XdmfValues> values = grid.values_in(geometry, 2);
  auto result = vtkSmartPointer<vtkRectilinearGrid>::New();
  const std::vector<int> size = structured_size(grid, topology);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (size[axis] != (axis < values.size() ? values[axis].numbers->GetNumberOfTuples() : 1))
      grid.fail("has other numbers of coordinates than its topology says");
  vtkNew<vtkDoubleArray> zero;
  zero->InsertNextValue(0);
  result->SetDimensions(size.data());
  result->SetXCoordinates(values[0].numbers);
  result->SetYCoordinates(values[1].numbers);
  result->SetZCoordinates(values.size() > 2 ? values[2].numbers.Get() : zero.Get());
  return result;
}

vtkSmartPointer<vtkDataSet> structured_of(const Grid& grid, Element& topology, Element& geometry) {
  auto result = vtkSmartPointer<vtkStructuredGrid>::New();
  const std::vector<int> size = structured_size(grid, topology);
  const vtkSmartPointer<vtkPoints> points = points_of(grid, geometry);
  if (static_cast<double>(points->GetNumberOfPoints()) != 1.0 * size[0] * size[1] * size[2])
    grid.fail("has another number of points than its topology says");
  result->SetDimensions(size.data());
  result->SetPoints(points);
  return result;
}

/// The number of the first point; 0 unless the file counts from another one.
vtkIdType first_point(const Grid& grid, Element& topology) {
  if (!xml_attribute(topology, {"Order"}).empty())
    grid.fail("has cells with an order of points of their own (Order), which is not read; save it as .vtu in ParaView");
  const std::string text = xml_attribute(topology, {"BaseOffset"});
  const std::vector<std::uint64_t> offset = integers_in(text);
  if (!text.empty() && (offset.size() != 1 || offset[0] > 1u << 30)) grid.fail("has a BaseOffset that is no number");
  return text.empty() ? 0 : static_cast<vtkIdType>(offset[0]);
}

/// Each cell is the number of its type, for types without a number of points their number, and its points.
void add_mixed_cells(const Grid& grid, vtkDataArray& numbers, vtkIdType first, vtkUnstructuredGrid& result) {
  const vtkIdType count = numbers.GetNumberOfTuples();
  const auto next = [&](vtkIdType& at) {
    if (at >= count) grid.fail("has a mixed topology that is cut off");
    return static_cast<vtkIdType>(numbers.GetComponent(at++, 0));
  };
  std::vector<vtkIdType> ids;
  for (vtkIdType at = 0; at < count;) {
    const vtkIdType number = next(at);
    const auto kind = std::find_if(cell_kinds().begin(), cell_kinds().end(),
                                   [number](const CellKind& k) { return k.number == number; });
    if (kind == cell_kinds().end())
      grid.fail("has cells of the type " + std::to_string(number) +
                ", which are not read; save it as .vtu in ParaView");
    const vtkIdType points = kind->points > 0 ? kind->points : next(at);
    if (points < 0 || points > count - at) grid.fail("has a mixed topology that is cut off");
    ids.clear();
    for (vtkIdType i = 0; i < points; ++i) ids.push_back(next(at) - first);
    result.InsertNextCell(kind->type, points, ids.data());
  }
}

vtkSmartPointer<vtkDataSet> unstructured_of(const Grid& grid, Element& topology, Element& geometry,
                                            const std::string& type) {
  auto result = vtkSmartPointer<vtkUnstructuredGrid>::New();
  result->SetPoints(points_of(grid, geometry));
  const XdmfValues values = grid.values_in(topology, 1).front();
  vtkDataArray& numbers = *values.numbers;
  const vtkIdType first = first_point(grid, topology);
  result->Allocate(std::max<vtkIdType>(1, numbers.GetNumberOfTuples() / 4));
  if (type == "mixed") {
    add_mixed_cells(grid, numbers, first, *result);
    return result;
  }
  const auto kind = std::find_if(cell_kinds().begin(), cell_kinds().end(), [&type](const CellKind& k) {
    return std::any_of(k.names.begin(), k.names.end(), [&type](const char* name) { return type == name; });
  });
  if (kind == cell_kinds().end())
    grid.fail("has a topology of the type " + escaped(type) + ", which is not read; save it as .vtu in ParaView");
  vtkIdType points = kind->points;
  if (points == 0) {
    const std::vector<std::uint64_t> said = integers_in(xml_attribute(topology, {"NodesPerElement"}));
    points = said.size() == 1 && said[0] < 1000 ? static_cast<vtkIdType>(said[0]) : 1;
  }
  if (points < 1 || numbers.GetNumberOfTuples() % points != 0) grid.fail("has a topology that is cut off");
  std::vector<vtkIdType> ids(static_cast<std::size_t>(points));
  for (vtkIdType at = 0; at < numbers.GetNumberOfTuples(); at += points) {
    for (vtkIdType i = 0; i < points; ++i)
      ids[static_cast<std::size_t>(i)] = static_cast<vtkIdType>(numbers.GetComponent(at + i, 0)) - first;
    result->InsertNextCell(kind->type, points, ids.data());
  }
  return result;
}

vtkSmartPointer<vtkDataSet> mesh_of(const Grid& grid) {
  Element &topology = grid.child("Topology"), &geometry = grid.child("Geometry");
  const std::string type = type_of(topology, {"TopologyType", "Type"});
  if (type == "3dcorectmesh") return image_of(grid, topology, geometry, 3);
  if (type == "2dcorectmesh") return image_of(grid, topology, geometry, 2);
  if (type == "3drectmesh" || type == "2drectmesh") return rectilinear_of(grid, topology, geometry);
  if (type == "3dsmesh" || type == "2dsmesh") return structured_of(grid, topology, geometry);
  return unstructured_of(grid, topology, geometry, type);
}

void add_attributes(const Grid& grid, vtkDataSet& mesh) {
  for (Element* const attribute : grid.document.children(grid.element, {"Attribute"})) {
    const std::string name = xml_attribute(*attribute, {"Name"}), centre = type_of(*attribute, {"Center"});
    if (type_of(*attribute, {"ItemType"}) == "finiteelementfunction") continue;
    if (centre != "cell" && centre != "node" && !centre.empty()) continue;
    const vtkIdType count = centre == "cell" ? mesh.GetNumberOfCells() : mesh.GetNumberOfPoints();
    const vtkSmartPointer<vtkDataArray> values = grid.values_in(*attribute, 1).front().numbers;
    const vtkIdType numbers = values->GetNumberOfValues();
    if (count == 0 || numbers == 0 || numbers % count != 0 || numbers / count > 64)
      grid.fail("has an attribute '" + escaped(name) + "' of " + std::to_string(numbers) + " numbers for " +
                std::to_string(count) + (centre == "cell" ? " cells" : " points") + ": cut off, or of another mesh");
    values->SetName(name.c_str());
    values->SetNumberOfComponents(static_cast<int>(numbers / count));
    values->SetNumberOfTuples(count);
    if (centre == "cell") mesh.GetCellData()->AddArray(values);
    if (centre != "cell") mesh.GetPointData()->AddArray(values);
  }
}

void add_arrays(vtkDataSet& from, vtkDataSet& to) {
  for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL})
    for (int i = 0; i < from.GetAttributes(type)->GetNumberOfArrays(); ++i)
      to.GetAttributes(type)->AddArray(from.GetAttributes(type)->GetArray(i));
}

vtkSmartPointer<vtkDataObject> read_grids(const XdmfDocument& document, int step) {
  DataSets meshes;
  for (Element* const element : document.grids(step)) {
    const Grid grid{document, *element};
    const vtkSmartPointer<vtkDataSet> mesh = mesh_of(grid);
    add_attributes(grid, *mesh);
    const auto same =
        std::find_if(meshes.begin(), meshes.end(), [&](const auto& other) { return is_same_mesh(*mesh, *other); });
    if (same == meshes.end())
      meshes.push_back(mesh);
    else
      add_arrays(*mesh, **same);
  }
  auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
  for (std::size_t i = 0; i < meshes.size(); ++i) blocks->SetBlock(static_cast<unsigned int>(i), meshes[i]);
  return blocks;
}

}  // namespace

MeshFile open_xdmf(const std::filesystem::path& path) {
  const auto document = std::make_shared<const XdmfDocument>(path);
  return {document->steps(), [document](int step) { return read_grids(*document, step); }};
}

}  // namespace tensorray
