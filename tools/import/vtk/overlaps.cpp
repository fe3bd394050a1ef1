#include "tools/import/vtk/overlaps.h"

#include <algorithm>

#include <vtkBoundingBox.h>
#include <vtkDataSet.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkStaticCellLocator.h>

namespace tensorray {
namespace {

struct Sampled {
  vtkBoundingBox box;
  std::vector<CellCentre> centres;  ///< Of some cells of the highest dimensions.
  CellFinder has;                   ///< Made when it is needed.
};

Sampled sampled(vtkDataSet& set) {
  constexpr vtkIdType most = 4096;
  Sampled result{vtkBoundingBox(set.GetBounds()), {}, nullptr};
  for (vtkIdType id = 0; id < set.GetNumberOfCells(); id += (set.GetNumberOfCells() + most - 1) / most) {
    const CellCentre centre = centre_of(set, id);
    if (!result.centres.empty() && centre.dimensions > result.centres[0].dimensions) result.centres.clear();
    if (result.centres.empty() || centre.dimensions == result.centres[0].dimensions) result.centres.push_back(centre);
  }
  return result;
}

/// Whether a cell of `a` is at the centre of one of `b`.
bool has_some(Sampled& a, vtkDataSet& set, const Sampled& b) {
  return std::any_of(b.centres.begin(), b.centres.end(), [&](const CellCentre& centre) {
    if (!a.box.ContainsPoint(centre.position.data())) return false;
    if (!a.has) a.has = cell_finder(set);
    return a.has(centre);
  });
}

}  // namespace

CellCentre centre_of(vtkDataSet& set, vtkIdType id) {
  vtkNew<vtkGenericCell> cell;
  set.GetCell(id, cell);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (vtkIdType i = 0; i < cell->GetNumberOfPoints(); ++i) sum += Eigen::Vector3d(cell->GetPoints()->GetPoint(i));
  return {sum / static_cast<double>(std::max<vtkIdType>(1, cell->GetNumberOfPoints())), cell->GetCellDimension()};
}

CellFinder cell_finder(vtkDataSet& set) {
  const auto locator = vtkSmartPointer<vtkStaticCellLocator>::New();
  locator->SetDataSet(&set);
  locator->BuildLocator();
  std::vector<double> weights(static_cast<std::size_t>(std::max(32, set.GetMaxCellSize())));
  const double squared_tolerance = 1e-12 * set.GetLength() * set.GetLength();
  return [=, cell = vtkSmartPointer<vtkGenericCell>::New()](const CellCentre& centre) mutable {
    Eigen::Vector3d position = centre.position, parametric;
    return locator->FindCell(position.data(), squared_tolerance, cell, parametric.data(), weights.data()) >= 0 &&
           cell->GetCellDimension() == centre.dimensions;
  };
}

std::vector<int> overlapping_layers(const DataSets& sets) {
  std::vector<Sampled> samples;
  for (const auto& set : sets) samples.push_back(sampled(*set));
  std::vector<int> layers;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    std::vector<bool> taken(i + 1, false);
    for (std::size_t k = 0; k < i; ++k)
      if (const auto layer = static_cast<std::size_t>(layers[k]); !taken[layer])
        taken[layer] = has_some(samples[k], *sets[k], samples[i]) || has_some(samples[i], *sets[i], samples[k]);
    layers.push_back(static_cast<int>(std::find(taken.begin(), taken.end(), false) - taken.begin()));
  }
  return layers;
}

}  // namespace tensorray
