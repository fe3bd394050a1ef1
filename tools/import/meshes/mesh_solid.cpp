#include "tools/import/meshes/mesh_solid.h"

#include <atomic>
#include <stdexcept>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <vtkDataSet.h>

#include "tools/import/meshes/mesh_cell.h"

namespace tensorray {

Solid solid_part(vtkDataSet& mesh) {
  Solid solid;
  using Range = tbb::blocked_range<vtkIdType>;
  const vtkIdType count = mesh.GetNumberOfCells();
  solid.boxes.resize(static_cast<std::size_t>(count));
  solid.thickness.resize(solid.boxes.size());
  std::vector<Eigen::AlignedBox3d> hulls(solid.boxes.size());
  std::vector<std::atomic<bool>> used(static_cast<std::size_t>(mesh.GetNumberOfPoints()));
  MeshCell first;
  if (count > 0) first.load(mesh, 0);  // makes VTK's cached data on one thread
  tbb::parallel_for(Range(0, count, 256), [&](const Range& range) {
    MeshCell cell;
    for (vtkIdType id = range.begin(); id < range.end(); ++id) {
      if (!cell.load(mesh, id)) continue;
      solid.boxes[static_cast<std::size_t>(id)] = cell.box();
      solid.thickness[static_cast<std::size_t>(id)] = static_cast<float>(cell.thickness(Eigen::Vector3d::Ones()));
      for (int i = 0; i < cell.points(); ++i) {
        hulls[static_cast<std::size_t>(id)].extend(cell.positions().col(i));
        used[static_cast<std::size_t>(cell.point(i))].store(true, std::memory_order_relaxed);
      }
    }
  });
  for (const Eigen::AlignedBox3d& hull : hulls) solid.bounds.extend(hull);
  solid.points.assign(used.begin(), used.end());
  if (solid.bounds.isEmpty())
    throw std::invalid_argument(
        "the mesh has no three-dimensional cells (it is flat, or points alone): a field needs tensors in a volume");
  return solid;
}

}  // namespace tensorray
