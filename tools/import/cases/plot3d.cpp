// VTK's PLOT3D reader can find the form of a grid, but it is not used: it requires the q file to have the grid's form
// (a grid with record marks and a q file without them is an error), and it reports every mismatch as "is corrupt".
// Here each file has its own form, found from its exact length before any memory is allocated, and the error message
// says what does not fit.

#include "tools/import/cases/plot3d.h"

#include <fstream>
#include <limits>
#include <stdexcept>
#include <vector>

#include <vtkDataArray.h>
#include <vtkDataSetAttributes.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkStructuredGrid.h>
#include <vtkUnsignedCharArray.h>

#include "base/text/byte_order.h"
#include "tools/import/cases/plot3d_layout.h"
#include "tools/import/vtk/vtk_geometry.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

template <typename Number>
std::vector<Number> read_numbers(std::ifstream& file, const Path& path, bool big_endian, std::uintmax_t count) {
  std::vector<Number> numbers(static_cast<std::size_t>(count));
  auto* const bytes = reinterpret_cast<char*>(numbers.data());
  if (!file.read(bytes, static_cast<std::streamsize>(count * sizeof(Number)))) {
    throw std::runtime_error(path.string() + ": cannot be read to its end");
  }
  if (big_endian != (host_byte_order() == ByteOrder::big)) swap_bytes(bytes, numbers.size(), sizeof(Number));
  return numbers;
}

/// Reads the next component into `array`. A file stores the components one after the other, each for all points.
void read_component(std::ifstream& file, const Path& path, const Plot3dLayout& layout, vtkDataArray& array,
                    int component) {
  const auto store = [&](const auto& numbers) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      array.SetComponent(static_cast<vtkIdType>(i), component, static_cast<double>(numbers[i]));
    }
  };
  if (layout.real_size == 4) {
    store(read_numbers<float>(file, path, layout.big_endian, layout.points()));
  } else {
    store(read_numbers<double>(file, path, layout.big_endian, layout.points()));
  }
}

vtkSmartPointer<vtkDataArray> new_array(const Plot3dLayout& layout, const char* name, int components) {
  vtkSmartPointer<vtkDataArray> array;
  array.TakeReference(vtkDataArray::CreateDataArray(layout.real_size == 4 ? VTK_FLOAT : VTK_DOUBLE));
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(layout.points()));
  return array;
}

std::ifstream open_at(const Path& path, std::uintmax_t offset) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(offset));
  return file;
}

vtkSmartPointer<vtkStructuredGrid> read_grid(const Path& path, const Plot3dLayout& layout) {
  std::ifstream file = open_at(path, layout.numbers);
  const vtkSmartPointer<vtkDataArray> coordinates = new_array(layout, "Points", 3);
  for (int axis = 0; axis < 3; ++axis) read_component(file, path, layout, *coordinates, axis);

  vtkNew<vtkPoints> points;
  points->SetData(coordinates);
  auto grid = vtkSmartPointer<vtkStructuredGrid>::New();
  grid->SetDimensions(layout.size.x(), layout.size.y(), layout.size.z());
  grid->SetPoints(points);
  check_geometry(*grid, path);
  if (layout.blanking) {
    const auto blanks = read_numbers<std::int32_t>(file, path, layout.big_endian, layout.points());
    for (std::size_t i = 0; i < blanks.size(); ++i) {
      if (blanks[i] == 0) grid->BlankPoint(static_cast<vtkIdType>(i));
    }
  }
  return grid;
}

vtkSmartPointer<vtkDataArray> velocity_of(const Plot3dLayout& layout, vtkDataArray& density, vtkDataArray& momentum) {
  vtkSmartPointer<vtkDataArray> velocity = new_array(layout, "velocity", 3);
  for (vtkIdType i = 0; i < velocity->GetNumberOfTuples(); ++i) {
    const double rho = density.GetComponent(i, 0);
    for (int axis = 0; axis < 3; ++axis) {
      const double value = rho == 0 ? std::numeric_limits<double>::quiet_NaN() : momentum.GetComponent(i, axis) / rho;
      velocity->SetComponent(i, axis, value);
    }
  }
  return velocity;
}

void read_q(const Path& path, const Plot3dLayout& layout, vtkPointData& data) {
  std::ifstream file = open_at(path, layout.numbers);
  const auto density = new_array(layout, "density", 1), momentum = new_array(layout, "momentum", 3),
             energy = new_array(layout, "energy", 1);
  read_component(file, path, layout, *density, 0);
  for (int axis = 0; axis < 3; ++axis) read_component(file, path, layout, *momentum, axis);
  read_component(file, path, layout, *energy, 0);
  data.AddArray(density);
  data.AddArray(momentum);
  data.AddArray(energy);
  data.AddArray(velocity_of(layout, *density, *momentum));
}

}  // namespace

vtkSmartPointer<vtkDataSet> read_plot3d(const Path& grid, const Path& q) {
  const Plot3dLayout grid_layout = plot3d_grid_layout(grid);
  const Plot3dLayout q_layout = plot3d_q_layout(q, grid_layout.size);
  const vtkSmartPointer<vtkStructuredGrid> mesh = read_grid(grid, grid_layout);
  read_q(q, q_layout, *mesh->GetPointData());
  return mesh;
}

}  // namespace tensorray
