#pragma once
/// @file tools/import/vtk_formats/vtk_counts.h
/// Checks that VTK's files hold what they announce, before VTK reserves memory for it. Private to the importer.

#include <filesystem>
#include <string>

namespace tensorray {

/// What a tag announces (points, cells or components) that no file of this size holds, however well it is compressed,
/// as a reason without the file; empty if there is none.
std::string impossible_xml_count(const std::filesystem::path& path);

/// The same of a line in a legacy file, where it announces more numbers than the file has bits.
std::string impossible_legacy_count(const std::filesystem::path& path);

}  // namespace tensorray
