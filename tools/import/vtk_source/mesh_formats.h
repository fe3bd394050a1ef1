#pragma once
/// The formats of meshes, and the readers that make VTK data sets of them: a new format is one row of the table.

#include <string>
#include <vector>

#include "tools/import/vtk/vtk_data_sets.h"

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

/// The format of a file, or of a folder (an OpenFOAM case), from its first bytes, not only from its name. Finds damage
/// that is cheap to find before VTK reads the file.
/// @throw std::runtime_error naming the file: missing; empty; of no format; an ending that belongs to another format;
/// an XML image whose origin or spacing is not finite numbers; cut off (an XML file without its end; a piece that is
/// missing, cut off or of another format); an image, rectilinear or structured grid whose pieces do not cover its
/// extent.
const MeshFormat& find_format(const std::filesystem::path& path);

/// The files that a file in pieces lists, in that order.
std::vector<std::filesystem::path> piece_files(const std::filesystem::path& path);

}  // namespace tensorray
