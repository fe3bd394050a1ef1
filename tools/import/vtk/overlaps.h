#pragma once
/// @file tools/import/vtk/overlaps.h
/// Finds which data sets overlap.

#include <vector>

#include <Eigen/Core>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkStaticCellLocator.h>

#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {

/// The mean point of a cell, and its dimensions.
struct CellCentre {
  Eigen::Vector3d position;
  int dimensions;
};

CellCentre centre_of(vtkDataSet& set, vtkIdType id);

/// Finds cells of a data set, which must outlive it, at positions. Belongs to one thread.
class CellFinder {
 public:
  explicit CellFinder(vtkDataSet& set);
  bool has(const CellCentre& centre);  ///< Whether a cell of the same dimensions is there.

 private:
  vtkNew<vtkStaticCellLocator> locator_;
  vtkNew<vtkGenericCell> cell_;
  std::vector<double> weights_;
  double tolerance_;  ///< Squared.
};

/// Divides data sets into layers, from 0 on, so that none overlaps another one of its layer. Tries up to 4096 cells of
/// each set where its box intersects that of another one. Faces in common are no overlap.
std::vector<int> overlapping_layers(const DataSets& sets);

}  // namespace tensorray
