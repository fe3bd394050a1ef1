#pragma once
/// The folders of an OpenFOAM case, regions and the parts that processors wrote, the order of its tensors, and what the
/// boundaryField of its fields prescribes for vectors at patches.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tools/import/meshes/cell_graph.h"

class vtkDataSet;

namespace tensorray {

/// A time of a case: the name of its folder, and its value.
struct OpenFoamTime {
  std::string folder;
  double value = 0;
};

/// A case as it is on the disk.
struct OpenFoamParts {
  std::filesystem::path folder;  ///< Has system/controlDict.
  /// Of a decomposed case, the folders of the processors: processor0, processor1, ..., or collated ones (processors4,
  /// or several as processors8_0-3), which have files of several processors. Empty: the case is whole.
  std::vector<std::filesystem::path> processors;
  bool is_collated = false;
  std::vector<OpenFoamTime> times;  ///< By their values; of a decomposed case those that all processors have.
};

/// Finds the parts of a case. A case that is whole and decomposed is decomposed if its processors have later times.
/// @throw std::runtime_error naming `path` and the fix: no controlDict, no mesh, a part of a mesh or one of the
/// processors is missing, no times.
OpenFoamParts openfoam_parts(const std::filesystem::path& path, const std::filesystem::path& folder);

/// Makes folders in `target` that are cases of one processor each, with one time: links to the folders of the
/// processors, or, of a collated case, files that are parts of its files.
/// @throw std::runtime_error naming the file: a collated file is damaged.
std::vector<std::filesystem::path> processor_cases(const OpenFoamParts& parts, const OpenFoamTime& time,
                                                   const std::filesystem::path& target);

/// The beginning of a file, which may be compressed, at most `size` bytes.
std::string openfoam_text(const std::filesystem::path& path, std::size_t size);
std::string without_comments(const std::string& text);

/// The words, perhaps in quotation marks, that follow a key and blanks.
std::vector<std::string> words_after(const std::string& text, const std::string& key);

/// Gives symmetric tensors that are `uniform` in their files VTK's order. OpenFOAM writes xx xy xz yy yz zz; VTK
/// changes lists to its own order, xx yy zz xy yz xz, but not what is uniform. Fields whose values are not in the file
/// itself (macros, #include) are taken as uniform if they are the same in all cells. Arrays whose components have names
/// are left alone.
/// @param time  The folder of the time that was read.
void correct_uniform_tensors(vtkDataSet& data, const std::filesystem::path& time);

/// By the names of fields.
using OpenFoamWalls = std::map<std::string, std::vector<Wall>>;

/// Adds the walls of all fields of class volVectorField: `noSlip` and types with a `value` are values, `zeroGradient`
/// is no gradient, `symmetry`, `symmetryPlane` and `slip` are slip. At patches of other types (`empty`, `wedge`,
/// `cyclic`, `processor`, ...) and at those that the file does not name nothing is prescribed.
/// @param folder  A case, with the folder of `time` in it. @throw as VTK's reader, through VtkMessages.
void add_openfoam_walls(const std::filesystem::path& folder, const OpenFoamTime& time, OpenFoamWalls& walls);

}  // namespace tensorray
