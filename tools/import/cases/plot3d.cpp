#include <limits>
#include <string>

#include <vtkDataArray.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkMultiBlockPLOT3DReader.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkStructuredGrid.h>

#include "base/errors.h"
#include "tools/import/cases/case_files.h"
#include "tools/import/vtk/vtk_data_sets.h"
#include "tools/import/vtk/vtk_messages.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

void require_plot3d_file(const Path& path) {
  if (!std::filesystem::exists(path)) fail(path, "does not exist; PLOT3D needs two files, the grid and its q file");
  require_no_device(path);
  if (!std::filesystem::is_regular_file(path)) fail(path, "is not a file");
}

vtkStructuredGrid& update(vtkMultiBlockPLOT3DReader& reader, const VtkMessages& messages, const Path& path) {
  reader.Update();
  if (const std::string& error = messages.first_error(); !error.empty())
    fail(path, "is cut off, or no such file of PLOT3D: " + error);
  const unsigned int blocks = reader.GetOutput()->GetNumberOfBlocks();
  if (blocks > 1) fail(path, "has " + std::to_string(blocks) + " blocks; write the one that matters alone");
  auto* const grid = blocks == 1 ? vtkStructuredGrid::SafeDownCast(reader.GetOutput()->GetBlock(0)) : nullptr;
  if (!grid || !grid->GetPoints())
    fail(path,
         "is no binary file of PLOT3D, is cut off, or does not fit the other file, which must have the same form");
  return *grid;
}

/// Also where VTK leaves the blanks as an array.
void hide_blanked_points(vtkStructuredGrid& grid) {
  vtkDataArray* const blanks = grid.GetPointData()->GetArray("IBlank");
  for (vtkIdType i = 0; blanks && i < blanks->GetNumberOfTuples(); ++i)
    if (blanks->GetComponent(i, 0) == 0) grid.BlankPoint(i);
  grid.GetPointData()->RemoveArray("IBlank");
}

/// VTK divides by 1 where the density is 0.
void add_velocity(vtkPointData& data) {
  vtkDataArray &density = *data.GetArray("density"), &momentum = *data.GetArray("momentum");
  const auto velocity = vtkSmartPointer<vtkDataArray>::Take(momentum.NewInstance());
  velocity->SetName("velocity");
  velocity->SetNumberOfComponents(3);
  velocity->SetNumberOfTuples(momentum.GetNumberOfTuples());
  for (vtkIdType i = 0; i < velocity->GetNumberOfTuples(); ++i) {
    const double rho = density.GetComponent(i, 0);
    for (int axis = 0; axis < 3; ++axis)
      velocity->SetComponent(
          i, axis, rho == 0 ? std::numeric_limits<double>::quiet_NaN() : momentum.GetComponent(i, axis) / rho);
  }
  data.AddArray(velocity);
}

}  // namespace

vtkSmartPointer<vtkDataSet> read_plot3d(const Path& grid_path, const Path& q_path) {
  for (const Path& path : {grid_path, q_path}) require_plot3d_file(path);
  const VtkMessages messages;
  vtkNew<vtkMultiBlockPLOT3DReader> reader;
  reader->AutoDetectFormatOn();
  reader->RemoveAllFunctions();
  reader->SetFileName(grid_path.c_str());
  check_geometry(update(*reader, messages, grid_path), grid_path);
  reader->SetQFileName(q_path.c_str());
  const vtkSmartPointer<vtkStructuredGrid> grid = &update(*reader, messages, q_path);
  vtkPointData& data = *grid->GetPointData();
  for (const auto& [theirs, ours] :
       {std::pair("Density", "density"), {"Momentum", "momentum"}, {"StagnationEnergy", "energy"}}) {
    if (!data.HasArray(theirs)) fail(q_path, "is cut off, or no q file of this grid, in the form that the grid has");
    data.GetArray(theirs)->SetName(ours);
  }
  hide_blanked_points(*grid);
  add_velocity(data);
  return grid;
}

}  // namespace tensorray
