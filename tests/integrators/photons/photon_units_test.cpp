// Photons that are traced in units, by teams and in several runs: the result is that of one process.

#include <atomic>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "integrators/photons/photon_distribution.h"
#include "integrators/photons/photon_sums.h"
#include "tests/base/team_support.h"
#include "tests/integrators/support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Vector3d;

const std::vector<LightChannel>& unit_channels() {
  static const std::vector<LightChannel> four{{0.1, 650, 0.3}, {0.2, 600, 0.2}, {0.3, 550, 0.1}, {0.4, 450, 0.4}};
  return four;
}

struct SharedBench {
  TensorField field = cube_field(9, linear_tensor);
  Geometry geometry{surfaces()};
  Beam beam = silhouette_beam(field.corners(), {0, 0, -1}, Vector3d::UnitY());

  Surfaces surfaces() const {
    Surfaces surfaces = surfaces_of(field);
    surfaces.plate = plate_across({0, 0, -1}, 1.5);
    surfaces.plate->size = {2.5, 2.5};
    surfaces.plate->resolution = {24, 24};
    return surfaces;
  }
};

const SharedBench& bench() {
  static const SharedBench one;
  return one;
}

/// Light that has seven chunks.
PhotonSettings settings_of(DensityKind kind) {
  PhotonSettings settings;
  settings.bending.step = 2;
  settings.photons = 400000;
  settings.channels_per_photon = 1;
  settings.density.kind = kind;
  settings.keep_photons = true;
  settings.fluence = FluenceKind::bands;
  return settings;
}

PhotonDistribution distribute(const PhotonSettings& settings, Work* work = nullptr, Team* team = nullptr) {
  PhotonSettings all = settings;
  all.work = work;
  all.team = team;
  return distribute_photons(bench().field, bench().geometry, bench().beam, unit_channels(), all, Progress());
}

void expect_same(const PhotonDistribution& a, const PhotonDistribution& b) {
  EXPECT_TRUE(a.irradiance.values == b.irradiance.values);
  EXPECT_EQ(a.ends, b.ends);
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.ray_steps, b.ray_steps);
  EXPECT_EQ(a.tensor_samples, b.tensor_samples);
  ASSERT_EQ(a.photons.size(), b.photons.size());
  EXPECT_TRUE(a.photons.empty() ||
              std::memcmp(a.photons.data(), b.photons.data(), a.photons.size() * sizeof a.photons[0]) == 0);
  ASSERT_EQ(a.fluence.size(), b.fluence.size());
  for (std::size_t grid = 0; grid < a.fluence.size(); ++grid) {
    ASSERT_EQ(a.fluence[grid].blocks.size(), b.fluence[grid].blocks.size());
    for (std::size_t block = 0; block < a.fluence[grid].blocks.size(); ++block) {
      EXPECT_EQ(a.fluence[grid].blocks[block].origin, b.fluence[grid].blocks[block].origin);
      EXPECT_EQ(a.fluence[grid].blocks[block].values, b.fluence[grid].blocks[block].values);
    }
  }
}

const PhotonDistribution& of_one_process(DensityKind kind) {
  static std::map<DensityKind, PhotonDistribution> light;
  const auto found = light.find(kind);
  return found != light.end() ? found->second : light.emplace(kind, distribute(settings_of(kind))).first->second;
}

class PhotonUnits : public testing::TestWithParam<DensityKind> {
 protected:
  const PhotonSettings settings = settings_of(GetParam());
  const PhotonDistribution& alone = of_one_process(GetParam());
};

/// Ends a run of the only unit at its first picture. @return the unit.
WorkUnit interrupted(PhotonSettings settings) {
  Work work;
  work.picture_wanted = true;
  Progress progress;
  settings.work = &work;
  settings.show = [&](const PhotonDistribution&) { progress.cancelled = true; };
  EXPECT_THROW(distribute_photons(bench().field, bench().geometry, bench().beam, unit_channels(), settings, progress),
               Cancelled);
  EXPECT_FALSE(work.units().at(0).done);
  return work.units().at(0);
}

TEST_P(PhotonUnits, OfAllPartsAreThatOfOneProcess) {
  ASSERT_GT(alone.photons.size(), 100000u);
  for (const std::size_t count : {std::size_t{1}, std::size_t{3}, std::size_t{16}}) {
    std::vector<WorkUnit> units;
    for (std::size_t index = 0; index < count; ++index) {
      Work work({index, count});
      work.is_shard = true;
      distribute(settings, &work);
      EXPECT_FALSE(work.wants(index));
      units.push_back(work.units().at(index));
    }
    Work all({}, units);
    expect_same(distribute(settings, &all), alone);
  }
}

TEST_P(PhotonUnits, OfATeamAreThatOfOneProcess) {
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{3}}) {
    std::vector<PhotonDistribution> results(count);
    std::atomic<int> pictures{0};
    run_team(count, [&](Team& team) {
      Work work;
      PhotonSettings mine = settings;
      mine.show = [&](const PhotonDistribution&) { ++pictures; };
      work.picture_wanted = true;
      results[team.index()] = distribute(mine, team.index() == 1 ? nullptr : &work, &team);
    });
    expect_same(results[0], alone);
    EXPECT_EQ(pictures, 1);  // Process 0 has what there is so far, too.
    for (std::size_t index = 1; index < count; ++index) EXPECT_TRUE(results[index].irradiance.values.empty());
  }
}

TEST_P(PhotonUnits, ContinueFromTheirState) {
  const WorkUnit unit = interrupted(settings);
  Work work({}, {unit});
  work.is_shard = true;
  expect_same(distribute(settings, &work), alone);
  EXPECT_TRUE(work.units().at(0).done);
  Work again({}, work.units());
  expect_same(distribute(settings, &again), alone);
  PhotonDistribution of_team;
  run_team(2, [&](Team& team) {
    Work rest({}, has_all(&team) ? std::vector<WorkUnit>{unit} : std::vector<WorkUnit>());
    PhotonDistribution result = distribute(settings, &rest, &team);
    if (has_all(&team)) of_team = std::move(result);
  });
  expect_same(of_team, alone);
}

TEST_P(PhotonUnits, OfPartsByTeamsAreThatOfOneProcess) {
  std::vector<WorkUnit> units(2);
  for (std::size_t index = 0; index < units.size(); ++index)
    run_team(2, [&](Team& team) {
      Work work({index, units.size()});
      distribute(settings, &work, &team);
      if (has_all(&team)) units[index] = work.units().at(index);
    });
  Work all({}, units);
  expect_same(distribute(settings, &all), alone);
}

INSTANTIATE_TEST_SUITE_P(Densities, PhotonUnits,
                         testing::Values(DensityKind::gaussian, DensityKind::histogram,
                                         DensityKind::photon_differential));

TEST(PhotonStates, WantTheOutputsOfTheirBeginning) {
  const PhotonSettings all = settings_of(DensityKind::histogram);
  PhotonSettings fewer = all;
  fewer.keep_photons = false;
  fewer.fluence = FluenceKind::none;
  Work more({}, {interrupted(all)});
  expect_same(distribute(fewer, &more), distribute(fewer));
  Work less({}, {interrupted(fewer)});
  EXPECT_THROW(distribute(all, &less), std::runtime_error);
  PhotonSettings colored = fewer;
  colored.colors.assign(4, {0.5, 0.2, 0.1});  // As many values for a pixel as channels.
  Work plain({}, {interrupted(fewer)});
  EXPECT_THROW(distribute(colored, &plain), std::runtime_error);
  PhotonSettings unbanded = all;
  unbanded.fluence = FluenceKind::all_light;
  Work banded({}, {interrupted(all)});
  EXPECT_THROW(distribute(unbanded, &banded), std::runtime_error);
  Work damaged({}, {{std::make_shared<const std::string>("damaged"), false}});
  EXPECT_THROW(distribute(all, &damaged), std::runtime_error);
}

double sum_of(const Film& film) {
  double sum = 0;
  for (const double value : film.values) sum += value;
  return sum;
}

/// Random positions fill the whole beam at once: the picture so far is as bright as the whole. Rows do not.
TEST(PhotonStates, PicturesSoFarAreAsBrightAsTheirLight) {
  PhotonSettings settings = settings_of(DensityKind::gaussian);
  for (const BeamPattern pattern : {BeamPattern::random, BeamPattern::stratified}) {
    settings.pattern = pattern;
    Work work;
    std::optional<PhotonDistribution> first;
    settings.show = [&](PhotonDistribution so_far) { first = std::move(so_far); };
    work.picture_wanted = true;
    const PhotonDistribution all = distribute(settings, &work);
    ASSERT_TRUE(first);
    const double part = static_cast<double>(first->positions) / static_cast<double>(all.positions);
    EXPECT_LT(part, 0.5);
    EXPECT_GT(first->photons.size(), 0u);
    if (pattern == BeamPattern::random)
      EXPECT_NEAR(sum_of(first->irradiance) / sum_of(all.irradiance), 1, 0.02);
    else
      EXPECT_LT(sum_of(first->irradiance), 0.6 * sum_of(all.irradiance));
  }
}

TEST(PhotonTeam, RefusesOtherWork) {
  StrangeTeam team;
  EXPECT_THROW(distribute(settings_of(DensityKind::histogram), nullptr, &team), std::runtime_error);
}

TEST(PhotonTeam, CollectsInAnyNumberOfMessages) {
  constexpr std::size_t count = 4;
  const auto bytes_of_member = [](std::size_t index) {
    return std::string(11 * (count - index - 1), static_cast<char>('a' + index));
  };
  for (const std::size_t at_once : {std::size_t{1}, std::size_t{7}, std::size_t{11}, std::size_t{100}}) {
    std::vector<std::string> taken;
    run_team(count, [&](Team& team) {
      collect_in_turn(team, bytes_of_member(team.index()), at_once, [&](const std::string& bytes) {
        EXPECT_EQ(team.index(), 0u);
        taken.push_back(bytes);
      });
    });
    ASSERT_EQ(taken.size(), count - 1);
    for (std::size_t index = 1; index < count; ++index) EXPECT_EQ(taken[index - 1], bytes_of_member(index));
  }
}

}  // namespace
}  // namespace tensorray
