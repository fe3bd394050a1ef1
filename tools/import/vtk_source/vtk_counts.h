#pragma once
/// @file tools/import/vtk_source/vtk_counts.h
/// Checks that VTK's files hold what they announce, before VTK reserves memory for it. Private to the importer.

#include <filesystem>

namespace tensorray {

/// @throw std::runtime_error naming the file: a tag announces points, cells or components that no file of its size
/// holds, however well it is compressed.
void check_xml_counts(const std::filesystem::path& path);

/// @throw std::runtime_error naming the file: a line announces more numbers than the file has bits.
void check_legacy_counts(const std::filesystem::path& path);

}  // namespace tensorray
