#include "integrators/photon_distribution/fluence.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include <Eigen/LU>
#include <tbb/parallel_for.h>

#include "volumes/grids/voxel_walk.h"

namespace tensorray {
namespace {

constexpr int finest_bits = 32;  // The last bit of a sum is 2^-32 of a voxel's edge.
constexpr int room_bits = 60;    // It is larger if sixteen edges for each ray need more than 64 bits.

double quantum_for(std::uint64_t rays) {
  int bits = 0;
  while (bits < room_bits && (std::uint64_t{1} << bits) < rays) ++bits;
  return std::ldexp(1.0, -std::min(finest_bits, room_bits - bits));
}

Eigen::Vector3i block_of(const Eigen::Vector3i& voxel) { return {voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3}; }

/// The blocks that hold the voxels of the field's bricks, in order. A brick also has the voxels on its far faces. On
/// the far faces of the extent, these belong to no other brick.
std::vector<Eigen::Vector3i> blocks_of(const TensorField& field) {
  const Eigen::Vector3i last_voxel = field.voxels().max().cast<int>(), last = block_of(last_voxel);
  std::vector<Eigen::Vector3i> blocks;
  blocks.reserve(field.brick_count());
  for (const Eigen::Vector3i& brick : field.bricks())
    for (int bits = 0; bits < 8; ++bits) {
      const Eigen::Array3i step(bits & 1, bits >> 1 & 1, bits >> 2);
      const Eigen::Array3i behind = brick.array() + step;  // A step leads only to last voxels of the extent.
      const auto is_last = behind == last.array() && TensorBlock::size * behind == last_voxel.array();
      if ((step == 0 || is_last).all()) blocks.emplace_back(behind.matrix());
    }
  std::sort(blocks.begin(), blocks.end(), [](const Eigen::Vector3i& a, const Eigen::Vector3i& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  });
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  return blocks;
}

/// The fraction of a voxel's volume that lies within the bounds.
double part_within(const Eigen::AlignedBox3d& bounds, const Eigen::Vector3i& voxel) {
  const Eigen::Vector3d center = voxel.cast<double>(), half = Eigen::Vector3d::Constant(0.5);
  return Eigen::AlignedBox3d(center - half, center + half).intersection(bounds).sizes().prod();
}

}  // namespace

FluenceSums::FluenceSums(const TensorField& field, std::vector<double> powers, bool bands, std::uint64_t rays)
    : field_(field),
      powers_(std::move(powers)),
      bands_(bands),
      planes_(bands ? powers_.size() : 1),
      edge_(std::cbrt(std::abs(field.to_world().linear().determinant()))),
      quantum_(quantum_for(rays)),
      places_(blocks_of(field)),
      index_(places_),
      blocks_(places_.size()) {
  const double sum = std::accumulate(powers_.begin(), powers_.end(), 0.0);
  if (!(sum > 0)) throw std::invalid_argument("fluence needs light with power above zero");
  for (double& power : powers_) power /= sum;
  max_power_ = *std::max_element(powers_.begin(), powers_.end());
}

FluenceSums::~FluenceSums() {
  for (const std::atomic<Sum*>& block : blocks_) delete[] block.load();
}

FluenceSums::Sum* FluenceSums::sums_of(std::uint32_t number) {
  std::atomic<Sum*>& block = blocks_[number];
  Sum* sums = block.load(std::memory_order_acquire);
  if (sums) return sums;
  std::unique_ptr<Sum[]> made(new Sum[planes_ * TensorBlock::voxels]());
  // Another thread may have set the block first.
  if (block.compare_exchange_strong(sums, made.get(), std::memory_order_acq_rel)) return made.release();
  return sums;
}

void FluenceSums::add(std::size_t channel, const RayRecord& ray) {
  const std::size_t plane = bands_ ? channel : 0;
  const double weight = (bands_ ? 1 : powers_[channel] / max_power_) / (edge_ * quantum_);
  // Rounds what is added so that the sum over the whole ray is exact to one quantum.
  double way = 0;
  std::uint64_t added = 0;
  Eigen::Vector3d from;
  double from_length = 0;
  for (std::size_t i = 0; i < ray.size(); ++i) {
    const PathPoint point = path_point(field_, ray, i);
    const Eigen::Vector3d to = field_.to_index() * point.position;
    if (i > 0) {
      const double length = weight * (point.length - from_length);
      walk_voxels(from, to, field_.index_bounds(), [&](const Eigen::Vector3i& voxel, double begin, double end) {
        way += length * (end - begin);
        const auto more = static_cast<std::uint64_t>(std::llround(way)) - added;
        if (more == 0) return;
        added += more;
        const std::uint32_t block = index_.find(block_of(voxel));
        if (block == BrickIndex::missing) return;
        const int offset = TensorBlock::offset(voxel.x() & 7, voxel.y() & 7, voxel.z() & 7);
        sums_of(block)[plane * TensorBlock::voxels + offset].fetch_add(more, std::memory_order_relaxed);
      });
    }
    from = to;
    from_length = point.length;
  }
}

/// The number of planes, and that of blocks with light; then for each of these its number and its sums.
void FluenceSums::copy_sums(Archive& archive) {
  std::size_t planes = planes_, lit = lit_blocks();
  archive.copy(planes);
  archive.copy(lit);
  if (planes != planes_) throw DamagedArchive("the fluence that was kept has other bands");
  const std::size_t of_block = planes_ * TensorBlock::voxels;
  std::vector<std::uint64_t> values(of_block);
  std::size_t block = 0;
  for (std::size_t i = 0; i < lit; ++i, ++block) {
    while (!archive.reads() && !blocks_[block].load()) ++block;
    archive.copy(block);
    if (block >= blocks_.size()) throw DamagedArchive("the fluence that was kept is that of another field");
    archive.require(archive.reads() ? of_block : 0, sizeof values[0]);
    Sum* const sums = sums_of(static_cast<std::uint32_t>(block));
    for (std::size_t k = 0; k < of_block && !archive.reads(); ++k) values[k] = sums[k].load(std::memory_order_relaxed);
    archive.copy(values.data(), of_block * sizeof values[0]);
    for (std::size_t k = 0; k < of_block && archive.reads(); ++k)
      sums[k].fetch_add(values[k], std::memory_order_relaxed);
  }
}

ScalarGrid FluenceSums::grid_of(std::size_t first_plane, const std::vector<double>& weights) const {
  ScalarGrid grid;
  grid.to_world = field_.to_world();
  grid.fog = true;
  std::vector<std::size_t> lit;
  for (std::size_t i = 0; i < blocks_.size(); ++i)
    if (blocks_[i].load()) lit.push_back(i);
  grid.blocks.resize(lit.size());
  const double unit = quantum_ / (edge_ * edge_);  // quantum · edge / edge³
  tbb::parallel_for(std::size_t{0}, lit.size(), [&](std::size_t i) {
    ScalarBlock& block = grid.blocks[i];
    block.origin = TensorBlock::size * places_[lit[i]];
    const Sum* const sums = blocks_[lit[i]].load();
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      double value = 0;
      for (std::size_t plane = 0; plane < weights.size(); ++plane)
        value +=
            weights[plane] * static_cast<double>(sums[(first_plane + plane) * TensorBlock::voxels + offset].load());
      if (value == 0) continue;
      const Eigen::Vector3i voxel = block.origin + TensorBlock::position(offset);
      block.active.set(offset);
      block.values[offset] = static_cast<float>(value * unit / part_within(field_.index_bounds(), voxel));
    }
  });
  remove_empty_blocks(grid.blocks);
  return grid;
}

std::size_t FluenceSums::lit_blocks() const {
  return static_cast<std::size_t>(
      std::count_if(blocks_.begin(), blocks_.end(), [](const auto& block) { return block.load(); }));
}

std::size_t FluenceSums::memory_bytes() const {
  return lit_blocks() * planes_ * TensorBlock::voxels * sizeof(Sum) +
         places_.size() * (sizeof(places_[0]) + sizeof(blocks_[0])) + index_.memory_bytes();
}

std::vector<ScalarGrid> FluenceSums::grids(double ray_area) const {
  std::vector<double> weights{max_power_};
  if (bands_) weights = powers_;
  for (double& weight : weights) weight *= ray_area;
  std::vector<ScalarGrid> all{grid_of(0, weights)};
  for (std::size_t plane = 0; bands_ && plane < planes_; ++plane) all.push_back(grid_of(plane, {ray_area}));
  return all;
}

}  // namespace tensorray
