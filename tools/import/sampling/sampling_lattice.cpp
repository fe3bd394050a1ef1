#include "tools/import/sampling/sampling_lattice.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <vtkCellData.h>
#include <vtkDataSet.h>

#include "base/overloaded.h"
#include "tools/import/meshes/mesh_cell.h"
#include "tools/import/meshes/mesh_tensors.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using Eigen::Vector3i;
using CellRange = tbb::blocked_range<vtkIdType>;

constexpr double rounded_one = 1 + 1e-9;
constexpr double max_voxels = 1 << 30;         ///< Limit for any lattice.
constexpr double max_chosen_voxels = 1 << 21;  ///< Limit for a lattice whose size the user did not set.

std::string text_of(const Vector3d& v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x(), v.y(), v.z()); }

/// The cube root of the median volume of the cells that meet `bounds`.
double typical_edge(vtkDataSet& mesh, const Solid& solid, const AlignedBox3d& bounds) {
  std::vector<double> volumes(solid.boxes.size(), 0);
  tbb::parallel_for(CellRange(0, mesh.GetNumberOfCells(), 256), [&](const CellRange& range) {
    MeshCell cell;
    for (vtkIdType id = range.begin(); id < range.end(); ++id) {
      const auto i = static_cast<std::size_t>(id);
      if (!solid.boxes[i].isEmpty() && solid.boxes[i].intersects(bounds) && cell.load(mesh, id))
        volumes[i] = cell.volume();
    }
  });
  volumes.erase(std::remove_if(volumes.begin(), volumes.end(), [](double v) { return !(v > 0); }), volumes.end());
  if (volumes.empty()) return bounds.sizes().maxCoeff();
  const auto middle = volumes.begin() + static_cast<std::ptrdiff_t>(volumes.size() / 2);
  std::nth_element(volumes.begin(), middle, volumes.end());
  return std::cbrt(*middle);
}

/// Cells that are a little smaller than voxels are as large.
constexpr double rounded_size = 1.02;

/// Voxels of at most an edge whose first and last centres are on the faces of a box, so that the field reaches them.
/// Doubles, because the numbers may exceed all integers.
/// @param least  Edges along an axis: a thin body gets four.
Vector3d voxels_across(const Vector3d& edges, double voxel, double least = 4) {
  constexpr double rounding = 0.01;  // Of an edge, as sizes are given with a few digits.
  return (edges.array() / voxel - rounding).ceil().max(least) + 1;
}

/// Whether a lattice whose size the user did not set is small: of long thin ones, blocks have more voxels than it has.
bool is_small(const Vector3d& voxels) {
  constexpr double block = 8;
  const double stored = (block * (voxels / block).array().ceil()).prod();
  return voxels.prod() <= max_chosen_voxels && stored <= 8 * max_chosen_voxels;
}

/// The edge that half of the mesh's volume does not exceed, of cells that meet `bounds`.
double edge_by_volume(const Solid& solid, const AlignedBox3d& bounds) {
  std::vector<float> edges;
  double volume = 0;
  for (std::size_t i = 0; i < solid.edges.size(); ++i)
    if (!solid.boxes[i].isEmpty() && solid.edges[i] > 0 && solid.boxes[i].intersects(bounds)) {
      edges.push_back(solid.edges[i]);
      volume += std::pow(solid.edges[i], 3.0);
    }
  std::sort(edges.begin(), edges.end());
  double below = 0;
  for (const float edge : edges)
    if ((below += std::pow(edge, 3.0)) >= 0.5 * volume) return edge;
  return 0;
}

/// The voxels of level 0: twice as large, and so on, while that is no larger than the large cells, and fits in the box.
double doubled(double voxel, const Solid& solid, const AlignedBox3d& box, const SamplingSettings& settings) {
  double large = std::min(edge_by_volume(solid, box), box.sizes().maxCoeff());
  if (is_thin(settings, box)) large = std::min(large, settings.thickness / across_thickness);
  for (int level = 1; level < settings.levels.value_or(max_levels) && 2 * voxel <= rounded_size * large; ++level)
    voxel *= 2;
  return voxel;
}

/// Of adaptive refinement: the voxels of level 0 are the largest cells, if these are not too many.
double largest_cell(const Solid& solid, const AlignedBox3d& box) {
  double voxel = *std::max_element(solid.edges.begin(), solid.edges.end());
  while (!is_small(voxels_across(box.sizes(), voxel, 1))) voxel *= 2;
  return voxel;
}

double chosen_voxel(vtkDataSet& mesh, const Solid& solid, const AlignedBox3d& box, const SamplingSettings& settings) {
  double voxel = std::min(typical_edge(mesh, solid, box), box.sizes().maxCoeff());
  if (is_thin(settings, box)) voxel = std::min(voxel, settings.thickness / across_thickness);
  while (!is_small(voxels_across(box.sizes(), voxel))) voxel *= 1.01;
  return voxel;
}

/// Four steps for each halving of the edge. Cells of one size, which differ by rounding, become equal.
std::vector<int> coarseness_of(const std::vector<float>& edges) {
  const float largest = edges.empty() ? 1 : *std::max_element(edges.begin(), edges.end());
  std::vector<int> coarseness;
  for (const float edge : edges)
    coarseness.push_back(edge > 0 ? static_cast<int>(std::lround(4 * std::log2(edge / largest))) : 0);
  return coarseness;
}

void require_two(int count) {
  if (count < 2) throw std::invalid_argument(fmt::format("--resolution {}: at least 2 voxels are needed", count));
}

}  // namespace

Solid solid_part(vtkDataSet& mesh) {
  Solid solid;
  const vtkIdType count = mesh.GetNumberOfCells();
  solid.boxes.resize(static_cast<std::size_t>(count));
  solid.thickness.resize(solid.boxes.size());
  std::vector<AlignedBox3d> hulls(solid.boxes.size());
  solid.edges.resize(solid.boxes.size());
  std::vector<std::atomic<bool>> used(static_cast<std::size_t>(mesh.GetNumberOfPoints()));
  MeshCell first;
  if (count > 0) first.load(mesh, 0);  // makes VTK's cached data on one thread
  tbb::parallel_for(CellRange(0, count, 256), [&](const CellRange& range) {
    MeshCell cell;
    for (vtkIdType id = range.begin(); id < range.end(); ++id) {
      if (!cell.load(mesh, id)) continue;
      solid.boxes[static_cast<std::size_t>(id)] = cell.box();
      solid.thickness[static_cast<std::size_t>(id)] = static_cast<float>(cell.thickness(Vector3d::Ones()));
      if (const double edge = cell.edge(); std::isfinite(edge))
        solid.edges[static_cast<std::size_t>(id)] = static_cast<float>(edge);
      for (int i = 0; i < cell.points(); ++i) {
        hulls[static_cast<std::size_t>(id)].extend(cell.positions().col(i));
        used[static_cast<std::size_t>(cell.point(i))].store(true, std::memory_order_relaxed);
      }
    }
  });
  for (const AlignedBox3d& hull : hulls) solid.bounds.extend(hull);
  solid.points.assign(used.begin(), used.end());
  solid.coarseness = coarseness_of(solid.edges);
  if (solid.bounds.isEmpty())
    throw std::invalid_argument(
        "the mesh has no three-dimensional cells (it is flat, or points alone): a field needs tensors in a volume");
  return solid;
}

bool is_adaptive(const Solid& solid) {
  constexpr double rounding = 0.02;
  const float largest = solid.edges.empty() ? 1 : *std::max_element(solid.edges.begin(), solid.edges.end());
  bool differ = false;
  for (const float edge : solid.edges) {
    if (!(edge > 0)) continue;
    const double halvings = std::log2(largest / edge);
    if (std::abs(halvings - std::round(halvings)) > rounding) return false;
    differ = differ || halvings > 0.5;
  }
  return differ;
}

bool is_thin(const SamplingSettings& settings, const AlignedBox3d& box) {
  return settings.thickness > 0 && settings.thickness < box.sizes().minCoeff() / 4;
}

SamplingLattice finer(const SamplingLattice& lattice) {
  return {lattice.origin, 0.5 * lattice.voxel, 2 * lattice.size - Vector3i::Ones()};
}

AlignedBox3d sampled_box(const Solid& solid, const SamplingSettings& settings) {
  AlignedBox3d box = settings.bounds.value_or(solid.bounds);
  if (const int flat = settings.flat_axis; flat >= 0) {
    box.min()[flat] = solid.bounds.min()[flat];
    box.max()[flat] = solid.bounds.max()[flat];
  }
  return box;
}

SamplingLattice sampling_lattice(vtkDataSet& mesh, const Solid& solid, const SamplingSettings& settings) {
  const AlignedBox3d box = sampled_box(solid, settings);
  if (!(box.sizes().minCoeff() > 0) || !box.sizes().allFinite())
    throw std::invalid_argument(fmt::format("--bounds: {} to {} is not a box", text_of(box.min()), text_of(box.max())));
  if (!box.intersects(solid.bounds))
    throw std::invalid_argument(fmt::format("--bounds: nothing of the mesh is inside, which goes from {} to {}",
                                            text_of(solid.bounds.min()), text_of(solid.bounds.max())));
  SamplingLattice lattice;
  Vector3d edges = box.sizes();  // Those that are divided into voxels.
  if (settings.flat_axis >= 0) edges[settings.flat_axis] = 0;
  const double longest = edges.maxCoeff();
  Vector3d size;
  const auto set_voxel = [&](double voxel, double least = 1) {
    size = voxels_across(box.sizes(), voxel, least);
    lattice.voxel = box.sizes().cwiseQuotient(size - Vector3d::Ones());
  };
  const auto choose = [&] {
    if (settings.finest) return set_voxel(std::min(doubled(*settings.finest, solid, box, settings), longest));
    if (settings.levels != 1 && is_adaptive(solid)) return set_voxel(std::min(largest_cell(solid, box), longest));
    set_voxel(doubled(chosen_voxel(mesh, solid, box, settings), solid, box, settings), 4);
  };
  std::visit(Overloaded{[&](std::monostate) { choose(); },
                        [&](int count) {
                          require_two(count);
                          set_voxel(longest / (count - 1));
                        },
                        [&](double voxel) {
                          if (!(voxel > 0) || voxel > longest * rounded_one)
                            throw std::invalid_argument(
                                fmt::format("--voxel-size {}: it must be greater than 0 and at most the longest edge "
                                            "of the bounds, {:.6g}",
                                            voxel, longest));
                          set_voxel(voxel);
                        },
                        [&](const Vector3i& counts) {
                          size = counts.cast<double>();
                          if (settings.flat_axis >= 0)
                            size[settings.flat_axis] = 2;  // Whatever is given: there is one.
                          require_two(static_cast<int>(size.minCoeff()));
                          lattice.voxel = box.sizes().array() / (size.array() - 1);
                        }},
             settings.resolution);
  if (const int flat = settings.flat_axis; flat >= 0) size[flat] = 1, lattice.voxel[flat] = box.sizes()[flat];
  if (size.prod() > max_voxels)
    throw std::invalid_argument(
        fmt::format("a grid of {:.0f} x {:.0f} x {:.0f} voxels is beyond the limit of 2^30: give "
                    "a larger --voxel-size or a lower --resolution",
                    size.x(), size.y(), size.z()));
  lattice.size = size.cast<int>();
  lattice.origin = box.center() - 0.5 * (lattice.voxel.array() * (size.array() - 1)).matrix();
  return lattice;
}

}  // namespace tensorray
