#include "tools/import/sampling/refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <vtkDataSet.h>
#include <vtkIdList.h>
#include <vtkNew.h>

namespace tensorray {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
using Value = Eigen::Matrix<double, 9, 1>;
using IdRange = tbb::blocked_range<vtkIdType>;

/// Voxels that are larger than cells by less are as fine.
const double as_fine = std::sqrt(2.0);

/// How far voxels reach beyond a cell: those of the next level by half as much, so that there are bricks for the
/// B-splines of them all.
constexpr double margin = 2;

/// The voxels within a box and `beside` voxels around it.
Eigen::AlignedBox3i indices_of(const SamplingLattice& lattice, const Eigen::AlignedBox3d& box, double beside) {
  const Eigen::Array3d last = (lattice.size.array() - 1).cast<double>();
  const auto at = [&](const Vector3d& x, double offset) {
    return Eigen::Array3d((x - lattice.origin).cwiseQuotient(lattice.voxel).array() + offset).max(0).min(last).eval();
  };
  return {at(box.min(), -beside).floor().cast<int>().matrix(), at(box.max(), beside).ceil().cast<int>().matrix()};
}

std::array<double, 4> lagrange(double t) {
  return {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2, -(t + 1) * t * (t - 2) / 2,
          (t + 1) * t * (t - 1) / 6};
}

/// A function that is positive up to two voxels away.
double nearness(double distance) {
  const double rest = std::max(0.0, 1 - 0.25 * distance * distance);
  return rest * rest;
}

/// The voxels of a level.
class LevelVoxels {
 public:
  explicit LevelVoxels(const SampledLevel& level) : level_(level), block_(level.places.count(), nullptr) {
    for (const TensorBlock& block : level.blocks) {
      const Vector3i place = block.origin / TensorBlock::size;
      block_[*level.places.number(place.x(), place.y(), place.z())] = &block;
    }
  }

  /// The distance of what the voxels give at `x` from `value`; 0 where the voxels of the level end, as the level
  /// before is good enough there.
  double error(const Vector3d& x, const Value& value) const {
    const SamplingLattice& lattice = level_.source.lattice;
    const Vector3d at = (x - lattice.origin).cwiseQuotient(lattice.voxel);
    Vector3i from = at.array().floor().cast<int>() - 1;
    from = from.cwiseMin(lattice.size - Vector3i::Constant(4)).cwiseMax(0);
    const Vector3i to = (from + Vector3i::Constant(3)).cwiseMin(lattice.size - Vector3i::Ones());
    std::array<const float*, 64> values{};
    bool is_whole = to - from == Vector3i::Constant(3);
    for (int i = 0; i < 64; ++i) {
      const Vector3i index = from + Vector3i(i / 16, i / 4 % 4, i % 4);
      if ((index.array() > to.array()).any()) continue;
      const std::optional<std::size_t> place = level_.places.number(index.x() / 8, index.y() / 8, index.z() / 8);
      if (!place) return 0;
      const auto offset = static_cast<std::size_t>(TensorBlock::offset(index.x() % 8, index.y() % 8, index.z() % 8));
      const TensorBlock* const block = block_[*place];
      if (block && block->active[offset]) values[static_cast<std::size_t>(i)] = block->values[offset].data();
      is_whole = is_whole && values[static_cast<std::size_t>(i)];
    }
    const Vector3d inside = at - from.cast<double>();
    return ((is_whole ? cubic(values, inside) : fitted(values, inside, value)) - value).norm();
  }

 private:
  static Value value_of(const float* columns) {
    return Eigen::Map<const Eigen::Matrix3f>(columns).transpose().reshaped().cast<double>();
  }

  static Value cubic(const std::array<const float*, 64>& values, const Vector3d& at) {
    const auto wx = lagrange(at.x() - 1), wy = lagrange(at.y() - 1), wz = lagrange(at.z() - 1);
    Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
    for (std::size_t i = 0; i < 64; ++i)
      sum += static_cast<float>(wx[i / 16] * wy[i / 4 % 4] * wz[i % 4]) * Eigen::Map<const Eigen::Matrix3f>(values[i]);
    return value_of(sum.data());
  }

  /// By least squares; `none` where there are no voxels.
  static Value fitted(const std::array<const float*, 64>& values, const Vector3d& at, const Value& none) {
    Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
    Eigen::Matrix<double, 4, 9> sums = Eigen::Matrix<double, 4, 9>::Zero();
    for (int i = 0; i < 64; ++i) {
      const float* const tensor = values[static_cast<std::size_t>(i)];
      if (!tensor) continue;
      Eigen::Vector4d terms;
      terms << 1, Vector3d(i / 16, i / 4 % 4, i % 4) - at;
      const double weight = 1e-6 + nearness(terms[1]) * nearness(terms[2]) * nearness(terms[3]);
      moments.noalias() += weight * terms * terms.transpose();
      sums.noalias() += weight * terms * value_of(tensor).transpose();
    }
    if (moments(0, 0) == 0) return none;
    // Along an axis with one voxel there is no slope.
    moments.diagonal().tail<3>().array() += 1e-9 * moments(0, 0);
    return moments.ldlt().solve(sums).row(0).transpose();
  }

  const SampledLevel& level_;
  std::vector<const TensorBlock*> block_;  ///< By number; null: it has no active voxel.
};

/// Whether voxels are too coarse at a point of the mesh, or in a cell if tensors are at cells alone.
std::vector<char> find_misses(const SampledLevel& level, const std::vector<float>& sizes, double tolerance) {
  const MeshSource& source = level.source;
  const LevelVoxels voxels(level);
  const double voxel = source.lattice.voxel.maxCoeff();
  const Eigen::AlignedBox3d box(source.lattice.origin - 0.5 * source.lattice.voxel,
                                source.lattice.position(source.lattice.size) - 0.5 * source.lattice.voxel);
  const double* const tensors = source.point_tensors ? source.point_tensors : source.cell_tensors;
  std::vector<char> misses(sizes.size(), 0);
  tbb::parallel_for(IdRange(0, static_cast<vtkIdType>(sizes.size()), 256), [&](const IdRange& range) {
    for (vtkIdType id = range.begin(); id < range.end(); ++id) {
      const auto i = static_cast<std::size_t>(id);
      if (!(sizes[i] > 0) || sizes[i] * as_fine * 1.001 >= voxel) continue;
      Vector3d x;
      if (source.point_tensors)
        source.mesh.GetPoint(id, x.data());
      else
        x = source.solid.boxes[i].center();
      const Eigen::Map<const Value> value(tensors + 9 * id);
      if (!box.contains(x) || !value.allFinite()) continue;
      misses[i] = tolerance < 0 || voxels.error(x, value) > tolerance;
    }
  });
  return misses;
}

}  // namespace

std::vector<float> cell_sizes(const MeshSource& source) {
  const std::vector<float>& thickness = source.solid.thickness;
  if (!source.point_tensors) {
    std::vector<float> sizes(thickness.size(), 0);
    for (std::size_t i = 0; i < sizes.size(); ++i)
      if (!source.solid.boxes[i].isEmpty()) sizes[i] = thickness[i];
    return sizes;
  }
  std::vector<float> sums(static_cast<std::size_t>(source.mesh.GetNumberOfPoints()), 0), counts = sums;
  vtkNew<vtkIdList> ids;
  for (std::size_t cell = 0; cell < thickness.size(); ++cell) {
    if (source.solid.boxes[cell].isEmpty()) continue;
    source.mesh.GetCellPoints(static_cast<vtkIdType>(cell), ids);
    for (const vtkIdType id : *ids) {
      sums[static_cast<std::size_t>(id)] += thickness[cell];
      counts[static_cast<std::size_t>(id)] += 1;
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] /= std::max(1.0F, counts[i]);
  return sums;
}

std::vector<Eigen::AlignedBox3d> missed_cells(const SampledLevel& level, const std::vector<float>& sizes,
                                              double tolerance) {
  const MeshSource& source = level.source;
  const std::vector<char> misses = find_misses(level, sizes, tolerance);
  const auto is_missed = [&](vtkIdType i) { return misses[static_cast<std::size_t>(i)] != 0; };
  std::vector<Eigen::AlignedBox3d> missed;
  vtkNew<vtkIdList> ids;
  for (std::size_t cell = 0; cell < source.solid.boxes.size(); ++cell) {
    const Eigen::AlignedBox3d& box = source.solid.boxes[cell];
    if (box.isEmpty()) continue;
    const auto id = static_cast<vtkIdType>(cell);
    if (source.point_tensors) source.mesh.GetCellPoints(id, ids);
    if (source.point_tensors ? std::any_of(ids->begin(), ids->end(), is_missed) : is_missed(id)) missed.push_back(box);
  }
  return missed;
}

std::vector<bool> bricks_to_refine(const SamplingLattice& lattice, const BlockPlaces& places,
                                   const std::vector<Eigen::AlignedBox3d>& missed) {
  std::vector<bool> refined(places.count(), false);
  const Vector3i last = places.extent() - Vector3i::Ones();
  for (const Eigen::AlignedBox3d& box : missed) {
    const Eigen::AlignedBox3i voxels = indices_of(lattice, box, margin);
    const Vector3i from = voxels.min() / TensorBlock::size;
    Vector3i to = (voxels.max() / TensorBlock::size).cwiseMin(last);
    for (int axis = 0; axis < 3; ++axis)  // The voxels of the lattice's last face have a block of their own.
      if (TensorBlock::size * last[axis] == lattice.size[axis] - 1 && to[axis] == last[axis] - 1) ++to[axis];
    for (int x = from.x(); x <= to.x(); ++x)
      for (int y = from.y(); y <= to.y(); ++y)
        for (int z = from.z(); z <= to.z(); ++z)
          if (const std::optional<std::size_t> number = places.number(x, y, z)) refined[*number] = true;
  }
  return refined;
}

}  // namespace tensorray
