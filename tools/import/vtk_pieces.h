#pragma once
/// @file tools/import/vtk_pieces.h
/// One data set of what VTK's readers give. Private to the importer: it includes VTK.

#include <vtkDataObject.h>
#include <vtkDataSet.h>
#include <vtkSmartPointer.h>

namespace tensorray {

/// The one data set in `data`, which may be a tree of blocks; if there are several with cells, one unstructured grid of
/// all, points of equal position merged. An array that some blocks lack is there NaN (or zero, if of integers).
/// Null if there is none with cells.
///
/// Copies of neighbours' cells (duplicate ghosts) and hidden cells of unstructured grids are removed. Points are marked
/// as ghosts only where they are hidden: a copy of a neighbour's point has the neighbour's value.
vtkSmartPointer<vtkDataSet> one_data_set(vtkDataObject* data);

}  // namespace tensorray
