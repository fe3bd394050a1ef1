#pragma once
/// @file volumes/vtk_files.h
/// Points as VTK polydata. VTK itself stays in the .cpp.

#include <filesystem>

#include "volumes/point_files.h"

namespace tensorray {

/// Writes a vertex a point, its scalars and vectors as point data and the metadata as string field data; appended raw
/// binary, LZ4. @throw std::runtime_error naming the file and the reason, also when the disk is full.
void write_vtp(const std::filesystem::path& path, const PointCloud& points);

}  // namespace tensorray
