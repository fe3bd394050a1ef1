#include "tools/import/vtk/point_seams.h"

#include <algorithm>
#include <array>
#include <string>
#include <tuple>

#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>

namespace tensorray {
namespace {

/// A point of a part.
struct Place {
  std::array<double, 3> position;
  std::size_t part;
  vtkIdType point;
};

/// All points, those at the same position side by side.
std::vector<Place> sorted_places(const DataSets& parts) {
  std::vector<Place> places;
  for (std::size_t part = 0; part < parts.size(); ++part)
    for (vtkIdType i = 0; i < parts[part]->GetNumberOfPoints(); ++i) {
      places.push_back({{}, part, i});
      parts[part]->GetPoint(i, places.back().position.data());
    }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return std::tie(a.position, a.part, a.point) < std::tie(b.position, b.part, b.point);
  });
  return places;
}

std::vector<int> cells_at_points(vtkDataSet& part) {
  std::vector<int> counts(static_cast<std::size_t>(part.GetNumberOfPoints()), 0);
  vtkNew<vtkIdList> points;
  for (vtkIdType cell = 0; cell < part.GetNumberOfCells(); ++cell) {
    part.GetCellPoints(cell, points);
    for (vtkIdType i = 0; i < points->GetNumberOfIds(); ++i) ++counts[static_cast<std::size_t>(points->GetId(i))];
  }
  return counts;
}

/// The array of each part; empty if one lacks it.
std::vector<vtkDataArray*> arrays_named(const DataSets& parts, const std::string& name) {
  std::vector<vtkDataArray*> arrays;
  for (vtkDataSet* const part : parts) {
    vtkDataArray* const array = part->GetPointData()->GetArray(name.c_str());
    if (!array || (!arrays.empty() && array->GetNumberOfComponents() != arrays[0]->GetNumberOfComponents())) return {};
    arrays.push_back(array);
  }
  return arrays;
}

}  // namespace

void share_point_values(const DataSets& parts) {
  if (parts.size() < 2) return;
  const std::vector<Place> places = sorted_places(parts);
  std::vector<std::vector<int>> cells;
  for (vtkDataSet* const part : parts) cells.push_back(cells_at_points(*part));
  const auto weight = [&](const Place& place) {
    return static_cast<double>(cells[place.part][static_cast<std::size_t>(place.point)]);
  };
  for (int k = 0; k < parts[0]->GetPointData()->GetNumberOfArrays(); ++k) {
    const char* const name = parts[0]->GetPointData()->GetArrayName(k);
    const std::vector<vtkDataArray*> arrays = arrays_named(parts, name ? name : "");
    if (arrays.empty()) continue;
    for (auto first = places.begin(); first != places.end();) {
      const auto last =
          std::find_if(first, places.end(), [&](const Place& p) { return p.position != first->position; });
      for (int c = 0; last - first > 1 && c < arrays[0]->GetNumberOfComponents(); ++c) {
        double sum = 0, weights = 0;
        for (auto i = first; i != last; ++i) {
          sum += weight(*i) * arrays[i->part]->GetComponent(i->point, c);
          weights += weight(*i);
        }
        for (auto i = first; weights > 0 && i != last; ++i) arrays[i->part]->SetComponent(i->point, c, sum / weights);
      }
      first = last;
    }
  }
}

}  // namespace tensorray
