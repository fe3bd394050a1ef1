#pragma once
/// @file tools/import/vtk/vtk_collection.h
/// Files that only name other files: blocks (.vtm) and time series (.pvd). Private to the importer.

#include <filesystem>
#include <vector>

namespace tensorray {

/// The files of volumes that a collection names, in its order: all blocks of a .vtm, or what a .pvd names for its last
/// time. Surfaces (.vtp) are left out, because exporters put a body's patches beside its volume.
/// @throw std::runtime_error naming the file: no XML; names no volume; a time that is not a number.
std::vector<std::filesystem::path> collection_files(const std::filesystem::path& path);

}  // namespace tensorray
