#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSetAttributes.h>
#include <vtkIdTypeArray.h>
#include <vtkImageData.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/hdf5/hdf5_file.h"
#include "tools/import/hdf5/hdf5_meshes.h"
#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;
using Array = vtkSmartPointer<vtkDataArray>;
using Sizes = std::vector<std::uint64_t>;

const std::string root = "/VTKHDF";

struct File {
  Path path;
  Hdf5File hdf;
  std::string type;

  explicit File(const Path& p) : path(p), hdf(p) {
    if (!hdf.has(root))
      fail(path, "is HDF5, but not VTKHDF: it has no group VTKHDF; XDMF files name such a file (.xdmf)");
    const double version = hdf.numbers(root, "Version")[0];
    if (version > 2)
      fail(path, "is of version " + std::to_string(static_cast<int>(version)) + " of VTKHDF; save it as .vtu");
    type = hdf.text(root, "Type");
    if (type != "UnstructuredGrid" && type != "ImageData")
      fail(path, "holds a data set of type " + escaped(type) +
                     ", and only ImageData and UnstructuredGrid are read; save "
                     "its volume as .vtu, or .vtm if it has several blocks");
  }

  bool has_steps() const { return hdf.has(root + "/Steps"); }

  /// The arrays of numbers in a group: there may be text, too.
  std::vector<std::string> arrays(const std::string& group) const {
    std::vector<std::string> names = hdf.children(root + "/" + group);
    const auto is_other = [&](const std::string& name) { return !hdf.has_numbers(root + "/" + group + "/" + name); };
    names.erase(std::remove_if(names.begin(), names.end(), is_other), names.end());
    return names;
  }

  /// The rows from `first` on of a dataset.
  Array rows(const std::string& name, std::uint64_t first, std::uint64_t count) const {
    Sizes shape = hdf.shape(root + "/" + name), start(shape.size(), 0), stride(shape.size(), 1);
    if (shape.empty()) fail(path, "its " + name + " is no list");
    start[0] = first;
    shape[0] = count;
    return hdf.read(root + "/" + name, {start, stride, shape});
  }

  /// A number of a list; `standard` if the file has no such list.
  std::uint64_t number(const std::string& name, std::uint64_t i, std::uint64_t standard) const {
    if (!hdf.has(root + "/" + name)) return standard;
    const double value = rows(name, i, 1)->GetComponent(0, 0);
    if (!(value >= 0 && value < 1e18)) fail(path, "is damaged: " + name);
    return static_cast<std::uint64_t>(value);
  }
};

/// Names an array, and divides its numbers among tuples. @return whether they fit.
bool shape_array(vtkDataArray& array, const std::string& name, std::uint64_t tuples) {
  const auto values = static_cast<std::uint64_t>(array.GetNumberOfValues());
  if (tuples == 0 || values % tuples != 0 || values / tuples > 64) return false;
  array.SetName(name.c_str());
  array.SetNumberOfComponents(static_cast<int>(values / tuples));
  array.SetNumberOfTuples(static_cast<vtkIdType>(tuples));
  return true;
}

/// Where a part of an unstructured grid begins in the file's lists.
struct Part {
  std::uint64_t points = 0, cells = 0, ids = 0;                 ///< Numbers of them.
  std::uint64_t first_point = 0, first_cell = 0, first_id = 0;  ///< Of the geometry.
  std::uint64_t first_offset = 0;                               ///< Each part has one more than it has cells.
  std::uint64_t point_value = 0, cell_value = 0;                ///< Of parts before it at this step.
  std::uint64_t index = 0;                                      ///< Among all parts of the file.
};

std::vector<Part> parts_at(const File& file, int step) {
  const auto all = file.hdf.shape(root + "/NumberOfPoints");
  if (all.size() != 1) fail(file.path, "is damaged: NumberOfPoints");
  const auto s = static_cast<std::uint64_t>(step);
  std::uint64_t first = 0, count = all[0];
  Part next;
  if (file.has_steps()) {
    first = file.number("Steps/PartOffsets", s, 0);
    count = file.number("Steps/NumberOfParts", s, all[0]);
    next.first_point = file.number("Steps/PointOffsets", s, 0);
    next.first_cell = file.number("Steps/CellOffsets", s, 0);
    next.first_id = file.number("Steps/ConnectivityIdOffsets", s, 0);
  }
  if (count > all[0] || first > all[0] - count)
    fail(file.path, "is damaged: its parts at step " + std::to_string(step + 1));
  next.first_offset = next.first_cell + first;
  std::vector<Part> parts;
  for (std::uint64_t i = first; i < first + count; ++i) {
    next.points = file.number("NumberOfPoints", i, 0);
    next.cells = file.number("NumberOfCells", i, 0);
    next.ids = file.number("NumberOfConnectivityIds", i, 0);
    next.index = i;
    parts.push_back(next);
    next.first_point += next.points;
    next.first_cell += next.cells;
    next.first_id += next.ids;
    next.first_offset += next.cells + 1;
    next.point_value += next.points;
    next.cell_value += next.cells;
  }
  return parts;
}

/// Rows of a list of integers.
std::vector<vtkIdType> integers(const File& file, const std::string& name, std::uint64_t first, std::uint64_t count) {
  const Array rows = file.rows(name, first, count);
  auto* const array = vtkIdTypeArray::SafeDownCast(rows);
  if (!array) fail(file.path, "is damaged: its " + name + " are no integers");
  return {array->GetPointer(0), array->GetPointer(0) + array->GetNumberOfValues()};
}

/// Sets the cells of a grid that may have polyhedra. Lists of offsets have one more for each part, which is 0.
void set_cells(const File& file, const Part& part, vtkUnsignedCharArray& types, vtkCellArray& cells,
               vtkUnstructuredGrid& grid) {
  const unsigned char* const first = types.GetPointer(0);
  if (std::count(first, first + types.GetNumberOfValues(), VTK_POLYHEDRON) == 0) return grid.SetCells(&types, &cells);
  std::uint64_t faces = 0, face_points = 0, cell_faces = 0;  // Of the parts before.
  for (std::uint64_t i = 0; i < part.index; ++i) {
    faces += file.number("NumberOfFaces", i, 0);
    face_points += file.number("NumberOfFaceConnectivityIds", i, 0);
    cell_faces += file.number("NumberOfPolyhedronToFaceIds", i, 0);
  }
  const auto count = [&](const char* name) { return file.number(name, part.index, 0); };
  FaceTables tables;
  tables.points = integers(file, "FaceConnectivity", face_points, count("NumberOfFaceConnectivityIds"));
  tables.point_ends = integers(file, "FaceOffsets", faces + part.index + 1, count("NumberOfFaces"));
  tables.faces = integers(file, "PolyhedronToFaces", cell_faces, count("NumberOfPolyhedronToFaceIds"));
  tables.face_ends = integers(file, "PolyhedronOffsets", part.first_offset + 1, part.cells);
  vtkNew<vtkIdTypeArray> locations, streams;
  if (!append_faces(tables, 0, *locations, *streams))
    fail(file.path, "is damaged: its polyhedra name faces that are not there; copy or write it again");
  grid.SetCells(&types, &cells, locations, streams);
}

vtkSmartPointer<vtkUnstructuredGrid> grid_of(const File& file, const Part& part) {
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  const Array coordinates = file.rows("Points", part.first_point, part.points);
  if (!shape_array(*coordinates, "Points", part.points) || coordinates->GetNumberOfComponents() != 3)
    fail(file.path, "is damaged: its points have no three coordinates");
  vtkNew<vtkPoints> points;
  points->SetData(coordinates);
  grid->SetPoints(points);
  const Array types = file.rows("Types", part.first_cell, part.cells);
  vtkNew<vtkUnsignedCharArray> cell_types;
  cell_types->SetNumberOfValues(types->GetNumberOfTuples());
  for (vtkIdType i = 0; i < types->GetNumberOfTuples(); ++i) {
    const double type = types->GetComponent(i, 0);
    cell_types->SetValue(i, static_cast<unsigned char>(std::clamp(type, 0.0, 255.0)));
  }
  const Array offsets = file.rows("Offsets", part.first_offset, part.cells + 1),
              ids = file.rows("Connectivity", part.first_id, part.ids);
  vtkNew<vtkCellArray> cells;
  if (!vtkIdTypeArray::SafeDownCast(offsets) || !vtkIdTypeArray::SafeDownCast(ids) || !cells->SetData(offsets, ids))
    fail(file.path, "is damaged: its cells' points are no integers");
  set_cells(file, part, *cell_types, *cells, *grid);
  return grid;
}

/// Adds the values of a group of arrays. @param before  Values of the parts before. @param count  Of this part.
void add_values(const File& file, const std::string& group, int step, std::uint64_t before, std::uint64_t count,
                vtkDataSetAttributes& target) {
  for (const std::string& name : file.arrays(group)) {
    const std::uint64_t first =
        file.has_steps() ? file.number("Steps/" + group + "Offsets/" + name, static_cast<std::uint64_t>(step), 0) : 0;
    const Array values = file.rows(group + "/" + name, first + before, count);
    if (shape_array(*values, name, count)) target.AddArray(values);
  }
}

vtkSmartPointer<vtkDataObject> read_grids(const File& file, int step) {
  auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
  unsigned int index = 0;
  for (const Part& part : parts_at(file, step)) {
    if (part.cells == 0) continue;
    const auto grid = grid_of(file, part);
    add_values(file, "PointData", step, part.point_value, part.points, *grid->GetPointData());
    add_values(file, "CellData", step, part.cell_value, part.cells, *grid->GetCellData());
    blocks->SetBlock(index++, grid);
  }
  return blocks;
}

/// An image's arrays have the shape (z, y, x) or (z, y, x, components). Those that change in time have steps before it;
/// their offsets tell which one.
void add_image_values(const File& file, const std::string& group, int step, const Sizes& size,
                      vtkDataSetAttributes& target) {
  for (const std::string& name : file.arrays(group)) {
    const std::string dataset = group + "/" + name;
    const Sizes shape = file.hdf.shape(root + "/" + dataset);
    const bool has_steps = file.has_steps() && shape.size() > 3 && std::equal(size.begin(), size.end(), &shape[1]);
    const auto row = static_cast<std::uint64_t>(step);
    const Array values = has_steps ? file.rows(dataset, file.number("Steps/" + group + "Offsets/" + name, row, row), 1)
                                   : file.hdf.read(root + "/" + dataset);
    if (shape_array(*values, name, size[0] * size[1] * size[2])) target.AddArray(values);
  }
}

vtkSmartPointer<vtkDataObject> read_image(const File& file, int step) {
  const std::vector<double> extent = file.hdf.numbers(root, "WholeExtent"), origin = file.hdf.numbers(root, "Origin"),
                            spacing = file.hdf.numbers(root, "Spacing");
  if (extent.size() != 6 || origin.size() != 3 || spacing.size() != 3)
    fail(file.path, "is damaged: its WholeExtent, Origin or Spacing");
  auto image = vtkSmartPointer<vtkImageData>::New();
  int whole[6];
  for (std::size_t i = 0; i < 6; ++i) {
    if (!(std::abs(extent[i]) < std::numeric_limits<int>::max()) || (i % 2 == 1 && extent[i] < extent[i - 1]))
      fail(file.path, "is damaged: its WholeExtent");
    whole[i] = static_cast<int>(extent[i]);
  }
  image->SetExtent(whole);
  image->SetOrigin(origin.data());
  image->SetSpacing(spacing.data());
  if (file.hdf.has_attribute(root, "Direction"))
    if (const std::vector<double> direction = file.hdf.numbers(root, "Direction"); direction.size() == 9)
      image->SetDirectionMatrix(direction.data());
  Sizes points, cells;
  for (const int axis : {2, 1, 0}) {
    points.push_back(static_cast<std::uint64_t>(image->GetDimensions()[axis]));
    cells.push_back(std::max<std::uint64_t>(1, points.back() - 1));
  }
  add_image_values(file, "PointData", step, points, *image->GetPointData());
  add_image_values(file, "CellData", step, cells, *image->GetCellData());
  return image;
}

}  // namespace

MeshFile open_vtkhdf(const Path& path) {
  const auto file = std::make_shared<const File>(path);
  const double steps = file->has_steps() ? file->hdf.numbers(root + "/Steps", "NSteps")[0] : 1;
  if (!(steps >= 1 && steps < 1e9)) fail(path, "is damaged: its number of steps");
  return {static_cast<int>(steps),
          [file](int step) { return file->type == "ImageData" ? read_image(*file, step) : read_grids(*file, step); }};
}

}  // namespace tensorray
