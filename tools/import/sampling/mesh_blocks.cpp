#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <thread>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <vtkDataSet.h>

#include "tools/import/meshes/mesh_cell.h"
#include "tools/import/sampling/block_places.h"
#include "tools/import/sampling/cell_parts.h"
#include "tools/import/sampling/sampling_lattice.h"
#include "tools/import/sampling/voxel_average.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3d;
using Eigen::AlignedBox3i;
using Eigen::Vector3d;
using Eigen::Vector3i;
using Tensor = VoxelAverage::Tensor;

/// For each block that is sampled, the cells that may have voxels in it, by ascending index: the cells of block b are
/// cells[first[b]] to cells[first[b + 1] − 1].
struct Bins {
  std::vector<std::size_t> first;
  std::vector<vtkIdType> cells;
};

/// Indices of the voxels whose centres may be in a box, or no farther than `margin` from it; empty if there are none.
AlignedBox3i voxels_in(const AlignedBox3d& box, const SamplingLattice& lattice, const Vector3d& margin) {
  if (box.isEmpty()) return {};
  const auto index_of = [&](const Vector3d& position, const Vector3d& offset) {
    return Eigen::Array3d((position - lattice.origin + offset).array() / lattice.voxel.array());
  };
  const Eigen::Array3d last = (lattice.size.array() - 1).cast<double>();
  const Eigen::Array3d from = index_of(box.min(), -margin).ceil().max(0);
  const Eigen::Array3d to = index_of(box.max(), margin).floor().min(last);
  if ((from > to).any()) return {};
  return {from.cast<int>().matrix(), to.cast<int>().matrix()};
}

/// Calls `visit(block)` with the number of each block that has voxels among `voxels`.
template <class Visit>
void for_each_block(const BlockPlaces& places, const AlignedBox3i& voxels, const Visit& visit) {
  if (voxels.isEmpty()) return;
  const Vector3i from = voxels.min() / TensorBlock::size, to = voxels.max() / TensorBlock::size;
  for (int x = from.x(); x <= to.x(); ++x)
    for (int y = from.y(); y <= to.y(); ++y)
      for (int z = from.z(); z <= to.z(); ++z)
        if (const std::optional<std::size_t> block = places.number(x, y, z)) visit(*block);
}

Bins bins_of(const Solid& solid, const SamplingLattice& lattice, const BlockPlaces& places, const Vector3d& margin) {
  Bins bins;
  bins.first.assign(places.count() + 1, 0);
  for (const AlignedBox3d& box : solid.boxes)
    for_each_block(places, voxels_in(box, lattice, margin), [&](std::size_t block) { ++bins.first[block + 1]; });
  for (std::size_t block = 1; block < bins.first.size(); ++block) bins.first[block] += bins.first[block - 1];
  bins.cells.resize(bins.first.back());
  std::vector<std::size_t> next(bins.first.begin(), bins.first.end() - 1);
  for (std::size_t id = 0; id < solid.boxes.size(); ++id)
    for_each_block(places, voxels_in(solid.boxes[id], lattice, margin),
                   [&](std::size_t block) { bins.cells[next[block]++] = static_cast<vtkIdType>(id); });
  return bins;
}

/// The numbers of the blocks with cells, ordered by origin.
std::vector<std::size_t> used_blocks(const Bins& bins, const BlockPlaces& places) {
  std::vector<std::size_t> used;
  for (std::size_t block = 0; block + 1 < bins.first.size(); ++block)
    if (bins.first[block] < bins.first[block + 1]) used.push_back(block);
  std::sort(used.begin(), used.end(), [&](std::size_t a, std::size_t b) {
    const Vector3i of_a = places.place(a), of_b = places.place(b);
    return std::lexicographical_compare(of_a.begin(), of_a.end(), of_b.begin(), of_b.end());
  });
  return used;
}

/// The tensor of `cell`, whose weights are those at a position; not finite if a point with a weight has no finite
/// tensor.
Tensor tensor_in(const MeshSource& source, const MeshCell& cell, vtkIdType id, const std::vector<double>& weights) {
  using Given = Eigen::Map<const Tensor>;
  if (!source.point_tensors) return Given(source.cell_tensors + 9 * id);
  constexpr double rounding = 1e-9;
  Tensor sum = Tensor::Zero();
  for (int i = 0; i < cell.points(); ++i) {
    const double weight = weights[static_cast<std::size_t>(i)];
    if (std::abs(weight) > rounding) sum += weight * Given(source.point_tensors + 9 * cell.point(i));
  }
  return sum;
}

Eigen::Matrix3f matrix_of(const Tensor& tensor) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(tensor.data()).cast<float>();
}

/// @return false if the cell is not used.
bool load(const MeshSource& source, MeshCell& cell, vtkIdType id) {
  if (source.cell_tensors && !Eigen::Map<const Tensor>(source.cell_tensors + 9 * id).allFinite()) return false;
  return cell.load(source.mesh, id);
}

/// What one thread needs to fill a block.
struct Workspace {
  MeshCell cell;
  std::vector<VoxelAverage> averages = std::vector<VoxelAverage>(TensorBlock::voxels);
  /// Of samples of a part, in each voxel: Σ c cᵀ over c = (1, coordinates along its edges in [−1/2, 1/2]).
  std::vector<Eigen::Matrix4d> moments = std::vector<Eigen::Matrix4d>(TensorBlock::voxels, Eigen::Matrix4d::Zero());
  std::vector<std::size_t> sampled;                    ///< The voxels that have some.
  std::array<double, TensorBlock::voxels> fineness{};  ///< Of the finest cell in each voxel.
  std::array<int, TensorBlock::voxels> layer{};        ///< From which each voxel has its value.
};

/// The voxels of a block whose centres are in a cell, and that are in cells of several layers.
struct Filled {
  VoxelSet taken, overlaid;
};

/// Sets the tensor of a voxel whose centre is in the loaded cell. Where layers overlap, cells without data do not
/// count.
void fill_voxel(const MeshSource& source, Workspace& work, vtkIdType id, std::size_t offset, TensorBlock& block,
                Filled& filled) {
  const int layer = source.layers ? source.layers[id] : 0;
  const bool is_other = filled.taken[offset] && layer != work.layer[offset];
  const Eigen::Matrix3f tensor = matrix_of(tensor_in(source, work.cell, id, work.cell.weights()));
  if (source.layers && !tensor.allFinite()) return;
  if (is_other) filled.overlaid.set(offset);
  if (filled.taken[offset]) return;
  filled.taken.set(offset);
  work.layer[offset] = layer;
  if (!tensor.allFinite()) return;
  block.values[offset] = tensor;
  block.active.set(offset);
}

/// Sets the tensors of the block's voxels whose centres are in the cell and were in no earlier cell.
void fill_from_cell(const MeshSource& source, Workspace& work, vtkIdType id, TensorBlock& block, Filled& filled) {
  const AlignedBox3i voxels =
      voxels_in(source.solid.boxes[static_cast<std::size_t>(id)], source.lattice, Vector3d::Constant(source.tolerance));
  if (voxels.isEmpty()) return;
  const Vector3i from = (voxels.min() - block.origin).cwiseMax(0);
  const Vector3i to = (voxels.max() - block.origin).cwiseMin(TensorBlock::size - 1);
  bool is_loaded = false;
  for (int x = from.x(); x <= to.x(); ++x)
    for (int y = from.y(); y <= to.y(); ++y)
      for (int z = from.z(); z <= to.z(); ++z) {
        const auto offset = static_cast<std::size_t>(TensorBlock::offset(x, y, z));
        const bool is_done = !source.layers || filled.overlaid[offset] || work.layer[offset] == source.layers[id];
        if (filled.taken[offset] && is_done) continue;
        if (!is_loaded && !load(source, work.cell, id)) return;
        is_loaded = true;
        if (work.cell.find(source.lattice.position(block.origin + Vector3i(x, y, z)), source.tolerance))
          fill_voxel(source, work, id, offset, block, filled);
      }
}

/// @return the number of voxels in several layers.
std::size_t fill_centres(const MeshSource& source, const vtkIdType* begin, const vtkIdType* end, Workspace& work,
                         TensorBlock& block) {
  Filled filled;
  for (const vtkIdType* id = begin; id != end && (source.layers || !filled.taken.all()); ++id)
    fill_from_cell(source, work, *id, block, filled);
  return filled.overlaid.count();
}

struct AveragedCell {
  vtkIdType id = 0;
  double fineness = 0;             ///< How far its voxels are: from 0 (no part of their values) to 1 (all of it).
  double samples_along_voxel = 0;  ///< In each direction, where it is in several voxels.
};

/// A mesh and a lattice that are equally fine have the same detail; only what is finer than voxels is aliased.
/// @param cell  That of `id`, loaded.
AveragedCell averaged_cell(const MeshCell& cell, vtkIdType id, const Vector3d& voxel) {
  const double thickness = cell.thickness(voxel.cwiseInverse());
  // Layers that are many in a voxel need fewer samples each.
  return {id, std::clamp(2 * (1 - thickness), 0.0, 1.0), thickness < 0.125 ? 2.0 : 4.0};
}

/// Whether the cell may be thinner than a voxel. Needs no cell to be loaded.
bool may_be_fine(const MeshSource& source, vtkIdType id) {
  return source.solid.thickness[static_cast<std::size_t>(id)] < source.lattice.voxel.maxCoeff();
}

/// The box of voxels of the block, with all their volume.
AlignedBox3d box_of(const MeshSource& source, const TensorBlock& block, const VoxelSet& voxels) {
  AlignedBox3i box;
  for (int offset = 0; offset < TensorBlock::voxels; ++offset)
    if (voxels[static_cast<std::size_t>(offset)]) box.extend(Vector3i(block.origin + TensorBlock::position(offset)));
  const SamplingLattice& lattice = source.lattice;
  return {lattice.position(box.min()) - 0.5 * lattice.voxel, lattice.position(box.max()) + 0.5 * lattice.voxel};
}

/// The tensor at the centroid of a part of `cell`, and its changes along the part's edges.
VoxelAverage::Linear tensors_in(const MeshSource& source, const MeshCell& cell, vtkIdType id, const CellPart& part) {
  using Given = Eigen::Map<const Eigen::Matrix<double, 1, 9>>;
  VoxelAverage::Linear sum = VoxelAverage::Linear::Zero();
  if (!source.point_tensors) sum.row(0) = Given(source.cell_tensors + 9 * id);
  for (int i = 0; source.point_tensors && i < cell.points(); ++i)
    sum.noalias() += part.weights.col(i) * Given(source.point_tensors + 9 * cell.point(i));
  return sum;
}

/// The number of samples along each edge of a part: more where the part is in several voxels, among which samples
/// divide it. All in voxels.
Eigen::Array3d sample_counts(const Vector3d& centre, const Eigen::Matrix3d& edges, double samples_along_voxel) {
  constexpr double rounding = 1e-6, least = 3, thin = 0.125;
  Eigen::Array3d counts;
  for (int axis = 0; axis < 3; ++axis) {
    const double length = edges.col(axis).norm();
    const Eigen::Array3d reach = 0.5 * edges.col(axis).array().abs() - rounding;
    const Eigen::Array3d from = (centre.array() + 0.5 - reach).floor(), to = (centre.array() + 0.5 + reach).floor();
    counts[axis] = (from < to).any() ? std::max(least, std::ceil(samples_along_voxel * length - rounding))
                                     : std::max(length > thin ? 2.0 : 1.0, std::ceil(2 * length - rounding));
  }
  return counts;
}

/// Sums moments of samples of a part, evenly spaced along its edges, in the voxels of a block that they are in.
/// @param place  Times (1, coordinates along the edges): (1, the position from the block's first voxel, in voxels).
void sum_moments(Eigen::Matrix4d place, const Eigen::Array3d& counts, Workspace& work) {
  // Counted from the corner of the block before, so that rounding towards zero is down.
  place.col(0).tail<3>().array() += TensorBlock::size + 0.5;
  for (double x = 0.5; x < counts[0]; ++x)
    for (double y = 0.5; y < counts[1]; ++y) {
      const Eigen::Vector4d row(1, x / counts[0] - 0.5, y / counts[1] - 0.5, 0), start = place * row;
      for (double z = 0.5; z < counts[2]; ++z) {
        const double along = z / counts[2] - 0.5;
        const Eigen::Array4i index = (start + along * place.col(3)).cast<int>().array() - TensorBlock::size;
        if (static_cast<unsigned>(index[1] | index[2] | index[3]) >= TensorBlock::size) continue;
        const auto offset = static_cast<std::size_t>(TensorBlock::offset(index[1], index[2], index[3]));
        Eigen::Matrix4d& moments = work.moments[offset];
        if (moments(0, 0) == 0) work.sampled.push_back(offset);
        const Eigen::Vector4d coordinates = row + along * Eigen::Vector4d::UnitW();
        moments.noalias() += coordinates * coordinates.transpose();
      }
    }
}

/// Adds samples of a part to the averages of the voxels of the block that they are in.
void add_samples(const MeshSource& source, Workspace& work, const AveragedCell& cell, const TensorBlock& block,
                 const VoxelSet& voxels, const CellPart& part) {
  const SamplingLattice& lattice = source.lattice;
  const VoxelAverage::Linear tensors = tensors_in(source, work.cell, cell.id, part);
  if (!tensors.allFinite()) return;
  const Vector3d centre = (part.position - lattice.position(block.origin)).cwiseQuotient(lattice.voxel);
  const Eigen::Matrix3d edges = lattice.voxel.cwiseInverse().asDiagonal() * part.edges;
  const Eigen::Array3d counts = sample_counts(centre, edges, cell.samples_along_voxel);
  const double weight = part.volume / lattice.voxel.prod() / counts.prod();
  const Eigen::Matrix4d squares = tensors * tensors.transpose();
  Eigen::Matrix4d place;
  place << Eigen::RowVector4d::UnitX(), centre, edges;
  sum_moments(place, counts, work);
  for (const std::size_t offset : work.sampled) {
    if (voxels[offset] && (!source.layers || source.layers[cell.id] == work.layer[offset])) {
      place.col(0).tail<3>() = centre - TensorBlock::position(static_cast<int>(offset)).cast<double>();
      work.averages[offset].add(place, tensors, squares, weight * work.moments[offset]);
      work.fineness[offset] = std::max(work.fineness[offset], cell.fineness);
    }
    work.moments[offset].setZero();
  }
  work.sampled.clear();
}

/// Adds the parts in `voxels` of the block of cells that are thinner than voxels, or of the others.
void add_cells(const MeshSource& source, const vtkIdType* begin, const vtkIdType* end, Workspace& work,
               const TensorBlock& block, const VoxelSet& voxels, bool is_fine) {
  const AlignedBox3d where = box_of(source, block, voxels);
  for (const vtkIdType* id = begin; id != end; ++id) {
    const AlignedBox3d& box = source.solid.boxes[static_cast<std::size_t>(*id)];
    if ((is_fine && !may_be_fine(source, *id)) || !box.intersects(where) || !load(source, work.cell, *id)) continue;
    const AveragedCell cell = averaged_cell(work.cell, *id, source.lattice.voxel);
    if ((cell.fineness > 0) == is_fine)
      visit_parts(work.cell, source.lattice.voxel, where.intersection(box),
                  [&](const CellPart& part) { add_samples(source, work, cell, block, voxels, part); });
  }
}

/// Replaces the values of voxels with cells that are thinner than voxels by averages.
void average_voxels(const MeshSource& source, const vtkIdType* begin, const vtkIdType* end, Workspace& work,
                    TensorBlock& block) {
  if (std::none_of(begin, end, [&](vtkIdType id) { return may_be_fine(source, id); })) return;
  add_cells(source, begin, end, work, block, block.active, true);
  VoxelSet voxels;
  for (std::size_t offset = 0; offset < TensorBlock::voxels; ++offset) voxels[offset] = !work.averages[offset].empty();
  if (voxels.none()) return;
  add_cells(source, begin, end, work, block, voxels, false);
  for (std::size_t offset = 0; offset < TensorBlock::voxels; ++offset) {
    if (!voxels[offset]) continue;
    const auto part = static_cast<float>(work.fineness[offset]);
    block.values[offset] = (1 - part) * block.values[offset] + part * matrix_of(work.averages[offset].value());
    work.averages[offset] = {};
    work.fineness[offset] = 0;
  }
}

/// How far beyond a cell the centres of voxels may be that have a part of it.
Vector3d margin_of(const MeshSource& source) {
  const auto least = std::min_element(source.solid.thickness.begin(), source.solid.thickness.end());
  const bool averages = least != source.solid.thickness.end() && *least < source.lattice.voxel.maxCoeff();
  return (averages ? 0.5 : 0.0) * source.lattice.voxel + Vector3d::Constant(source.tolerance);
}

}  // namespace

TensorBlocks mesh_blocks(const MeshSource& source, const BlockPlaces& places, const Progress& progress,
                         std::size_t& overlaid) {
  Bins bins = bins_of(source.solid, source.lattice, places, margin_of(source));
  const std::vector<std::size_t> used = used_blocks(bins, places);
  TensorBlocks blocks = make_blocks(used.size());
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<std::uint64_t> done{0};
  std::atomic<std::size_t> in_layers{0};
  const auto is_finer = [&](vtkIdType a, vtkIdType b) {
    const int of_a = source.solid.coarseness[static_cast<std::size_t>(a)];
    const int of_b = source.solid.coarseness[static_cast<std::size_t>(b)];
    return of_a != of_b ? of_a < of_b : a < b;
  };
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, used.size(), 4), [&](const Range& range) {
    Workspace work;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      vtkIdType* const begin = bins.cells.data() + bins.first[used[i]];
      vtkIdType* const end = bins.cells.data() + bins.first[used[i] + 1];
      if (source.layers) std::sort(begin, end, is_finer);
      blocks[i].origin = TensorBlock::size * places.place(used[i]);
      in_layers += fill_centres(source, begin, end, work, blocks[i]);
      if (blocks[i].active.any()) average_voxels(source, begin, end, work, blocks[i]);
    }
    done += range.size();
    if (std::this_thread::get_id() == caller) progress.update("sampling", done, used.size());
  });
  progress.update("sampling", used.size(), used.size());
  overlaid = in_layers;
  return blocks;
}

}  // namespace tensorray
