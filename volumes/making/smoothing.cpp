#include "volumes/making/smoothing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

using Eigen::AlignedBox3i;
using Eigen::Vector3i;

constexpr double cut = 4;  // Deviations at which the Gaussian ends.

/// The Gaussian at −radius … radius.
struct Kernel {
  int radius = 0;
  std::vector<double> weights;

  explicit Kernel(double deviation) : radius(static_cast<int>(cut * deviation)), weights(2 * radius + 1, 1) {
    for (int i = -radius; i <= radius && radius > 0; ++i)
      weights[i + radius] = std::exp(-0.5 * (i / deviation) * (i / deviation));
  }
  double at(int distance) const { return weights[distance + radius]; }
};

/// Neighbouring blocks that are smoothed together, so that blocks about them are read less often.
struct Tile {
  AlignedBox3i box;  ///< Voxels that it may contain, inclusive.
  std::vector<std::size_t> blocks;
};

/// Numbers at the voxels of a box, z fastest.
struct Numbers {
  AlignedBox3i box;
  Vector3i sizes;
  std::vector<double> values;

  explicit Numbers(const AlignedBox3i& voxels)
      : box(voxels), sizes(voxels.sizes() + Vector3i::Ones()), values(sizes.cast<std::size_t>().prod()) {}
  double* row(int x, int y) {  ///< The row that begins at (x, y, least z).
    return values.data() + (std::size_t(x - box.min().x()) * sizes.y() + (y - box.min().y())) * sizes.z();
  }
};

AlignedBox3i box_of(const Vector3i& origin, int edge) { return {origin, origin + Vector3i::Constant(edge - 1)}; }

/// The greatest multiple of `edge` that is not above i.
int multiple_below(int i, int edge) { return i - (i % edge + edge) % edge; }

std::vector<Tile> tiles_of(const std::vector<BlockShape>& shapes, int radius) {
  const int edge = std::clamp((radius + TensorBlock::size - 1) / TensorBlock::size, 1, 8) * TensorBlock::size;
  std::map<std::array<int, 3>, Tile> tiles;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Vector3i origin = shapes[i].origin.unaryExpr([edge](int j) { return multiple_below(j, edge); });
    Tile& tile = tiles[{origin.x(), origin.y(), origin.z()}];
    tile.box = box_of(origin, edge);
    tile.blocks.push_back(i);
  }
  std::vector<Tile> result;
  for (auto& [origin, tile] : tiles) result.push_back(std::move(tile));
  return result;
}

/// Numbers of the blocks that have voxels in `box`, in their order.
std::vector<std::size_t> blocks_in(const std::vector<BlockShape>& shapes, const AlignedBox3i& box) {
  const auto before = [](const BlockShape& shape, const Vector3i& origin) {
    return std::tuple(shape.origin.x(), shape.origin.y(), shape.origin.z()) <
           std::tuple(origin.x(), origin.y(), origin.z());
  };
  const Vector3i first =
      box.min().unaryExpr([](int i) { return i - (i % TensorBlock::size + TensorBlock::size) % TensorBlock::size; });
  std::vector<std::size_t> found;
  for (int x = first.x(); x <= box.max().x(); x += TensorBlock::size)
    for (int y = first.y(); y <= box.max().y(); y += TensorBlock::size) {
      auto next = std::lower_bound(shapes.begin(), shapes.end(), Vector3i(x, y, first.z()), before);
      for (; next != shapes.end() && next->origin.head<2>() == Eigen::Vector2i(x, y); ++next) {
        if (next->origin.z() > box.max().z()) break;
        found.push_back(static_cast<std::size_t>(next - shapes.begin()));
      }
    }
  return found;
}

/// The voxels from `low` to `high` along an axis that a kernel about `middle` reaches.
std::pair<int, int> reached(int middle, const Kernel& kernel, int low, int high) {
  return {std::max(low, middle - kernel.radius), std::min(high, middle + kernel.radius)};
}

/// Adds a row of voxels, times a weight, to another one.
void add_row(const double* from, double weight, int count, double* to) {
  for (int i = 0; i < count; ++i) to[i] += weight * from[i];
}

/// One component of a block: of its tensors, or 1 where a voxel is active.
using Component = std::array<double, TensorBlock::voxels>;

/// Adds a block to the sums along x.
void add_block(const Component& component, const AlignedBox3i& block, const Kernel& kernel, Numbers& sums) {
  const AlignedBox3i& box = sums.box;
  const int y_first = std::max(block.min().y(), box.min().y()), y_last = std::min(block.max().y(), box.max().y());
  const int z_first = std::max(block.min().z(), box.min().z()), z_last = std::min(block.max().z(), box.max().z());
  for (int from = block.min().x(); from <= block.max().x(); ++from) {
    const auto [first, last] = reached(from, kernel, box.min().x(), box.max().x());
    for (int x = first; x <= last; ++x)
      for (int y = y_first; y <= y_last; ++y) {
        const int offset = TensorBlock::offset(from - block.min().x(), y - block.min().y(), z_first - block.min().z());
        add_row(&component[offset], kernel.at(x - from), z_last - z_first + 1,
                sums.row(x, y) + z_first - box.min().z());
      }
  }
}

/// Sums along y, for the rows of `box`.
Numbers along_y(Numbers& from, const Kernel& kernel, const AlignedBox3i& box) {
  Numbers sums(AlignedBox3i(Vector3i(from.box.min().x(), box.min().y(), from.box.min().z()),
                            Vector3i(from.box.max().x(), box.max().y(), from.box.max().z())));
  for (int x = box.min().x(); x <= box.max().x(); ++x)
    for (int y = box.min().y(); y <= box.max().y(); ++y) {
      const auto [first, last] = reached(y, kernel, from.box.min().y(), from.box.max().y());
      for (int other = first; other <= last; ++other)
        add_row(from.row(x, other), kernel.at(other - y), sums.sizes.z(), sums.row(x, y));
    }
  return sums;
}

Numbers along_z(Numbers& from, const Kernel& kernel, const AlignedBox3i& box) {
  Numbers sums(box);
  for (int x = box.min().x(); x <= box.max().x(); ++x)
    for (int y = box.min().y(); y <= box.max().y(); ++y) {
      const double* const values = from.row(x, y) - from.box.min().z();
      for (int z = box.min().z(); z <= box.max().z(); ++z) {
        const auto [first, last] = reached(z, kernel, from.box.min().z(), from.box.max().z());
        for (int other = first; other <= last; ++other)
          sums.row(x, y)[z - box.min().z()] += kernel.at(other - z) * values[other];
      }
    }
  return sums;
}

AlignedBox3i grown(const AlignedBox3i& box, int by) {
  return {box.min() - Vector3i::Constant(by), box.max() + Vector3i::Constant(by)};
}

/// Makes the blocks of one tile from those of the grid.
class TileSmoothing {
 public:
  TileSmoothing(const TensorBlocks& blocks, const std::vector<BlockShape>& shapes, const AlignedBox3i& extent,
                const Kernel& kernel, const Tile& tile)
      : blocks_(blocks),
        shapes_(shapes),
        kernel_(kernel),
        tile_(tile),
        box_(tile.box.intersection(extent)),
        reach_(grown(box_, kernel.radius).intersection(extent)),
        sources_(blocks_in(shapes, reach_)) {}

  void write(TensorBlocks& results) const {
    const Numbers weights = convolved([this](std::size_t i, Component& component) {
      for (int offset = 0; offset < TensorBlock::voxels; ++offset) component[offset] = shapes_[i].active[offset];
    });
    for (std::size_t i : tile_.blocks) {
      results[i].origin = shapes_[i].origin;
      results[i].active = shapes_[i].active;
      results[i].values.fill(Eigen::Matrix3f::Zero());
    }
    for (int entry = 0; entry < 9; ++entry) {
      const Numbers sums = convolved([&](std::size_t i, Component& component) {
        for (int offset = 0; offset < TensorBlock::voxels; ++offset)
          component[offset] = blocks_[i].values[offset].data()[entry];
      });
      for (std::size_t i : tile_.blocks) write(sums, weights, entry, results[i]);
    }
  }

 private:
  template <class Fill>
  Numbers convolved(const Fill& fill) const {
    Numbers sums(AlignedBox3i(Vector3i(box_.min().x(), reach_.min().y(), reach_.min().z()),
                              Vector3i(box_.max().x(), reach_.max().y(), reach_.max().z())));
    Component component;
    for (std::size_t i : sources_) {
      fill(i, component);
      add_block(component, box_of(shapes_[i].origin, TensorBlock::size), kernel_, sums);
    }
    Numbers rows = along_y(sums, kernel_, box_);
    return along_z(rows, kernel_, box_);
  }

  void write(const Numbers& sums, const Numbers& weights, int entry, TensorBlock& block) const {
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      if (!block.active[offset]) continue;
      const Vector3i at = block.origin + TensorBlock::position(offset) - box_.min();
      const std::size_t i = (std::size_t(at.x()) * sums.sizes.y() + at.y()) * sums.sizes.z() + at.z();
      block.values[offset].data()[entry] = static_cast<float>(sums.values[i] / weights.values[i]);
    }
  }

  const TensorBlocks& blocks_;
  const std::vector<BlockShape>& shapes_;
  const Kernel& kernel_;
  const Tile& tile_;
  AlignedBox3i box_, reach_;  ///< Voxels that are made, and those that they are made of.
  std::vector<std::size_t> sources_;
};

}  // namespace

void smooth(TensorGrid& grid, double deviation) {
  if (!(deviation >= 0 && deviation <= max_smoothing))
    throw std::invalid_argument("smooth: the deviation must be 0 to 20 voxels");
  const Kernel kernel(deviation);
  if (kernel.radius == 0 || grid.blocks.empty()) return;
  const std::vector<BlockShape> shapes = grid.shapes();
  const AlignedBox3i extent = active_box(shapes);
  const std::vector<Tile> tiles = tiles_of(shapes, kernel.radius);
  TensorBlocks results = unset_blocks(shapes.size());
  tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t i) {
    TileSmoothing(grid.blocks, shapes, extent, kernel, tiles[i]).write(results);
  });
  grid.blocks = std::move(results);
}

}  // namespace tensorray
