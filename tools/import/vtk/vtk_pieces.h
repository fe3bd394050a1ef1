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

/// Whether both have the same points and cells.
bool is_same_mesh(vtkDataSet& a, vtkDataSet& b);

/// Returns the only data set of `pieces`. If there are several, merges them into one unstructured grid, and merges
/// points at equal positions, which take the values of the first piece in which they are finite. An array that a piece
/// lacks is NaN there. Tensors whose components have different names there are sorted by them. Null if `pieces` is
/// empty. Changes the ghost arrays of the pieces. The geometry of the pieces must have passed check_geometry
/// (vtk_geometry.h).
///
/// Ghosts of all kinds of data sets mean the same. Of an only data set hidden cells and points stay marked (refined
/// cells count as hidden), and copies of neighbours' cells and points stay, whose values are right. Of several, hidden
/// cells, cells with hidden points, and copies are removed.
/// @param merges_points  False: points at equal positions stay apart, where pieces have values of their own.
vtkSmartPointer<vtkDataSet> one_data_set(const DataSets& pieces, bool merges_points = true);

}  // namespace tensorray
