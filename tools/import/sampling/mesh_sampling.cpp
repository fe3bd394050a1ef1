#include "tools/import/sampling/mesh_sampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <vtkCellData.h>
#include <vtkDataSet.h>
#include <vtkIntArray.h>
#include <vtkPointData.h>

#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/sampling/block_places.h"
#include "tools/import/sampling/refinement.h"
#include "tools/import/sampling/sampling_lattice.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3d;

constexpr double face_tolerance = 1e-6;  ///< As a fraction of the mesh's diagonal.

constexpr double default_error = 0.01;

/// There may be as many as voxels.
using Norms = std::vector<double, PageAllocator<double>>;

double norm_of(const double* tensor) { return Eigen::Map<const Eigen::Matrix<double, 9, 1>>(tensor).norm(); }

/// @return peak and median; zeros if there are no norms.
std::pair<double, double> peak_and_median(Norms& norms) {
  if (norms.empty()) return {0, 0};
  const auto middle = norms.begin() + static_cast<std::ptrdiff_t>(norms.size() / 2);
  std::nth_element(norms.begin(), middle, norms.end());
  return {*std::max_element(norms.begin(), norms.end()), *middle};
}

Norms norms_of_points(vtkDataSet& mesh, const double* tensors, const Solid& solid, const AlignedBox3d& bounds) {
  Norms norms;
  for (vtkIdType point = 0; point < mesh.GetNumberOfPoints(); ++point) {
    Eigen::Vector3d position;
    mesh.GetPoint(point, position.data());
    if (solid.points[static_cast<std::size_t>(point)] && bounds.contains(position))
      norms.push_back(norm_of(tensors + 9 * point));
  }
  return norms;
}

/// Of the cells that have a part in `bounds`.
Norms norms_of_cells(const double* tensors, const Solid& solid, const AlignedBox3d& bounds, double tolerance) {
  const AlignedBox3d inside(bounds.min().array() + tolerance, bounds.max().array() - tolerance);
  Norms norms;
  for (std::size_t cell = 0; cell < solid.boxes.size(); ++cell)
    if (!solid.boxes[cell].isEmpty() && solid.boxes[cell].intersects(inside))
      norms.push_back(norm_of(tensors + 9 * cell));
  return norms;
}

/// @throw std::invalid_argument if no tensor is finite.
void report_native(const MeshSource& source, const AlignedBox3d& bounds, SamplingReport& report) {
  Norms norms = source.cell_tensors ? norms_of_cells(source.cell_tensors, source.solid, bounds, source.tolerance)
                                    : norms_of_points(source.mesh, source.point_tensors, source.solid, bounds);
  const auto is_not_finite = [](double norm) { return !std::isfinite(norm); };
  const auto finite_end = std::remove_if(norms.begin(), norms.end(), is_not_finite);
  report.of_cells = source.cell_tensors != nullptr;
  report.non_finite = static_cast<std::size_t>(norms.end() - finite_end);
  norms.erase(finite_end, norms.end());
  if (norms.empty() && report.non_finite > 0)
    throw std::invalid_argument(
        fmt::format("all {} {} have NaN or infinite tensors: choose another array or step of time, or other --bounds",
                    report.non_finite, report.of_cells ? "cells" : "points"));
  std::tie(report.native_peak, report.native_median) = peak_and_median(norms);
}

/// Voxels at the ends of the lattice count by half along an axis, as they are on the faces of what is sampled.
double volume_of(const TensorBlocks& blocks, const SamplingReport& report) {
  double voxels = 0;
  for (const TensorBlock& block : blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      if (!block.active[static_cast<std::size_t>(offset)]) continue;
      const Eigen::Array3i index = block.origin + TensorBlock::position(offset), last = report.size.array() - 1;
      voxels += std::pow(0.5, ((index == 0 || index == last) && last > 0).count());
    }
  return voxels * report.voxel.prod();
}

/// Peak and median are those of level 0; where a finer level has a greater norm, that is the peak.
void report_sampled(const TensorGrid& grid, SamplingReport& report) {
  Norms norms;
  for (const TensorBlock& block : grid.blocks)
    for (std::size_t offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset]) norms.push_back(block.values[offset].cast<double>().norm());
  report.active = norms.size();
  report.volume = volume_of(grid.blocks, report);
  std::tie(report.sampled_peak, report.sampled_median) = peak_and_median(norms);
  for (const TensorBlocks& blocks : grid.finer)
    for (const TensorBlock& block : blocks)
      for (const Eigen::Matrix3f& value : block.values)  // Zero where it is not active.
        report.sampled_peak = std::max(report.sampled_peak, value.cast<double>().norm());
}

MeshSource on_lattice(const MeshSource& source, const SamplingLattice& lattice) {
  return {source.mesh, source.point_tensors, source.cell_tensors, source.solid,
          lattice,     source.layers,        source.tolerance};
}

/// Removes the blocks that are in no refined brick of the level before: of those, none of its voxels is in the mesh.
void remove_orphans(const TensorBlocks& before, TensorBlocks& blocks) {
  const auto place = [](const Eigen::Vector3i& origin, int doublings) {
    return std::array{origin.x() >> (3 + doublings), origin.y() >> (3 + doublings), origin.z() >> (3 + doublings)};
  };
  std::set<std::array<int, 3>> refined;
  for (const TensorBlock& block : before) refined.insert(place(block.origin, 1));
  blocks.erase(std::remove_if(blocks.begin(), blocks.end(),
                              [&](const TensorBlock& block) { return refined.count(place(block.origin, 2)) == 0; }),
               blocks.end());
}

/// A level is refined where cells are smaller than its voxels and it differs from the mesh. Voxels whose size the user
/// did not set are no more than a few times those of level 0 at most.
void add_finer_levels(const MeshSource& coarsest, const SamplingSettings& settings, const Progress& progress,
                      TensorGrid& grid, SamplingReport& report) {
  constexpr double rounded_size = 1.02;
  constexpr double fitted = 0.7;  // Voxels that fit in the box are a little smaller than they were meant.
  constexpr double bricks_of_all = 1 << 18, bricks_of_chosen = 1 << 11;
  constexpr int largest = 1 << 28;  // Of a lattice along an axis.
  if (settings.flat_axis >= 0) return;
  const bool is_chosen = settings.resolution.index() == 0 && !settings.finest;
  const double error = is_adaptive(coarsest.solid) && !settings.error ? 0 : settings.error.value_or(default_error);
  report.wanted_error = error;
  std::vector<float> sizes = cell_sizes(coarsest);
  double across = 0;  // Of a thin body, voxels of this size are needed everywhere, whatever they miss.
  if (is_chosen && is_thin(settings, sampled_box(coarsest.solid, settings))) {
    across = settings.thickness / across_thickness;
    for (float& size : sizes) size = std::min(size, static_cast<float>(0.5 * across));
  }
  SamplingLattice lattice = coarsest.lattice;
  BlockPlaces places(lattice.size);
  std::size_t bricks = 0;
  for (int level = 1; level < settings.levels.value_or(max_levels); ++level) {
    if (lattice.size.maxCoeff() > largest || fitted * settings.finest.value_or(0) > 0.5 * lattice.voxel.maxCoeff())
      return;
    const MeshSource source = on_lattice(coarsest, lattice);
    const TensorBlocks& blocks = level == 1 ? grid.blocks : grid.finer.back();
    const bool is_coarse = across > 0 && lattice.voxel.maxCoeff() > across * rounded_size;
    const double tolerance = error > 0 && !is_coarse ? error * report.native_peak * std::pow(2, level - 1) : -1;
    const auto missed = missed_cells({source, places, blocks}, sizes, tolerance);
    const std::vector<bool> refined = bricks_to_refine(lattice, places, missed);
    const auto count = static_cast<std::size_t>(std::count(refined.begin(), refined.end(), true));
    if (count == 0) return;
    bricks += count;
    report.is_too_large = static_cast<double>(bricks) > (is_chosen ? bricks_of_chosen : bricks_of_all);
    if (report.is_too_large) return;
    const SamplingLattice half = finer(lattice);
    places = BlockPlaces(half.size, places, refined);
    lattice = half;
    std::size_t overlaid = 0;
    TensorBlocks filled = mesh_blocks(on_lattice(coarsest, lattice), places, progress, overlaid);
    remove_empty_blocks(filled);
    if (level > 1) remove_orphans(blocks, filled);
    if (filled.empty()) return;
    grid.finer.push_back(std::move(filled));
    LevelReport& of_level = report.finer.emplace_back();
    of_level.voxel = lattice.voxel.minCoeff();
    of_level.bricks = count;
    for (const TensorBlock& block : grid.finer.back()) of_level.active += block.active.count();
  }
}

/// Rounds components to multiples of a power of two, which is twice as large at each level, so that a file has few
/// different bytes. Light crosses the voxels of a finer level in half of the time.
void round_values(TensorGrid& grid, double largest) {
  if (!(largest > 0)) return;
  auto quantum = static_cast<float>(std::exp2(std::floor(std::log2(largest))));
  for (TensorBlocks* const blocks : levels_of(grid)) {
    tbb::parallel_for(std::size_t{0}, blocks->size(), [&](std::size_t i) {
      for (Eigen::Matrix3f& value : (*blocks)[i].values) value = quantum * (value / quantum).array().round().matrix();
    });
    quantum *= 2;
  }
}

}  // namespace

TensorGrid sample_mesh(vtkDataSet& mesh, const SamplingSettings& settings, const Progress& progress,
                       SamplingReport& report) {
  const double* const of_points = made_tensors(*mesh.GetPointData());
  const double* const of_cells = made_tensors(*mesh.GetCellData());
  if (!of_points && !of_cells) throw std::invalid_argument("the mesh has no tensors: it must come from with_tensors");
  const Solid solid = solid_part(mesh);
  const SamplingLattice lattice = sampling_lattice(mesh, solid, settings);
  const double tolerance = face_tolerance * solid.bounds.diagonal().norm();
  auto* const layers = vtkIntArray::SafeDownCast(mesh.GetCellData()->GetArray(layer_array));
  const MeshSource source{mesh,     of_points, of_cells, solid, lattice, layers ? layers->GetPointer(0) : nullptr,
                          tolerance};
  TensorGrid grid;
  grid.to_world = Eigen::Translation3d(lattice.origin) * Eigen::Scaling(lattice.voxel);
  grid.blocks = mesh_blocks(source, BlockPlaces(lattice.size), progress, report.overlaid);
  remove_empty_blocks(grid.blocks);
  report.size = lattice.size;
  report.voxel = lattice.voxel;
  report_native(source, sampled_box(solid, settings), report);
  add_finer_levels(source, settings, progress, grid, report);
  round_values(grid, settings.rounding * report.native_median);
  report_sampled(grid, report);
  if (report.active == 0)
    throw std::invalid_argument(
        fmt::format("none of the {} x {} x {} voxels is inside of the mesh where its tensors are finite: give other "
                    "--bounds or smaller voxels",
                    lattice.size.x(), lattice.size.y(), lattice.size.z()));
  return grid;
}

}  // namespace tensorray
