#include "integrators/stretch/stretch.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <stdexcept>

#include <Eigen/Geometry>

#include "base/process/job.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

constexpr std::size_t stretch_round = 64;  // Rows, or columns of blocks, that are made before others get them.

/// ln of the greatest singular value.
double log_stretch(const Eigen::Matrix<double, 3, 2>& m) {
  const Eigen::Matrix2d square = m.transpose() * m;
  const double mean = square.trace() / 2;
  const double greatest = mean + std::hypot((square(0, 0) - square(1, 1)) / 2, square(0, 1));
  return std::log(std::max(greatest, std::numeric_limits<double>::min())) / 2;
}

constexpr double max_voxels = 1 << 30;

/// A lattice in the volume, with the same centre as the extent.
struct Lattice {
  Eigen::Vector3i size;
  Eigen::Affine3d to_world;
};

Lattice make_lattice(const TensorField& field, int resolution) {
  if (resolution < 2) throw std::invalid_argument("the resolution must be 2 or more");
  const Eigen::AlignedBox3d& extent = field.index_bounds();
  const double spacing = extent.sizes().maxCoeff() / (resolution - 1);
  Lattice lattice;
  lattice.size = (extent.sizes() / spacing + Eigen::Vector3d::Constant(1e-6)).array().floor().cast<int>() + 1;
  if (lattice.size.cast<double>().prod() > max_voxels)
    throw std::invalid_argument("the grid would have more than 2^30 voxels: lower the resolution");
  const Eigen::Vector3d first = extent.center() - spacing / 2 * (lattice.size.cast<double>() - Eigen::Vector3d::Ones());
  lattice.to_world = field.to_world() * Eigen::Translation3d(first) * Eigen::Scaling(spacing);
  return lattice;
}

/// All blocks of a lattice, in order.
std::deque<ScalarBlock> blocks_of(const Lattice& lattice) {
  constexpr int size = TensorBlock::size;
  std::deque<ScalarBlock> blocks;
  for (int x = 0; x < lattice.size.x(); x += size)
    for (int y = 0; y < lattice.size.y(); y += size)
      for (int z = 0; z < lattice.size.z(); z += size) {
        blocks.emplace_back();
        blocks.back().origin = {x, y, z};
      }
  return blocks;
}

}  // namespace

std::vector<float> stretches(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                             const StretchSettings& settings, const std::vector<Eigen::Vector3d>& starts) {
  if (!std::isfinite(settings.length)) throw std::invalid_argument("the length of the rays must be finite");
  BendingSettings limited = bending;
  limited.max_length = settings.length;
  RayDifferential across;
  across.position.col(0) = settings.direction.unitOrthogonal();
  across.position.col(1) = settings.direction.cross(across.position.col(0));
  RayBatch batch;
  for (const Eigen::Vector3d& start : starts) {
    batch.add(start, settings.direction, settings.flexibility);
    batch.differentials.push_back(across);
  }
  trace(field, geometry, limited, batch);

  std::vector<float> values(starts.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (batch.end[i] != RayEnd::missed || batch.steps[i] == 0) continue;
    const RayDifferential& end = batch.differentials[i];
    values[i] = static_cast<float>(log_stretch(end.position - batch.direction[i] * end.length) / settings.length);
  }
  return values;
}

ScalarGrid stretch_grid(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                        const StretchSettings& settings, int resolution, const Progress& progress) {
  const Lattice lattice = make_lattice(field, resolution);
  ScalarGrid grid;
  grid.name = "stretch";
  grid.to_world = lattice.to_world;
  grid.blocks = blocks_of(lattice);
  const auto compute = [&](ScalarBlock& block) {
    std::vector<Eigen::Vector3d> starts;
    std::vector<int> offsets;
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      const Eigen::Vector3i voxel = block.origin + TensorBlock::position(offset);
      if ((voxel.array() >= lattice.size.array()).any()) continue;
      starts.push_back(lattice.to_world * voxel.cast<double>());
      offsets.push_back(offset);
    }
    const std::vector<float> values = stretches(field, geometry, bending, settings, starts);
    for (std::size_t k = 0; k < values.size(); ++k) block.values[offsets[k]] = values[k];
  };
  for (ScalarBlock& block : grid.blocks) block.values.fill(std::numeric_limits<float>::quiet_NaN());
  const auto high = static_cast<std::size_t>((lattice.size.z() + TensorBlock::size - 1) / TensorBlock::size);
  Units columns;
  columns.count = grid.blocks.size() / high;
  columns.kind = "stretch of blocks";
  columns.round = stretch_round;
  columns.make = [&](std::size_t column) {
    for (std::size_t i = column * high; i < (column + 1) * high; ++i) compute(grid.blocks[i]);
  };
  columns.copy = [&](std::size_t column, Archive& archive) {
    for (std::size_t i = column * high; i < (column + 1) * high; ++i) archive.copy(grid.blocks[i].values);
  };
  make_units(columns, settings.job, "tracing rays", progress);
  for (ScalarBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      float& value = block.values[offset];
      if (std::isnan(value))
        value = 0;
      else
        block.active.set(offset);
    }
  remove_empty_blocks(grid.blocks);
  return grid;
}

std::vector<float> stretch_picture(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                                   const StretchSettings& settings, const Plate& pixels, const Progress& progress) {
  const auto width = static_cast<std::size_t>(pixels.resolution.x());
  const auto height = static_cast<std::size_t>(pixels.resolution.y());
  std::vector<float> picture(width * height, std::numeric_limits<float>::quiet_NaN());
  Units rows;
  rows.count = height;
  rows.kind = "stretch of row";
  rows.round = stretch_round;
  rows.make = [&](std::size_t y) {
    std::vector<Eigen::Vector3d> starts;
    for (std::size_t x = 0; x < width; ++x)
      starts.push_back(pixels.to_world(Eigen::Vector2d(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5)));
    const std::vector<float> row = stretches(field, geometry, bending, settings, starts);
    std::copy(row.begin(), row.end(), picture.begin() + static_cast<std::ptrdiff_t>(y * width));
  };
  rows.copy = [&](std::size_t y, Archive& archive) { archive.copy(&picture[y * width], width * sizeof picture[0]); };
  if (settings.show) rows.shown = [&] { settings.show(picture); };
  make_units(rows, settings.job, "tracing rays", progress);
  return picture;
}

}  // namespace tensorray
