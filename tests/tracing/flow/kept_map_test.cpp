// Flow maps whose vertices were traced in earlier runs or by shards, and whose map and light ranks make together: the
// same bits, and hardly a ray more.

#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "base/process/job.h"
#include "tests/base/rank_support.h"
#include "tests/tracing/flow_support.h"

namespace tensorray {
namespace {

using namespace test;

/// Without symmetry, so that sums differ with their order.
Eigen::Matrix3d skew_lens(const Eigen::Vector3d& at) {
  return lens({1.1 * at.x() + 0.13 * at.y() + 0.07, 0.9 * at.y() - 0.21 * at.x() - 0.05, at.z()});
}

const FlowBench& bench() {
  static const FlowBench bench = make_bench(skew_lens, plate_at(4, 2.4, 48));
  return bench;
}

FlowMap map_with(FlowSettings settings, Job& job) {
  settings.job = &job;
  settings.is_kept = true;
  return map_of(bench(), settings);
}

Caustic light_with(const FlowMap& map, Ranks* ranks) {
  std::vector<CausticBand> bands(3);
  for (std::size_t i = 0; i < bands.size(); ++i) {
    bands[i].width = static_cast<double>(map.wavelengths - 1) / 3;
    bands[i].sample = (static_cast<double>(i) + 0.5) * bands[i].width;
    bands[i].channel = i;
    bands[i].color = {0.2, 0.3 * static_cast<double>(i), 1};
  }
  return draw_caustic(map, bench().plate(), bands, {3, true, usual_step, ranks}, Progress());
}

void expect_same(const FlowMap& a, const FlowMap& b) {
  EXPECT_TRUE(a.starts == b.starts);
  EXPECT_TRUE(a.ends == b.ends);
  EXPECT_TRUE(a.lengths == b.lengths);
  EXPECT_EQ(a.triangles.size(), b.triangles.size());
  EXPECT_TRUE(light_with(a, nullptr).irradiance.values == light_with(b, nullptr).irradiance.values);
}

/// What a shard keeps, which is as much of a map as it makes.
Results shard_of(const FlowSettings& settings, WorkPart part, std::size_t& rays) {
  Job shard(part);
  shard.is_shard = true;
  rays += map_with(settings, shard).rays;
  EXPECT_EQ(shard.results().size(), 1u);
  return shard.results();
}

TEST(KeptMap, OfShardsIsThatOfOneRun) {
  std::vector<FlowSettings> all{single(0.3), range(0.1, 0.4)};
  all.back().silhouette = false;  // Its vertices at the border are predicted, too.
  for (const FlowSettings& settings : all) {
    const FlowMap alone = map_of(bench(), settings);
    for (const std::size_t count : {1, 3, 16}) {
      std::size_t rays = 0;
      Results results;
      for (std::size_t index = 0; index < count; ++index)
        for (const auto& each : shard_of(settings, {index, count}, rays)) results.insert(each);
      Job merged({0, count}, results);
      const FlowMap map = map_with(settings, merged);
      expect_same(map, alone);
      EXPECT_LE(map.rays, alone.rays / 100) << count;  // Few vertices have parents that no shard has.
      EXPECT_LE(rays, alone.rays * 3 / 2) << count;    // Those on the borders of blocks are traced by two.
    }
  }
}

TEST(KeptMap, IsNotTracedAgain) {
  const FlowSettings settings = range(0.1, 0.4);
  Job quick, slow;
  map_with(settings, quick);
  EXPECT_TRUE(quick.results().empty());
  slow.interval = 1e-9;
  const FlowMap alone = map_with(settings, slow);
  Job same({}, slow.results());
  const FlowMap map = map_with(settings, same);
  EXPECT_EQ(map.rays, 0u);
  expect_same(map, alone);
  FlowSettings finer = settings, other = range(0.1, 0.5);
  finer.tolerance = 0.25;
  for (const FlowSettings& each : {finer, other}) {
    Job job({}, slow.results());
    EXPECT_EQ(map_with(each, job).rays, map_of(bench(), each).rays);
  }
}

/// What no light does would be an index, or a place, beyond all memory.
TEST(KeptMap, LandingsThatNoLightHasAreRefused) {
  const FlowSettings settings = single(0.3);
  std::size_t rays = 0;
  const Results kept = shard_of(settings, {}, rays);
  const auto map_of_bytes = [&](const std::string& bytes) {
    Job job({}, {{kept.begin()->first, std::make_shared<const std::string>(bytes)}});
    map_with(settings, job);
  };
  const std::string right = *kept.begin()->second;
  // The key of a vertex has 24 bytes.
  constexpr std::size_t landing = 24, end = landing + 2 * sizeof(float);
  for (const int wrong : {ray_end_count, 255}) {
    std::string bytes = right;
    bytes[end] = static_cast<char>(wrong);
    EXPECT_THROW(map_of_bytes(bytes), DamagedArchive) << wrong;
  }
  std::string bytes = right;
  const float infinite = INFINITY;
  std::memcpy(&bytes[landing], &infinite, sizeof infinite);
  bytes[end] = static_cast<char>(RayEnd::plate);
  EXPECT_THROW(map_of_bytes(bytes), DamagedArchive);
  EXPECT_THROW(map_of_bytes(right + "x"), DamagedArchive);
  EXPECT_NO_THROW(map_of_bytes(right));
}

TEST(RankMap, AndItsLightAreThoseOfOneProcess) {
  for (const FlowSettings& settings : {single(0.3), range(0.1, 0.4)}) {
    const FlowMap alone = map_of(bench(), settings);
    const Caustic light = light_with(alone, nullptr);
    for (const std::size_t count : {std::size_t{1}, std::size_t{3}}) {
      std::vector<FlowMap> maps(count);
      Caustic together;
      run_ranks(count, [&](Ranks& ranks) {
        Job job;
        job.ranks = &ranks;
        FlowSettings mine = settings;
        mine.job = &job;
        maps[ranks.rank()] = map_of(bench(), mine);
        Caustic drawn = light_with(maps[ranks.rank()], &ranks);
        if (is_root(&ranks)) together = std::move(drawn);
      });
      std::size_t rays = 0;
      for (const FlowMap& map : maps) {
        expect_same(map, alone);
        rays += map.rays;
      }
      EXPECT_EQ(rays, alone.rays);  // No ray is traced twice.
      EXPECT_TRUE(together.color.values == light.color.values) << count;
      EXPECT_TRUE(together.irradiance.values == light.irradiance.values) << count;
      EXPECT_TRUE(together.power == light.power) << count;
    }
  }
}

TEST(RankMap, OtherWorkIsRefused) {
  StrangeRanks ranks;
  Job job;
  job.ranks = &ranks;
  FlowSettings settings = single(0.3);
  settings.job = &job;
  EXPECT_THROW(map_of(bench(), settings), DamagedArchive);
  EXPECT_THROW(light_with(map_of(bench(), single(0.3)), &ranks), DamagedArchive);
}

}  // namespace
}  // namespace tensorray
