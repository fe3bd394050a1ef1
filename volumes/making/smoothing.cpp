#include "volumes/making/smoothing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "volumes/bricks/brick_index.h"
#include "volumes/making/level_grid.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3i;
using Eigen::Vector3i;
using GaussianWeights = std::vector<double>;
using BlockNumbers = std::vector<std::size_t>;

constexpr double cut = 4;  // Deviations at which the Gaussian ends.
constexpr double least_smoothing = 1 / cut;

/// The Gaussian at −radius … radius.
GaussianWeights gaussian(double deviation) {
  const int radius = static_cast<int>(cut * deviation);
  GaussianWeights weights;
  for (int i = -radius; i <= radius; ++i) weights.push_back(std::exp(-0.5 * (i / deviation) * (i / deviation)));
  return weights;
}

int radius_of(const GaussianWeights& weights) { return static_cast<int>(weights.size() / 2); }

Vector3i place_in(const Vector3i& voxel, int edge) {
  return voxel.unaryExpr([edge](int i) { return (i - (i % edge + edge) % edge) / edge; });
}

AlignedBox3i voxels_of(const Vector3i& origin) { return {origin, origin + Vector3i::Constant(TensorBlock::size - 1)}; }

/// Neighbouring blocks are smoothed together, so that those about them are read less often.
std::vector<BlockNumbers> tiles_of(const std::vector<BlockShape>& shapes, int radius) {
  const int edge = std::clamp((radius + TensorBlock::size - 1) / TensorBlock::size, 1, 8) * TensorBlock::size;
  std::map<std::array<int, 3>, BlockNumbers> tiles;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Vector3i tile = place_in(shapes[i].origin, edge);
    tiles[{tile.x(), tile.y(), tile.z()}].push_back(i);
  }
  std::vector<BlockNumbers> result;
  for (auto& [place, blocks] : tiles) result.push_back(std::move(blocks));
  return result;
}

/// Numbers at the voxels of a box, z fastest.
struct Numbers {
  AlignedBox3i box;
  Vector3i sizes;
  std::vector<double> values;

  explicit Numbers(const AlignedBox3i& voxels)
      : box(voxels), sizes(voxels.sizes() + Vector3i::Ones()), values(sizes.cast<std::size_t>().prod()) {}
  double& at(const Vector3i& voxel) {
    const Vector3i p = voxel - box.min();
    return values[(std::size_t(p.x()) * sizes.y() + p.y()) * sizes.z() + p.z()];
  }
};

/// Weighted sums along an axis, at the voxels that `box` has along it.
Numbers sums_along(int axis, const Numbers& from, const GaussianWeights& weights, const AlignedBox3i& box) {
  AlignedBox3i part = from.box;
  part.min()[axis] = box.min()[axis];
  part.max()[axis] = box.max()[axis];
  Numbers sums(part);
  const int count = sums.sizes[axis], all = from.sizes[axis];
  const int first = part.min()[axis] - from.box.min()[axis] - radius_of(weights);  // That the first sum is of.
  const std::size_t rows = sums.sizes.head(axis).cast<std::size_t>().prod();
  const std::size_t length = sums.sizes.tail(2 - axis).cast<std::size_t>().prod();
  for (std::size_t row = 0; row < rows; ++row)
    for (int i = 0; i < count; ++i) {
      double* const to = &sums.values[(row * count + i) * length];
      for (int j = std::max(0, first + i); j < std::min(all, first + i + static_cast<int>(weights.size())); ++j) {
        const double* const number = &from.values[(row * all + j) * length];
        for (std::size_t k = 0; k < length; ++k) to[k] += weights[j - first - i] * number[k];
      }
    }
  return sums;
}

/// Makes the blocks of a tile from those of the grid.
struct TileSmoothing {
  const TensorGrid& grid;
  const std::vector<BlockShape>& shapes;
  const BrickIndex& index;
  const AlignedBox3i& extent;
  const GaussianWeights& weights;

  void smooth(const BlockNumbers& tile, TensorBlocks& results) const {
    AlignedBox3i box;
    for (const std::size_t i : tile) box.extend(voxels_of(shapes[i].origin));
    box = box.intersection(extent);
    Numbers norms = convolved(box, [](const TensorBlock& block, int i) { return block.active[i] ? 1.0 : 0.0; });
    for (const std::size_t i : tile) {
      results[i].origin = shapes[i].origin;
      results[i].active = shapes[i].active;
      results[i].values.fill(Eigen::Matrix3f::Zero());
    }
    for (int entry = 0; entry < 9; ++entry) {
      Numbers sums =
          convolved(box, [&](const TensorBlock& block, int i) { return double{block.values[i].data()[entry]}; });
      for (const std::size_t i : tile)
        for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
          if (!shapes[i].active[offset]) continue;
          const Vector3i voxel = shapes[i].origin + TensorBlock::position(offset);
          results[i].values[offset].data()[entry] = static_cast<float>(sums.at(voxel) / norms.at(voxel));
        }
    }
  }

 private:
  template <class Value>
  Numbers convolved(const AlignedBox3i& box, const Value& value) const {
    const Vector3i radius = Vector3i::Constant(radius_of(weights));
    Numbers numbers(AlignedBox3i(box.min() - radius, box.max() + radius).intersection(extent));
    const Vector3i first = place_in(numbers.box.min(), TensorBlock::size),
                   last = place_in(numbers.box.max(), TensorBlock::size);
    for (int x = first.x(); x <= last.x(); ++x)
      for (int y = first.y(); y <= last.y(); ++y)
        for (int z = first.z(); z <= last.z(); ++z) {
          const std::uint32_t at = index.find({x, y, z});
          for (int i = 0; at != BrickIndex::missing && i < TensorBlock::voxels; ++i) {
            const Vector3i voxel = shapes[at].origin + TensorBlock::position(i);
            if (numbers.box.contains(voxel)) numbers.at(voxel) = value(grid.blocks[at], i);
          }
        }
    for (int axis = 0; axis < 3; ++axis) numbers = sums_along(axis, numbers, weights, box);
    return numbers;
  }
};

/// The blocks of a grid of one level, smoothed.
TensorBlocks smoothed_blocks(const TensorGrid& grid, const GaussianWeights& weights) {
  const std::vector<BlockShape> shapes = grid.shapes();
  const AlignedBox3i extent = active_box(shapes);
  std::vector<Vector3i> places;
  for (const BlockShape& shape : shapes) places.emplace_back(shape.origin / TensorBlock::size);
  const BrickIndex index(places);
  const std::vector<BlockNumbers> tiles = tiles_of(shapes, radius_of(weights));
  TensorBlocks results = unset_blocks(shapes.size());
  tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t i) {
    TileSmoothing{grid, shapes, index, extent, weights}.smooth(tiles[i], results);
  });
  return results;
}

/// Smooths a finer level, of a grid whose coarser ones are not smoothed yet.
void smooth_level(TensorGrid& grid, int level, double deviation) {
  const GaussianWeights weights = gaussian(deviation);
  const TensorBlocks results = smoothed_blocks(level_grid(grid, level, radius_of(weights)), weights);
  auto result = results.begin();  // Both have the same order, and the level has a part of the results.
  for (TensorBlock& block : grid.finer[static_cast<std::size_t>(level) - 1]) {
    while (result->origin != block.origin) ++result;
    block.values = result->values;
  }
}

}  // namespace

void smooth(TensorGrid& grid, double deviation) {
  const double finest = std::exp2(static_cast<double>(grid.finer.size())) * deviation;
  if (!(deviation >= 0 && finest <= max_smoothing))
    throw std::invalid_argument("smooth: the deviation must be 0 to 20 voxels of the finest level");
  if (grid.blocks.empty()) return;
  for (int level = static_cast<int>(grid.finer.size()); level > 0; --level)
    if (std::exp2(level) * deviation >= least_smoothing) smooth_level(grid, level, std::exp2(level) * deviation);
  if (deviation >= least_smoothing) grid.blocks = smoothed_blocks(grid, gaussian(deviation));
}

}  // namespace tensorray
