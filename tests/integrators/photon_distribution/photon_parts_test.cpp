// Photons that are traced in parts, by ranks and in several runs: the result is that of one process.

#include <atomic>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "integrators/photon_distribution/photon_chunks.h"
#include "integrators/photon_distribution/photon_distribution.h"
#include "tests/base/rank_support.h"
#include "tests/tracing/support.h"

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

PhotonDistribution distribute(PhotonSettings settings, Job* job = nullptr, const Progress& progress = {}) {
  settings.job = job;
  return distribute_photons(bench().field, bench().geometry, bench().beam, unit_channels(), settings, progress);
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

class PhotonParts : public testing::TestWithParam<DensityKind> {
 protected:
  const PhotonSettings settings = settings_of(GetParam());
  const PhotonDistribution& alone = of_one_process(GetParam());
};

/// What a run keeps that is ended at its first picture.
Results interrupted(PhotonSettings settings) {
  Job job;
  job.picture_wanted = true;
  Progress progress;
  settings.show = [&](const PhotonDistribution&) { progress.cancelled = true; };
  EXPECT_THROW(distribute(settings, &job, progress), Cancelled);
  EXPECT_EQ(job.results().size(), 1u);
  return job.results();
}

TEST_P(PhotonParts, OfShardsAreThatOfOneProcess) {
  ASSERT_GT(alone.photons.size(), 100000u);
  Results all;
  for (std::size_t index = 0; index < 3; ++index)
    run_ranks(index == 1 ? 2 : 1, [&](Ranks& ranks) {
      Job job({index, 3});
      job.is_shard = true;
      job.ranks = &ranks;
      distribute(settings, &job);
      const Results some = job.results();
      if (is_root(&ranks)) all.insert(some.begin(), some.end());
    });
  Job merged({0, 3}, all);
  expect_same(distribute(settings, &merged), alone);
}

/// Also what continues.
TEST_P(PhotonParts, OfRanksAreThatOfOneProcess) {
  const Results half = interrupted(settings);
  for (const Results& earlier : {Results(), half}) {
    std::vector<PhotonDistribution> results(3);
    std::atomic<int> pictures{0};
    run_ranks(results.size(), [&](Ranks& ranks) {
      Job job({}, earlier);
      job.ranks = &ranks;
      job.picture_wanted = earlier.empty();
      PhotonSettings mine = settings;
      mine.show = [&](const PhotonDistribution&) { ++pictures; };
      results[ranks.rank()] = distribute(mine, &job);
    });
    expect_same(results[0], alone);
    EXPECT_EQ(pictures, earlier.empty() ? 1 : 0);  // The root has what there is so far.
    EXPECT_TRUE(results[1].irradiance.values.empty());
  }
  Job resumed({}, half);
  expect_same(distribute(settings, &resumed), alone);
}

INSTANTIATE_TEST_SUITE_P(Densities, PhotonParts,
                         testing::Values(DensityKind::gaussian, DensityKind::histogram,
                                         DensityKind::photon_differential));

TEST(KeptPhotons, WantTheOutputsOfTheirBeginning) {
  const PhotonSettings all = settings_of(DensityKind::histogram);
  PhotonSettings fewer = all, unbanded = all;
  fewer.keep_photons = false;
  fewer.fluence = FluenceKind::none;
  PhotonSettings colored = fewer;
  colored.colors.assign(4, {0.5, 0.2, 0.1});  // As many values for a pixel as channels.
  unbanded.fluence = FluenceKind::all_light;
  const Results of_all = interrupted(all), of_fewer = interrupted(fewer);
  Job more({}, of_all);
  expect_same(distribute(fewer, &more), distribute(fewer));
  const auto expect_refused = [](const PhotonSettings& settings, const Results& results) {
    Job job({}, results);
    EXPECT_THROW(distribute(settings, &job), DamagedArchive);
  };
  expect_refused(all, of_fewer);
  expect_refused(colored, of_fewer);
  expect_refused(unbanded, of_all);
  expect_refused(all, {{of_all.begin()->first, std::make_shared<const std::string>("damaged")}});
}

double sum_of(const Film& film) {
  double sum = 0;
  for (const double value : film.values) sum += value;
  return sum;
}

/// Random positions fill the whole beam at once: the picture so far is as bright as the whole. Rows do not.
TEST(KeptPhotons, PicturesSoFarAreAsBrightAsTheirLight) {
  PhotonSettings settings = settings_of(DensityKind::gaussian);
  for (const BeamPattern pattern : {BeamPattern::random, BeamPattern::stratified}) {
    settings.pattern = pattern;
    Job job;
    std::optional<PhotonDistribution> first;
    settings.show = [&](PhotonDistribution so_far) { first = std::move(so_far); };
    job.picture_wanted = true;
    const PhotonDistribution all = distribute(settings, &job);
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

TEST(KeptPhotons, OfOtherWorkAreRefused) {
  StrangeRanks ranks;
  Job job;
  job.ranks = &ranks;
  EXPECT_THROW(distribute(settings_of(DensityKind::histogram), &job), DamagedArchive);
}

}  // namespace
}  // namespace tensorray
