#pragma once
/// @file tools/import/vtk/vtk_pieces.h
/// Merges the data sets that VTK's readers return.

#include <vector>

class vtkDataObject;
class vtkDataSet;
template <class T>
class vtkSmartPointer;

namespace tensorray {

using DataSets = std::vector<vtkSmartPointer<vtkDataSet>>;

/// The data sets with cells in `data`, which may be a tree of blocks. They are copies that share their arrays.
DataSets data_sets_in(vtkDataObject* data);

/// Returns the only data set of `pieces`. If there are several, merges them into one unstructured grid, and merges
/// points at equal positions. An array that a piece lacks is NaN there (zero if it holds integers). Null if `pieces`
/// is empty. Changes the ghost arrays of the pieces. The geometry of the pieces must have passed check_geometry
/// (vtk_geometry.h).
///
/// Removes copies of neighbours' cells (duplicate ghosts), and hidden cells of unstructured grids. Points are marked
/// as ghosts only if they are hidden, because a copy of a neighbour's point has the neighbour's value.
/// @param merges_points  False: points at equal positions stay apart, where pieces have values of their own.
vtkSmartPointer<vtkDataSet> one_data_set(const DataSets& pieces, bool merges_points = true);

}  // namespace tensorray
