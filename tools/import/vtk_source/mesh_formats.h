#pragma once
/// @file tools/import/vtk_source/mesh_formats.h
/// The formats of meshes, and the readers that make VTK data sets of them: a new format is one row of the table.

#include <string>
#include <vector>

#include "tools/import/vtk/mesh_file.h"

namespace tensorray {

struct MeshFormat {
  std::string text;                  ///< For messages.
  std::string xml_type;              ///< The type in <VTKFile type="...">; empty if the format is not VTK's XML.
  std::vector<std::string> endings;  ///< Lower case.
  MeshFile (*open)(const std::filesystem::path& path) = nullptr;  ///< Null: a collection, which only names other files.
  bool has_other_files = false;                                   ///< Which hold its numbers.

  bool is_in_pieces() const { return xml_type.compare(0, 1, "P") == 0; }
};

/// All formats. A collection names files of formats before it.
const std::vector<MeshFormat>& mesh_formats();

/// The format that has an ending; null if none has.
const MeshFormat* format_with_ending(const std::string& ending);

/// The files that a file in pieces lists, in that order.
std::vector<std::filesystem::path> piece_files(const std::filesystem::path& path);

}  // namespace tensorray
