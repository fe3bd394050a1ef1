#include "integrators/photon_distribution/fluence.h"

#include "integrators/photon_distribution/photon_distribution.h"
#include "tests/tracing/flow_support.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

LightBench bench_of(TensorField field, const Vector3d& direction, Surfaces extra = {}) {
  return make_bench(std::move(field), plate_across(direction, 9), std::move(extra), direction);
}

/// The weights are different and sum to 1.
std::vector<LightChannel> channels() { return {{0.1, 650, 0.5}, {0.2, 550, 0.125}, {-0.3, 450, 0.375}}; }

PhotonDistribution distribute(const LightBench& bench, FluenceKind kind, std::uint64_t photons, BeamPattern pattern) {
  PhotonSettings settings;
  settings.photons = photons;
  settings.pattern = pattern;
  settings.fluence = kind;
  settings.density.kind = DensityKind::histogram;
  return distribute_photons(bench.field, bench.geometry, bench.beam, channels(), settings, Progress());
}

/// Visits the voxels with light: visit(voxel, value).
template <class Visit>
void for_each(const ScalarGrid& grid, const Visit& visit) {
  for (const ScalarBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset]) visit(Vector3i(block.origin + TensorBlock::position(offset)), block.values[offset]);
}

/// Σ fluence · volume, world units³. Of an outermost voxel only the part within the extent counts.
double sum(const TensorField& field, const ScalarGrid& grid) {
  double total = 0;
  for_each(grid, [&](const Vector3i& voxel, double value) {
    for (int axis = 0; axis < 3; ++axis) {
      const bool outermost = voxel[axis] == field.voxels().min()[axis] || voxel[axis] == field.voxels().max()[axis];
      if (outermost && field.voxels().sizes()[axis] > 0) value /= 2;
    }
    total += value * std::abs(field.to_world().linear().determinant());
  });
  return total;
}

/// Of straight light through 9³ voxels: 1 at each.
void expect_ones(const ScalarGrid& grid) {
  int voxels = 0;
  for_each(grid, [&](const Vector3i& voxel, float value) {
    EXPECT_NEAR(value, 1, 1e-6) << voxel.transpose();
    ++voxels;
  });
  EXPECT_EQ(voxels, 9 * 9 * 9);
}

TEST(Fluence, OfStraightLightIsOneAtEveryVoxel) {
  const LightBench bench = bench_of(cube_field(9, zero), {0, 0, -1});
  // 64 × 64 rays: 8 across a voxel along each axis, 4 across the half voxels at the sides.
  const auto grids = distribute(bench, FluenceKind::bands, 64 * 64, BeamPattern::grid).fluence;
  ASSERT_EQ(grids.size(), 4u);
  for (const ScalarGrid& grid : grids) {
    expect_ones(grid);
    EXPECT_TRUE(grid.fog);
    EXPECT_EQ(grid.to_world.matrix(), bench.field.to_world().matrix());
  }
}

/// Σ power · length in the volume, of each channel, by tracing the same rays and recording their complete records.
std::vector<double> lengths_by_channel(const LightBench& bench, std::uint64_t photons, BeamPattern pattern) {
  const BeamSampler positions(bench.beam, pattern, photons, 0);
  std::vector<double> lengths(channels().size());
  Emission emission;
  for (std::uint64_t i = 0; i < positions.candidates(); ++i) {
    if (!positions.sample(i, emission)) continue;
    for (std::size_t channel = 0; channel < lengths.size(); ++channel) {
      RayBatch batch;
      std::vector<RayRecord> records;
      batch.add(emission.origin, bench.beam.direction, channels()[channel].flexibility);
      trace(bench.field, bench.geometry, {}, batch, &records);
      const PathPoints points = points_of(bench.field, records[0]);
      for (std::size_t k = 1; k < points.size(); ++k)
        if (points[k].in_field && points[k - 1].in_field) lengths[channel] += points[k].length - points[k - 1].length;
    }
  }
  return lengths;
}

TEST(Fluence, SumsToPowerTimesLengthOfTheWaysInTheVolume) {
  const Affine3d placement(Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()));
  const auto tensor = [](const Vector3d& p) { return Matrix3d(4 * linear_tensor(p)); };
  const LightBench bench = bench_of(cube_field(20, tensor, placement), {0.2, 0.1, -1},
                                    obstacle_between({-0.3, -0.3, -0.3}, {0.2, 0.2, 0.2}));
  const PhotonDistribution light = distribute(bench, FluenceKind::bands, 1000, BeamPattern::sobol);
  const std::vector<double> lengths = lengths_by_channel(bench, 1000, BeamPattern::sobol);
  double all = 0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const double expected = lengths[i] * light.ray_area;
    EXPECT_NEAR(sum(bench.field, light.fluence[i + 1]), expected, 1e-6 * expected);  // Single precision.
    all += channels()[i].power * expected;
  }
  EXPECT_NEAR(sum(bench.field, light.fluence[0]), all, 1e-6 * all);
  const auto one_grid = distribute(bench, FluenceKind::all_light, 1000, BeamPattern::sobol).fluence;
  EXPECT_NEAR(sum(bench.field, one_grid[0]), all, 1e-6 * all);
}

TEST(Fluence, CountsLightThatIsStraightBesideACutAndMissesThePlate) {
  Surfaces cut = cut_between(Vector3d::Constant(-0.55), Vector3d::Constant(0.55));
  LightBench bench = bench_of(cube_field(9, zero), {0, 0, -1}, std::move(cut));
  Surfaces surfaces = bench.geometry.surfaces();
  surfaces.plate->size = {0.3, 0.3};
  bench.geometry = Geometry(surfaces);
  expect_ones(distribute(bench, FluenceKind::all_light, 64 * 64, BeamPattern::grid).fluence[0]);
}

/// Blocks of 8³ voxels at the corners of a cube; with `filled`, zeros everywhere between them.
TensorGrid corner_blocks(int size, bool filled) {
  const auto value = [](const Vector3i& i) { return Matrix3d(0.05 * linear_tensor(i.cast<double>() / 40)); };
  if (!filled) {
    TensorGrid grid = dense_grid({Vector3i::Zero(), Vector3i::Constant(7)}, Affine3d::Identity(), value);
    for (int corner = 1; corner < 8; ++corner) {
      const Vector3i from = (size - 8) * Vector3i(corner >> 2, corner >> 1 & 1, corner & 1);
      const TensorGrid more = dense_grid({from, from + Vector3i::Constant(7)}, Affine3d::Identity(), value);
      grid.blocks.push_back(more.blocks.front());
    }
    return grid;
  }
  return dense_grid({Vector3i::Zero(), Vector3i::Constant(size - 1)}, Affine3d::Identity(), [&](const Vector3i& i) {
    const Vector3i in_block = i.cwiseMin(Vector3i::Constant(size - 1) - i);
    return in_block.maxCoeff() < 8 ? value(i) : Matrix3d::Zero().eval();
  });
}

TEST(Fluence, OfASparseFieldIsThatOfAFullOneAtTheFieldsBlocks) {
  const LightBench sparse = bench_of(TensorField(corner_blocks(40, false)), {0.1, 0.2, -1});
  const LightBench full = bench_of(TensorField(corner_blocks(40, true)), {0.1, 0.2, -1});
  const ScalarGrid found = distribute(sparse, FluenceKind::all_light, 5000, BeamPattern::stratified).fluence[0];
  const ScalarGrid all = distribute(full, FluenceKind::all_light, 5000, BeamPattern::stratified).fluence[0];
  EXPECT_EQ(all.blocks.size(), 125u);
  std::size_t with_tensors = 0;
  for (const ScalarBlock& block : found.blocks) {
    const auto same = std::find_if(all.blocks.begin(), all.blocks.end(),
                                   [&](const ScalarBlock& each) { return each.origin == block.origin; });
    ASSERT_NE(same, all.blocks.end());
    EXPECT_EQ(block.values, same->values) << block.origin.transpose();
    with_tensors += ((block.origin.array() == 0) || (block.origin.array() == 32)).all();
  }
  EXPECT_EQ(with_tensors, 8u);
  EXPECT_LE(found.blocks.size(), 64u);  // The blocks with tensors, and the blocks whose cells reach to them.
}

TEST(Fluence, MemoryFollowsTheFieldsBlocksAndNotTheExtent) {
  constexpr int size = 1 << 16;  // 2^39 blocks.
  const TensorField field(corner_blocks(size, false));
  FluenceSums sums(field, {1}, false, 10);
  const std::size_t before = sums.memory_bytes();
  EXPECT_LT(before, 10000u);
  const Vector3d from(3, 4, -2), to(3, 4, size + 2);  // Through two of the blocks and the gap between them.
  RayRecord ray;
  ray.before = {{from, {0, 0, 1}, 0}, {to, {0, 0, 1}, (to - from).norm()}};
  sums.add(0, ray);
  EXPECT_LE(sums.memory_bytes(), before + 3 * TensorBlock::voxels * sizeof(std::uint64_t));
  int voxels = 0;
  for_each(sums.grids(1)[0], [&](const Vector3i& voxel, float value) {
    EXPECT_NEAR(value, 1, 1e-6);
    EXPECT_EQ(voxel.head<2>(), Eigen::Vector2i(3, 4));
    ++voxels;
  });
  EXPECT_EQ(voxels, 24);  // Two blocks with tensors, and the block before the last one, whose cells reach to it.
}

}  // namespace
}  // namespace tensorray
