#pragma once
/// @file tools/import/import_file.h
/// Other programs' files → a tensor grid: finds the format, and takes the way from there that it needs.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/import/lattices/lattice.h"
#include "tools/import/meshes/mesh_sampling.h"
#include "tools/import/meshes/mesh_tensors.h"

namespace tensorray {

struct ImportSettings {
  /// One file; two for PLOT3D, the grid and its q.
  std::vector<std::filesystem::path> files;
  std::string array;  ///< Empty: the only one that suits.
  Take take = Take::tensor;
  std::optional<TensorOrder> order;  ///< Of six components, where the format does not say it.
  SamplingSettings sampling;         ///< For data on voxels only `bounds`, but in VTK's files.
  std::filesystem::path boundary;    ///< Where the body's surface goes; empty: nowhere.
};

/// What was found, and what became of it; of the two ways one.
struct ImportReport {
  std::optional<LatticeReport> lattice;
  std::optional<SamplingReport> mesh;
  std::size_t mesh_cells = 0, boundary_triangles = 0;
};

/// Voxels stay what they are; meshes are sampled. The grid has the array's name and, as metadata, its source.
/// VTK's readers may end the process on damaged files: call it in a process that may die.
/// @throw std::invalid_argument, std::runtime_error: one line that names the file or the flag, and the mend.
TensorGrid import_tensors(const ImportSettings& settings, const Progress& progress, ImportReport& report);

}  // namespace tensorray
