#pragma once
/// @file tools/import/vtk/overlaps.h
/// Finds which data sets overlap.

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {

/// The mean point of a cell, and its dimensions.
struct CellCentre {
  Eigen::Vector3d position;
  int dimensions;
};

CellCentre centre_of(vtkDataSet& set, vtkIdType id);

/// Whether a cell of a data set, which must outlive this, is at a centre, and has as many dimensions. For one thread.
using CellFinder = std::function<bool(const CellCentre&)>;
CellFinder cell_finder(vtkDataSet& set);

/// Divides data sets into layers, from 0 on, so that none overlaps another one of its layer. Tries up to 4096 cells of
/// each set where its box intersects that of another one. Faces in common are no overlap.
std::vector<int> overlapping_layers(const DataSets& sets);

}  // namespace tensorray
