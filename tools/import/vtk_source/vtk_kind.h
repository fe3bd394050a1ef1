#pragma once
/// @file tools/import/vtk_source/vtk_kind.h
/// Finds the kind of a file for VTK from its first bytes, not only from its name, and finds damage that is cheap to
/// detect before VTK reads the file. Private to the importer.

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
  cgns,
  openfoam,
  ensight,
  xdmf,
  vtkhdf,
  blocks,       ///< .vtm, which names files of the kinds above.
  time_series,  ///< .pvd, which names files of the kinds above, also .vtm.
};

/// The kind of a file, or of a folder (an OpenFOAM case).
/// @throw std::runtime_error naming the file: missing; empty; none of the kinds above; an ending that belongs to
/// another kind; an XML image whose origin or spacing is not finite numbers; cut off (an XML file without its end; a
/// piece that is missing, cut off or of another kind; a legacy file without its line DATASET); an image, rectilinear
/// or structured grid whose pieces do not cover its extent; only surfaces; an OpenFOAM case without mesh, times or
/// controlDict.
VtkKind vtk_kind(const std::filesystem::path& path);

/// The files that a file in pieces lists, in that order.
std::vector<std::filesystem::path> piece_files(const std::filesystem::path& path);

/// The folder of the OpenFOAM case of `path`, which is that folder, a .foam file in it, or its system/controlDict.
std::filesystem::path openfoam_case(const std::filesystem::path& path);

}  // namespace tensorray
