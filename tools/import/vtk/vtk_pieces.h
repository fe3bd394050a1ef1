#pragma once
/// @file tools/import/vtk/vtk_pieces.h
/// One data set of what VTK's readers give.

#include <vector>

class vtkDataObject;
class vtkDataSet;
template <class T>
class vtkSmartPointer;

namespace tensorray {

using DataSets = std::vector<vtkSmartPointer<vtkDataSet>>;

/// The data sets with cells in `data`, which may be a tree of blocks: copies that share their arrays.
DataSets data_sets_in(vtkDataObject* data);

/// The one data set among `pieces`; if there are several, one unstructured grid of all, points of equal position
/// merged. An array that some pieces lack is there NaN (or zero, if of integers). Null if there is none. The pieces'
/// ghosts change. Their geometry must be sound: see check_geometry in vtk_source.h.
///
/// Copies of neighbours' cells (duplicate ghosts) and hidden cells of unstructured grids are removed. Points are marked
/// as ghosts only where they are hidden: a copy of a neighbour's point has the neighbour's value.
vtkSmartPointer<vtkDataSet> one_data_set(const DataSets& pieces);

}  // namespace tensorray
