#pragma once
/// @file tools/import/vtk_source/find_format.h
/// Finds the format of a file from its first bytes, not only from its name, and damage that is cheap to find before VTK
/// reads the file.

#include "tools/import/vtk_source/mesh_formats.h"

namespace tensorray {

/// The format of a file, or of a folder (an OpenFOAM case).
/// @throw std::runtime_error naming the file: missing; empty; of no format; an ending that belongs to another format;
/// an XML image whose origin or spacing is not finite numbers; cut off (an XML file without its end; a piece that is
/// missing, cut off or of another format); an image, rectilinear or structured grid whose pieces do not cover its
/// extent.
const MeshFormat& find_format(const std::filesystem::path& path);

}  // namespace tensorray
