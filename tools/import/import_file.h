#pragma once
/// Reads tensors from files of other programs: finds the format and calls its reader. Two ways lead to a TensorGrid.
/// The voxels of a Lattice are kept. A mesh is a VTK data set whose cells are checked (vtk_data_sets.h): it gets
/// tensors at its points or cells (mesh_tensors.h), and is sampled at voxels (mesh_sampling.h).

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/import/lattices/lattice.h"
#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/sampling/mesh_sampling.h"
#include "tools/import/surfaces/body_surface.h"

namespace tensorray {

struct ImportSettings {
  /// One file. For PLOT3D two: the grid file and the q file. Of Nemesis, any number of pieces of one mesh.
  std::vector<std::filesystem::path> files;
  std::string array;  ///< Its name, or a list of its components (mesh_tensors.h); empty: the only suitable one.
  Take take = Take::tensor;
  bool negate = false;                          ///< Whether tensors change their signs.
  CellValues cell_values = CellValues::linear;  ///< Of tensors at the cells of a mesh.
  std::optional<TensorOrder> order;             ///< Order of six components, where the file does not state it.
  /// For files of voxels only `bounds` is used, except for VTK files; for .npy also a voxel size, that of the file.
  SamplingSettings sampling;
  std::optional<double> thickness;        ///< Of a flat mesh or image; none: a typical edge of its cells.
  std::optional<Eigen::Vector3d> voxel;   ///< Distances of voxels along x, y and z; of .npy only.
  std::optional<Eigen::Vector3d> origin;  ///< World position of the first voxel's centre; of .npy only.
  std::optional<ComponentFrame> frame;    ///< Axes of the components, where the file does not state them; of RAS files.
  std::optional<int> step;                ///< Of the steps of time, from 0 on; none: the last one.
  std::filesystem::path mask;      ///< Of files of voxels: a file with a number for each, 0 outside; empty: none.
  std::filesystem::path boundary;  ///< File for the surface of the body; empty: none.
  bool surface = true;             ///< Whether the grid of a mesh gets the surface of the body that the mesh is.
};

/// What was found in the files and how it was converted. Only one of the two reports is filled.
struct ImportReport {
  std::optional<LatticeReport> lattice;
  std::optional<SamplingReport> mesh;
  std::size_t mesh_cells = 0, boundary_triangles = 0;
  std::optional<BodySurface> surface;  ///< Without its triangles, which the grid has.
  double thickness = 0;                ///< Of the slab that a flat mesh has become; 0: it was none.
  std::vector<std::string> notes;      ///< Of the mesh: guesses that were made, and what was left out, for the user.
  std::vector<std::string> warnings;   ///< Of all formats: tensors that are hardly meant.
};

/// Reads voxels as they are, and samples meshes. The grid gets the array's name, and its source as metadata. VTK's
/// readers may end the process on damaged files: call this in a child process (child_process.h).
/// @throw std::invalid_argument, std::runtime_error: one line that names the file or the flag, and the fix.
TensorGrid import_tensors(const ImportSettings& settings, const Progress& progress, ImportReport& report);

/// The number of steps of time in the files. @throw as import_tensors.
int time_steps(const ImportSettings& settings);

}  // namespace tensorray
