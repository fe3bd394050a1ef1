#pragma once
/// @file tools/import/vtk/point_seams.h
/// Values at the points where parts of a mesh meet. Private to the importer.

#include "tools/import/vtk/vtk_pieces.h"

namespace tensorray {

/// Gives points at the same position, in different parts, the same values: the mean of theirs, weighted by the cells
/// that each part has there. Where the values of points are means of their cells, as VTK makes them for OpenFOAM, they
/// are then those of the whole mesh. Only arrays that all parts have, with as many components, change.
void share_point_values(const DataSets& parts);

}  // namespace tensorray
