// Flow maps whose vertices were traced in earlier runs or by shards: the same bits, and hardly a ray more.

#include "base/process/kept_results.h"

#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "base/process/progress.h"
#include "base/process/team.h"
#include "tests/integrators/flow_support.h"

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

/// Maps drawn as light, and maps that say what is seen, whose vertices at the border are predicted, too.
std::vector<FlowSettings> all_settings() {
  std::vector<FlowSettings> all{single(0.3), range(0.1, 0.4), range(0.1, 0.4)};
  all.back().silhouette = false;
  return all;
}

/// The light of a map, which depends on all of it.
std::vector<double> light_of(const FlowMap& map) {
  std::vector<CausticBand> bands(3);
  for (std::size_t i = 0; i < bands.size(); ++i) {
    bands[i].width = static_cast<double>(map.wavelengths - 1) / 3;
    bands[i].sample = (static_cast<double>(i) + 0.5) * bands[i].width;
  }
  return caustic_of(bench(), map, bands).color.values;
}

FlowMap map_with(FlowSettings settings, Work& work, bool done = false) {
  KeptResults kept(&work, nullptr);
  settings.kept = &kept;
  FlowMap map = map_of(bench(), settings);
  if (done) kept.keep(true);
  return map;
}

/// The units that the shards of a map give.
std::vector<WorkUnit> shards_of(const FlowSettings& settings, std::size_t count, std::size_t& rays) {
  std::vector<WorkUnit> all(count);
  for (std::size_t index = 0; index < count; ++index) {
    Work work({index, count});
    work.is_shard = true;
    rays += map_with(settings, work, true).rays;
    EXPECT_TRUE(work.units()[index].done);
    all[index] = work.units()[index];
  }
  return all;
}

TEST(KeptResults, OfShardsGiveTheMapOfOneRun) {
  for (const FlowSettings& settings : all_settings()) {
    const FlowMap alone = map_of(bench(), settings);
    for (const std::size_t count : {1, 2, 3, 16}) {
      std::size_t rays = 0;
      Work merged({}, shards_of(settings, count, rays));
      const FlowMap map = map_with(settings, merged);
      EXPECT_TRUE(map.starts == alone.starts) << count;
      EXPECT_TRUE(map.ends == alone.ends) << count;
      EXPECT_TRUE(map.lengths == alone.lengths) << count;
      EXPECT_TRUE(light_of(map) == light_of(alone)) << count;
      // Vertices on the borders of blocks are traced by both shards. In a range, the parents of a vertex at the
      // silhouette may be those of the other shard's quad.
      EXPECT_LE(map.rays, alone.rays / 100) << count;
      EXPECT_LE(rays, alone.rays * 3 / 2) << count;
    }
  }
}

TEST(KeptResults, OfAnInterruptedRunAreNotTracedAgain) {
  const FlowSettings settings = range(0.1, 0.4);
  const FlowMap alone = map_of(bench(), settings);
  for (const std::uint64_t stop : {1, 3, 6}) {
    Work work;
    Progress progress;
    std::uint64_t reports = 0;
    progress.report = [&](const std::string&, std::uint64_t, std::uint64_t) {
      if (++reports >= 4 * stop) progress.cancelled = true;
    };
    KeptResults kept(&work, nullptr);
    FlowSettings interrupted = settings;
    interrupted.kept = &kept;
    ASSERT_THROW(trace_flow_map(bench().field, bench().geometry, bench().beam, {}, interrupted, progress), Cancelled);
    ASSERT_TRUE(work.state(0));
    Work resumed({}, work.units());
    const FlowMap map = map_with(settings, resumed);
    EXPECT_LT(map.rays, alone.rays) << stop;
    EXPECT_TRUE(light_of(map) == light_of(alone)) << stop;
  }
}

TEST(KeptResults, OfAnotherMapAreNotUsed) {
  Work first;
  first.is_shard = true;  // Its landings are kept, whether it takes long or not.
  const FlowSettings settings = range(0.1, 0.4);
  map_with(settings, first, true);
  Work same({}, first.units());
  EXPECT_EQ(map_with(settings, same).rays, 0u);
  FlowSettings finer = settings, other = range(0.1, 0.5), numbered = settings;
  finer.tolerance = 0.25;
  numbered.key = 1;
  for (const FlowSettings& each : {finer, other, numbered}) {
    Work work({}, first.units());
    EXPECT_EQ(map_with(each, work).rays, map_of(bench(), each).rays);
  }
}

TEST(KeptResults, FindsWhatWasKept) {
  Work work;
  const ResultKey a{1, 2, 3}, b{1, 2, 4};
  {
    KeptResults kept(&work, nullptr);
    kept.add(a, "first");
    kept.add(b, "");
    kept.keep(false);
  }
  Work resumed({}, work.units());
  KeptResults kept(&resumed, nullptr);
  EXPECT_EQ(kept.find(a, 5), "first");
  EXPECT_EQ(kept.find(b, 0), "");
  EXPECT_FALSE(kept.find(a, 4));
  EXPECT_FALSE(kept.find({1, 2, 5}, 5));
}

/// A result of any size is made once, by the first run that is long enough.
TEST(KeptResults, AreFoundOrMade) {
  std::vector<int> values;
  int made = 0;
  const auto find_or_make_values = [&](Work& work, std::uint64_t number) {
    KeptResults kept(&work, nullptr);
    values.clear();
    const auto make = [&] {
      values.assign(number, 7);
      ++made;
    };
    const auto copy = [&](PartBytes& bytes) {
      std::size_t count = values.size();
      bytes.copy(&count, sizeof count);
      values.resize(count);
      bytes.copy(values.data(), count * sizeof(int));
    };
    find_or_make(&kept, {number, 0, 0}, make, copy);
    kept.finish();
    EXPECT_EQ(values, std::vector<int>(number, 7));
  };
  Work quick, work;  // Without an interval nothing is kept.
  find_or_make_values(quick, 3);
  find_or_make_values(quick, 3);
  EXPECT_EQ(made, 2);
  EXPECT_EQ(quick.units().front().state, nullptr);
  work.interval = 1e-9;
  find_or_make_values(work, 3);
  find_or_make_values(work, 0);
  EXPECT_EQ(made, 4);
  Work resumed({}, work.units());
  find_or_make_values(resumed, 3);
  find_or_make_values(resumed, 0);
  EXPECT_EQ(made, 4);
  find_or_make_values(resumed, 2);
  EXPECT_EQ(made, 5);
}

/// A run that is cancelled while it makes a result keeps those before it.
TEST(KeptResults, AreKeptWhereTheNextOneIsCancelled) {
  Work work;
  work.interval = 1000;
  KeptResults kept(&work, nullptr);
  kept.add({1, 0, 0}, "first");
  const auto cancel = [] { throw Cancelled(); };
  EXPECT_THROW(find_or_make(&kept, {2, 0, 0}, cancel, [](PartBytes&) {}), Cancelled);
  Work resumed({}, work.units());
  EXPECT_EQ(KeptResults(&resumed, nullptr).find({1, 0, 0}), "first");
}

/// What a long result keeps while it is made is there until all of it is made, and no longer.
TEST(KeptResults, OfPartsAreForgottenWithTheWhole) {
  Work work;
  work.interval = 1e-9;
  KeptResults kept(&work, nullptr);
  kept.add({1, 0, 0}, "before");
  const auto make = [&] {
    kept.add({2, 0, 0}, "a part");
    kept.keep(false);
    Work killed({}, work.units());
    EXPECT_EQ(KeptResults(&killed, nullptr).find({2, 0, 0}), "a part");
  };
  find_or_make(&kept, {3, 0, 0}, make, [](PartBytes&) {});
  kept.finish();
  Work resumed({}, work.units());
  const KeptResults found(&resumed, nullptr);
  EXPECT_EQ(found.find({1, 0, 0}), "before");
  EXPECT_FALSE(found.find({2, 0, 0}));
  EXPECT_EQ(found.find({3, 0, 0}), "");
}

/// Parts that an earlier run has left are forgotten with the result that needs them, and not before.
TEST(KeptResults, OfEarlierPartsAreForgottenWithTheWhole) {
  Work killed;
  {
    KeptResults kept(&killed, nullptr);
    kept.add({1, 0, 0}, "before");
    kept.begin_parts();
    kept.add({2, 0, 0}, "a part");
    kept.add({2, 1, 0}, "another part");
    kept.keep(false);
  }
  Work work({}, killed.units());
  work.interval = 1e-9;
  {
    KeptResults kept(&work, nullptr);
    const auto copy = [](PartBytes&) {};
    find_or_make(
        &kept, {4, 0, 0}, [] {}, copy);
    EXPECT_EQ(kept.find({2, 1, 0}), "another part");
    find_or_make(
        &kept, {3, 0, 0},
        [&] {
          EXPECT_EQ(kept.find({2, 0, 0}), "a part");
        },
        copy);
    EXPECT_FALSE(kept.find({2, 1, 0}));
    EXPECT_EQ(kept.find({1, 0, 0}), "before");
    kept.add({5, 0, 0}, "after");
    kept.finish();
  }
  Work resumed({}, work.units());
  const KeptResults found(&resumed, nullptr);
  EXPECT_EQ(found.find({1, 0, 0}), "before");
  EXPECT_EQ(found.find({5, 0, 0}), "after");
  for (const ResultKey& part : {ResultKey{2, 0, 0}, ResultKey{2, 1, 0}}) EXPECT_FALSE(found.find(part));
  for (const ResultKey& whole : {ResultKey{3, 0, 0}, ResultKey{4, 0, 0}}) EXPECT_TRUE(found.find(whole));
}

/// A count that no bytes follow asks for no memory.
TEST(KeptResults, SaysThatAResultIsDamaged) {
  std::vector<double> values;
  const auto copy = [&](PartBytes& bytes) { bytes.copy_vector(values); };
  const std::uint64_t huge = ~std::uint64_t{0} / 64, two = 2;
  for (const std::uint64_t count : {huge, two}) {
    Work work;
    KeptResults before(&work, nullptr);
    before.add({1, 0, 0}, std::string(reinterpret_cast<const char*>(&count), sizeof count) + std::string(12, 'x'));
    before.keep(true);
    KeptResults kept(&work, nullptr);
    EXPECT_THROW(find_or_make(
                     &kept, {1, 0, 0}, [] {}, copy),
                 std::runtime_error)
        << count;
    EXPECT_TRUE(values.empty()) << count;
  }
}

/// What no light does would be an index, or a place, beyond all memory.
TEST(KeptResults, LandingsThatNoLightHasAreRefused) {
  const FlowSettings settings = single(0.3);
  Work work;
  work.is_shard = true;
  map_with(settings, work, true);
  const std::string kept = *work.state(0);
  // The first result: its key and its size; the landing; how it ends.
  constexpr std::size_t landing = sizeof(ResultKey) + sizeof(std::uint64_t), end = landing + 2 * sizeof(float);
  for (const int wrong : {ray_end_count, 255}) {
    std::string bytes = kept;
    bytes[end] = static_cast<char>(wrong);
    work.keep(0, bytes, true);
    EXPECT_THROW(map_with(settings, work), std::runtime_error) << wrong;
  }
  std::string bytes = kept;
  const float infinite = INFINITY;
  std::memcpy(&bytes[landing], &infinite, sizeof infinite);
  bytes[end] = static_cast<char>(RayEnd::plate);
  work.keep(0, bytes, true);
  EXPECT_THROW(map_with(settings, work), std::runtime_error);
  work.keep(0, kept, true);
  EXPECT_NO_THROW(map_with(settings, work));
}

TEST(KeptResults, SaysThatAUnitIsDamaged) {
  Work work;
  work.begin(1);
  for (const std::string& bytes : {std::string("short"), std::string(32, '\xff')}) {
    work.keep(0, bytes, false);
    EXPECT_THROW(KeptResults(&work, nullptr), std::runtime_error);
  }
}

}  // namespace
}  // namespace tensorray
