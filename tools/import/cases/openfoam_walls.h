#pragma once
/// @file tools/import/cases/openfoam_walls.h
/// What the boundaryField of OpenFOAM's fields prescribes for vectors at patches.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tools/import/cases/openfoam.h"
#include "tools/import/meshes/cell_graph.h"

namespace tensorray {

/// By the names of fields.
using OpenFoamWalls = std::map<std::string, std::vector<Wall>>;

/// Adds the walls of all fields of class volVectorField: `noSlip` and types with a `value` are values, `zeroGradient`
/// is no gradient, `symmetry`, `symmetryPlane` and `slip` are slip. At patches of other types (`empty`, `wedge`,
/// `cyclic`, `processor`, ...) and at those that the file does not name nothing is prescribed.
/// @param folder  A case, with the folder of `time` in it. @throw as VTK's reader, through VtkMessages.
void add_openfoam_walls(const std::filesystem::path& folder, const OpenFoamTime& time, OpenFoamWalls& walls);

}  // namespace tensorray
