#pragma once
/// @file tools/import/vtk/vtk_kind.h
/// What a file is that VTK shall read, by its first bytes and not by its name alone; and the damage that can be seen
/// cheaply, before VTK's readers meet it. Private to the importer.

#include <filesystem>
#include <vector>

namespace tensorray {

enum class VtkKind {
  legacy,
  image,
  rectilinear,
  structured,
  unstructured,
  image_pieces,
  rectilinear_pieces,
  structured_pieces,
  unstructured_pieces,
  exodus,
  openfoam,
};

/// The kind of a file, or of a folder (an OpenFOAM case).
/// @throw std::runtime_error naming the file: missing; empty; of no kind above; named by the ending of another kind;
/// an XML image whose origin or spacing are no finite numbers; cut off (an XML file without its end; a piece that is
/// missing, cut off or of another kind; a legacy file without its line DATASET); an image, rectilinear or structured
/// grid with parts of its extent in none of its pieces; surfaces alone; an OpenFOAM case without mesh, times or
/// controlDict, or decomposed.
VtkKind vtk_kind(const std::filesystem::path& path);

/// The files that a file in pieces names, in its order.
std::vector<std::filesystem::path> piece_files(const std::filesystem::path& path);

/// The folder of the OpenFOAM case of `path`: the folder itself, or of a .foam file or a system/controlDict in it.
std::filesystem::path openfoam_case(const std::filesystem::path& path);

}  // namespace tensorray
