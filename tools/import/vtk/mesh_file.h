#pragma once
/// @file tools/import/vtk/mesh_file.h
/// A file of a mesh that has been opened.

#include <filesystem>
#include <functional>

#include <vtkSmartPointer.h>

class vtkDataObject;

namespace tensorray {

struct MeshFile {
  int steps = 1;  ///< Of time; 0 or 1 if it has none.
  /// Reads the data set, or a tree of them, at a step from 0 on. @throw std::runtime_error naming the file and the fix.
  std::function<vtkSmartPointer<vtkDataObject>(int step)> read;
};

/// What reading a file may take at most, bytes: a small one may announce any number of points. (LZMA makes 7000 bytes
/// of one; threads have stacks.)
inline double max_memory_of(const std::filesystem::path& path) {
  return 0x1p30 + 8000.0 * static_cast<double>(std::filesystem::file_size(path));
}

}  // namespace tensorray
