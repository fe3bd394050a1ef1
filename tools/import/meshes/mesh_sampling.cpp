#include "tools/import/meshes/mesh_sampling.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <vtkDataSet.h>
#include <vtkDoubleArray.h>
#include <vtkPointData.h>

#include "tools/import/meshes/mesh_cell.h"
#include "tools/import/meshes/mesh_tensors.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3d;
using Eigen::AlignedBox3i;
using Eigen::Vector3d;
using Eigen::Vector3i;
using CellRange = tbb::blocked_range<vtkIdType>;
using Blocks = decltype(TensorGrid::blocks);

constexpr double face_tolerance = 1e-6;         ///< As a fraction of the mesh's diagonal.
constexpr double most_voxels = 1 << 30;         ///< Limit for any lattice.
constexpr double most_chosen_voxels = 1 << 21;  ///< Limit for a lattice whose size the user did not set.

/// The three-dimensional part of a mesh.
struct Solid {
  std::vector<AlignedBox3d> boxes;  ///< Box of each cell of the mesh; empty for cells that are not used.
  AlignedBox3d bounds;              ///< Bounds of the points of the used cells.
  std::vector<bool> points;         ///< For each point of the mesh: whether a used cell has it.
};

struct LatticeShape {
  Vector3d origin = Vector3d::Zero(), voxel = Vector3d::Zero();
  Vector3i size = Vector3i::Zero();

  Vector3d position(const Vector3i& index) const { return origin + voxel.cwiseProduct(index.cast<double>()); }
};

/// For each block of the lattice, the cells that may have voxels in it, by ascending index: the cells of block b are
/// cells[first[b]] to cells[first[b + 1] − 1].
struct Bins {
  Vector3i blocks = Vector3i::Zero();
  std::vector<std::size_t> first;
  std::vector<vtkIdType> cells;

  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(x) * static_cast<std::size_t>(blocks.y()) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(blocks.z()) +
           static_cast<std::size_t>(z);
  }
  Vector3i block(std::size_t index) const {
    const auto ny = static_cast<std::size_t>(blocks.y()), nz = static_cast<std::size_t>(blocks.z());
    return {static_cast<int>(index / nz / ny), static_cast<int>(index / nz % ny), static_cast<int>(index % nz)};
  }
};

std::string text_of(const Vector3d& v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x(), v.y(), v.z()); }

Solid solid_part(vtkDataSet& mesh) {
  Solid solid;
  const vtkIdType count = mesh.GetNumberOfCells();
  solid.boxes.resize(static_cast<std::size_t>(count));
  std::vector<AlignedBox3d> hulls(solid.boxes.size());
  std::vector<std::atomic<bool>> used(static_cast<std::size_t>(mesh.GetNumberOfPoints()));
  MeshCell first;
  if (count > 0) first.load(mesh, 0);  // makes VTK's cached data on one thread
  tbb::parallel_for(CellRange(0, count, 256), [&](const CellRange& range) {
    MeshCell cell;
    for (vtkIdType id = range.begin(); id < range.end(); ++id) {
      if (!cell.load(mesh, id)) continue;
      solid.boxes[static_cast<std::size_t>(id)] = cell.box();
      for (int i = 0; i < cell.points(); ++i) {
        hulls[static_cast<std::size_t>(id)].extend(cell.positions().col(i));
        used[static_cast<std::size_t>(cell.point(i))].store(true, std::memory_order_relaxed);
      }
    }
  });
  for (const AlignedBox3d& hull : hulls) solid.bounds.extend(hull);
  solid.points.assign(used.begin(), used.end());
  if (solid.bounds.isEmpty())
    throw std::invalid_argument(
        "the mesh has no three-dimensional cells (it is flat, or points alone): a field needs tensors in a volume");
  return solid;
}

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

/// Voxels that fit along edges, from one end. Doubles, because the numbers may exceed all integers.
Vector3d voxels_along(const Vector3d& edges, double voxel) {
  constexpr double rounding = 1e-6;  // keeps a last voxel that is beyond the end only by rounding
  return (edges.array() / voxel + rounding).floor() + 1;
}

double chosen_voxel(vtkDataSet& mesh, const Solid& solid, const AlignedBox3d& box) {
  double voxel = std::min(typical_edge(mesh, solid, box), box.sizes().maxCoeff());
  while (voxels_along(box.sizes(), voxel).prod() > most_chosen_voxels) voxel *= 1.01;
  return voxel;
}

void require_two(int count) {
  if (count < 2) throw std::invalid_argument(fmt::format("--resolution {}: at least 2 voxels are needed", count));
}

/// What is sampled: the whole thickness of a slab.
AlignedBox3d wanted_box(const SamplingSettings& settings, const Solid& solid) {
  AlignedBox3d box = settings.bounds.value_or(solid.bounds);
  if (const int flat = settings.flat_axis; flat >= 0) {
    box.min()[flat] = solid.bounds.min()[flat];
    box.max()[flat] = solid.bounds.max()[flat];
  }
  return box;
}

LatticeShape shape_of(vtkDataSet& mesh, const Solid& solid, const SamplingSettings& settings) {
  const AlignedBox3d box = wanted_box(settings, solid);
  if (!(box.sizes().minCoeff() > 0) || !box.sizes().allFinite())
    throw std::invalid_argument(fmt::format("--bounds: {} to {} is not a box", text_of(box.min()), text_of(box.max())));
  if (!box.intersects(solid.bounds))
    throw std::invalid_argument(fmt::format("--bounds: nothing of the mesh is inside, which goes from {} to {}",
                                            text_of(solid.bounds.min()), text_of(solid.bounds.max())));
  LatticeShape shape;
  const double longest = box.sizes().maxCoeff();
  Vector3d size;
  if (const auto* counts = std::get_if<Vector3i>(&settings.resolution)) {
    require_two(counts->minCoeff());
    size = counts->cast<double>();
    shape.voxel = box.sizes().array() / (size.array() - 1);
  } else {
    double voxel = 0;
    if (const auto* count = std::get_if<int>(&settings.resolution)) {
      require_two(*count);
      voxel = longest / (*count - 1);
    } else if (const auto* given = std::get_if<double>(&settings.resolution)) {
      voxel = *given;
      if (!(voxel > 0) || voxel > longest)
        throw std::invalid_argument(
            fmt::format("--voxel-size {}: it must be greater than 0 and at most the longest edge of the bounds, {:.6g}",
                        voxel, longest));
    } else {
      voxel = chosen_voxel(mesh, solid, box);
    }
    size = voxels_along(box.sizes(), voxel);
    shape.voxel.setConstant(voxel);
  }
  if (const int flat = settings.flat_axis; flat >= 0) size[flat] = 1, shape.voxel[flat] = box.sizes()[flat];
  if (size.prod() > most_voxels)
    throw std::invalid_argument(
        fmt::format("a grid of {:.0f} x {:.0f} x {:.0f} voxels is beyond the limit of 2^30: give "
                    "a larger --voxel-size or a lower --resolution",
                    size.x(), size.y(), size.z()));
  shape.size = size.cast<int>();
  // Centre the voxels, so that both sides have the same rest.
  shape.origin = box.center() - 0.5 * (shape.voxel.array() * (size.array() - 1)).matrix();
  return shape;
}

/// Indices of the voxels that may be in a box; empty if there are none.
AlignedBox3i voxels_in(const AlignedBox3d& box, const LatticeShape& shape, double tolerance) {
  if (box.isEmpty()) return {};
  const auto index_of = [&](const Vector3d& position, double offset) {
    return Eigen::Array3d(((position - shape.origin).array() + offset) / shape.voxel.array());
  };
  const Eigen::Array3d last = (shape.size.array() - 1).cast<double>();
  const Eigen::Array3d from = index_of(box.min(), -tolerance).ceil().max(0);
  const Eigen::Array3d to = index_of(box.max(), tolerance).floor().min(last);
  if ((from > to).any()) return {};
  return {from.cast<int>().matrix(), to.cast<int>().matrix()};
}

/// Calls `visit(block)` with the index of each block that has voxels among `voxels`.
template <class Visit>
void for_each_block(const Bins& bins, const AlignedBox3i& voxels, const Visit& visit) {
  if (voxels.isEmpty()) return;
  const Vector3i from = voxels.min() / TensorBlock::size, to = voxels.max() / TensorBlock::size;
  for (int x = from.x(); x <= to.x(); ++x)
    for (int y = from.y(); y <= to.y(); ++y)
      for (int z = from.z(); z <= to.z(); ++z) visit(bins.index(x, y, z));
}

Bins bins_of(const Solid& solid, const LatticeShape& shape, double tolerance) {
  Bins bins;
  bins.blocks = (shape.size.array() + (TensorBlock::size - 1)) / TensorBlock::size;
  bins.first.assign(bins.index(bins.blocks.x(), 0, 0) + 1, 0);
  for (const AlignedBox3d& box : solid.boxes)
    for_each_block(bins, voxels_in(box, shape, tolerance), [&](std::size_t block) { ++bins.first[block + 1]; });
  for (std::size_t block = 1; block < bins.first.size(); ++block) bins.first[block] += bins.first[block - 1];
  bins.cells.resize(bins.first.back());
  std::vector<std::size_t> next(bins.first.begin(), bins.first.end() - 1);
  for (std::size_t id = 0; id < solid.boxes.size(); ++id)
    for_each_block(bins, voxels_in(solid.boxes[id], shape, tolerance),
                   [&](std::size_t block) { bins.cells[next[block]++] = static_cast<vtkIdType>(id); });
  return bins;
}

/// The interpolated tensor at the position that `cell` found last; not finite if a point with a weight has no finite
/// tensor.
Eigen::Matrix3d interpolated(const MeshCell& cell, const double* tensors) {
  constexpr double rounding = 1e-9;
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> sum = Eigen::Matrix3d::Zero();
  for (int i = 0; i < cell.points(); ++i) {
    const double weight = cell.weights()[static_cast<std::size_t>(i)];
    if (std::abs(weight) <= rounding) continue;
    sum += weight * Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(tensors + 9 * cell.point(i));
  }
  return sum;
}

/// The data that blocks are filled from.
struct Source {
  vtkDataSet& mesh;
  const double* tensors;
  const Solid& solid;
  const LatticeShape& shape;
  double tolerance;
};

/// Sets the tensors of the block's voxels that are in `cell` and were in no earlier cell.
void fill_from_cell(const Source& source, MeshCell& cell, const AlignedBox3i& voxels, TensorBlock& block,
                    std::bitset<TensorBlock::voxels>& taken) {
  const Vector3i from = (voxels.min() - block.origin).cwiseMax(0);
  const Vector3i to = (voxels.max() - block.origin).cwiseMin(TensorBlock::size - 1);
  for (int x = from.x(); x <= to.x(); ++x)
    for (int y = from.y(); y <= to.y(); ++y)
      for (int z = from.z(); z <= to.z(); ++z) {
        const auto offset = static_cast<std::size_t>(TensorBlock::offset(x, y, z));
        if (taken[offset]) continue;
        if (!cell.find(source.shape.position(block.origin + Vector3i(x, y, z)), source.tolerance)) continue;
        taken.set(offset);
        const Eigen::Matrix3f tensor = interpolated(cell, source.tensors).cast<float>();
        if (!tensor.allFinite()) continue;
        block.values[offset] = tensor;
        block.active.set(offset);
      }
}

void fill_block(const Source& source, const Bins& bins, std::size_t index, MeshCell& cell, TensorBlock& block) {
  std::bitset<TensorBlock::voxels> taken;
  for (std::size_t i = bins.first[index]; i < bins.first[index + 1] && !taken.all(); ++i) {
    const vtkIdType id = bins.cells[i];
    if (!cell.load(source.mesh, id)) continue;
    fill_from_cell(source, cell,
                   voxels_in(source.solid.boxes[static_cast<std::size_t>(id)], source.shape, source.tolerance), block,
                   taken);
  }
}

Blocks filled_blocks(const Source& source, const Bins& bins, const Progress& progress) {
  std::vector<std::size_t> used;
  for (std::size_t block = 0; block + 1 < bins.first.size(); ++block)
    if (bins.first[block] < bins.first[block + 1]) used.push_back(block);
  Blocks blocks(used.size());
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<std::uint64_t> done{0};
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, used.size(), 4), [&](const Range& range) {
    MeshCell cell;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      blocks[i].origin = TensorBlock::size * bins.block(used[i]);
      fill_block(source, bins, used[i], cell, blocks[i]);
    }
    done += range.size();
    if (std::this_thread::get_id() == caller) progress.update("sampling", done, used.size());
  });
  progress.update("sampling", used.size(), used.size());
  blocks.erase(
      std::remove_if(blocks.begin(), blocks.end(), [](const TensorBlock& block) { return block.active.none(); }),
      blocks.end());
  return blocks;
}

/// @return peak and median; zeros if there are no norms.
std::pair<double, double> peak_and_median(std::vector<double>& norms) {
  if (norms.empty()) return {0, 0};
  const auto middle = norms.begin() + static_cast<std::ptrdiff_t>(norms.size() / 2);
  std::nth_element(norms.begin(), middle, norms.end());
  return {*std::max_element(norms.begin(), norms.end()), *middle};
}

void report_native(vtkDataSet& mesh, const double* tensors, const Solid& solid, const AlignedBox3d& bounds,
                   SamplingReport& report) {
  std::vector<double> norms;
  report.non_finite_points = 0;
  for (vtkIdType point = 0; point < mesh.GetNumberOfPoints(); ++point) {
    Vector3d position;
    mesh.GetPoint(point, position.data());
    if (!solid.points[static_cast<std::size_t>(point)] || !bounds.contains(position)) continue;
    const double norm = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(tensors + 9 * point).norm();
    if (std::isfinite(norm))
      norms.push_back(norm);
    else
      ++report.non_finite_points;
  }
  std::tie(report.native_peak, report.native_median) = peak_and_median(norms);
}

void report_sampled(const TensorGrid& grid, SamplingReport& report) {
  std::vector<double> norms;
  for (const TensorBlock& block : grid.blocks)
    for (std::size_t offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset]) norms.push_back(block.values[offset].cast<double>().norm());
  report.active = norms.size();
  std::tie(report.sampled_peak, report.sampled_median) = peak_and_median(norms);
}

}  // namespace

TensorGrid sample_mesh(vtkDataSet& mesh, const SamplingSettings& settings, const Progress& progress,
                       SamplingReport& report) {
  auto* const array = vtkDoubleArray::SafeDownCast(mesh.GetPointData()->GetArray(tensor_array));
  if (!array || array->GetNumberOfComponents() != 9)
    throw std::invalid_argument("the mesh has no tensors: it must come from with_tensors");
  const double* const tensors = array->GetPointer(0);
  const Solid solid = solid_part(mesh);
  const LatticeShape shape = shape_of(mesh, solid, settings);
  const double tolerance = face_tolerance * solid.bounds.diagonal().norm();
  const Source source{mesh, tensors, solid, shape, tolerance};
  TensorGrid grid;
  grid.to_world = Eigen::Translation3d(shape.origin) * Eigen::Scaling(shape.voxel);
  grid.blocks = filled_blocks(source, bins_of(solid, shape, tolerance), progress);
  report.size = shape.size;
  report.voxel = shape.voxel;
  report_native(mesh, tensors, solid, wanted_box(settings, solid), report);
  report_sampled(grid, report);
  if (report.active == 0)
    throw std::invalid_argument(
        fmt::format("none of the {} x {} x {} voxels is inside of the mesh where its tensors are finite: give other "
                    "--bounds or smaller voxels",
                    shape.size.x(), shape.size.y(), shape.size.z()));
  return grid;
}

}  // namespace tensorray
