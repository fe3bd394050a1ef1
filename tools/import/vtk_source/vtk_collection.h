#pragma once
/// @file tools/import/vtk_source/vtk_collection.h
/// Files that only name other files: blocks (.vtm) and time series (.pvd). Private to the importer.

#include <filesystem>
#include <vector>

namespace tensorray {

/// The files of volumes, each once, that a collection names for each step of time, in the order of times, and of one
/// time in the collection's. A .vtm has one step, with all of its blocks. Surfaces (.vtp) are left out, because
/// exporters put a body's patches beside its volume.
/// @return at least one step. @throw std::runtime_error naming the file: no XML; names no volume; a time that is not a
/// number.
std::vector<std::vector<std::filesystem::path>> collection_steps(const std::filesystem::path& path);

}  // namespace tensorray
