// Processes that trace a flow map and draw its light together, here as threads: the result is that of one.

#include "base/process/team.h"

#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "tests/base/team_support.h"
#include "tests/integrators/flow_support.h"

namespace tensorray {
namespace {

using namespace test;

struct Drawn {
  FlowMap map;
  Caustic caustic;
};

Drawn draw(const FlowBench& bench, FlowSettings settings, Team* team) {
  settings.team = team;
  Drawn drawn{trace_flow_map(bench.field, bench.geometry, bench.beam, {}, settings, Progress()), {}};
  std::vector<CausticBand> bands(5);
  for (std::size_t i = 0; i < bands.size(); ++i) {
    bands[i].width = settings.range ? static_cast<double>(drawn.map.wavelengths - 1) / 5 : 0;
    bands[i].sample = (static_cast<double>(i) + 0.5) * bands[i].width;
    bands[i].channel = i;
    bands[i].color = {0.2, 0.3 * static_cast<double>(i), 1};
  }
  drawn.caustic = draw_caustic(drawn.map, bench.plate(), bands, {5, true, usual_step, team}, Progress());
  return drawn;
}

void expect_same_map(const FlowMap& a, const FlowMap& b) {
  ASSERT_EQ(a.starts.size(), b.starts.size());
  EXPECT_TRUE(a.starts == b.starts);
  EXPECT_TRUE(a.ends == b.ends);
  EXPECT_TRUE(a.lengths == b.lengths);
  for (std::size_t i = 0; i < a.landings.size(); ++i)
    if (a.ends[i] == RayEnd::plate) {
      ASSERT_TRUE(a.landings[i] == b.landings[i]) << i;
    }
  EXPECT_EQ(a.triangles.size(), b.triangles.size());
  EXPECT_EQ(a.is_complete, b.is_complete);
}

TEST(Team, HasTheMapAndTheLightOfOneProcess) {
  const FlowBench bench = make_bench(lens, plate_at(4, 2.4, 48));
  for (const FlowSettings& settings : {single(0.3), range(0.1, 0.4)}) {
    const Drawn alone = draw(bench, settings, nullptr);
    for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{3}}) {
      std::vector<std::optional<Drawn>> drawn(count);
      const std::size_t bytes =
          run_team(count, [&](Team& team) { drawn[team.index()] = draw(bench, settings, &team); });
      std::size_t rays = 0;
      for (const auto& each : drawn) {
        expect_same_map(each->map, alone.map);
        rays += each->map.rays;
        EXPECT_LT(each->map.rays, 1.2 * static_cast<double>(alone.map.rays) / static_cast<double>(count));
      }
      EXPECT_EQ(rays, alone.map.rays);  // No ray is traced twice.
      EXPECT_TRUE(drawn[0]->caustic.color.values == alone.caustic.color.values) << count;
      EXPECT_TRUE(drawn[0]->caustic.irradiance.values == alone.caustic.irradiance.values) << count;
      EXPECT_TRUE(drawn[0]->caustic.power == alone.caustic.power) << count;
      // A vertex crosses once, and the sums of the plate once for each pass.
      const std::size_t vertices = alone.map.starts.size() * (9 * alone.map.wavelengths + 4 * 5);
      constexpr std::size_t passes = 3, sums = 8 * 4 * (48 + 3) * 48;
      EXPECT_LE(bytes, vertices + count * passes * (sums + 5 * 64) + 100);
    }
  }
}

TEST(Team, PartsCrossInAnyNumberOfMessages) {
  constexpr std::size_t count = 3, parts = 11;
  for (const std::size_t at_once : {std::size_t{1}, std::size_t{2}, std::size_t{4}, parts, 5 * parts}) {
    std::vector<std::vector<std::size_t>> exchanged(count), collected(count);
    run_team(count, [&](Team& team) {
      const std::size_t index = team.index();
      std::vector<std::size_t> mine(parts);
      for (std::size_t part = 0; part < parts; ++part) mine[part] = does_part(&team, part) ? part + 1 : 0;
      exchanged[index] = collected[index] = mine;
      const auto copy_to = [](std::vector<std::size_t>& values) {
        return [to = values.data()](std::size_t part, PartBytes& bytes) { bytes.copy(to + part, sizeof *to); };
      };
      exchange_parts(team, parts, at_once, copy_to(exchanged[index]));
      collect_parts(team, parts, at_once, copy_to(collected[index]));
    });
    for (std::size_t part = 0; part < parts; ++part) {
      for (std::size_t index = 0; index < count; ++index) EXPECT_EQ(exchanged[index][part], part + 1) << at_once;
      EXPECT_EQ(collected[0][part], part + 1) << at_once;
      EXPECT_EQ(collected[1][part], part % count == 1 ? part + 1 : 0) << at_once;
    }
  }
}

TEST(Team, RefusesPartsOfOtherWork) {
  const FlowBench bench = make_bench(lens, plate_at(4, 2.4, 48));
  const FlowMap map = map_of(bench, single(0.3));
  StrangeTeam team;
  FlowSettings settings = single(0.3);
  settings.team = &team;
  EXPECT_THROW(map_of(bench, settings), std::runtime_error);
  EXPECT_THROW(draw_caustic(map, bench.plate(), {CausticBand{}}, {1, true, usual_step, &team}, Progress()),
               std::runtime_error);
}

}  // namespace
}  // namespace tensorray
