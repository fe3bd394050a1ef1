#include "integrators/photon_distribution/photon_distribution.h"

#include <memory>
#include <optional>

#include "integrators/photon_distribution/photon_chunks.h"
#include "tests/base/rank_support.h"
#include "tests/tracing/flow_support.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

/// The middle of the plate is 1.5 from that of the volume.
LightBench make_bench(const TensorFunction& tensor, double plate_size, int resolution, Surfaces extra = {}) {
  return test::make_bench(tensor, plate_at(1.5, plate_size, resolution), std::move(extra), 9);
}

std::vector<LightChannel> channels(int count) {
  std::vector<LightChannel> result;
  for (int i = 0; i < count; ++i)
    result.push_back({0.1 + 0.2 * i / std::max(1, count - 1), 650 - 200.0 * i / std::max(1, count - 1), 1.0 / count});
  return result;
}

PhotonDistribution distribute(const LightBench& bench, const std::vector<LightChannel>& light, PhotonSettings settings,
                              const Progress& progress = Progress()) {
  return distribute_photons(bench.field, bench.geometry, bench.beam, light, settings, progress);
}

TEST(PhotonDistribution, EveryRayIsAccountedFor) {
  const LightBench bench = make_bench(linear_tensor, 1.5, 32, obstacle_between({-0.3, -0.3, -0.3}, {0.2, 0.2, 0.2}));
  PhotonSettings settings;
  settings.photons = 3000;
  for (const DensityKind kind : {DensityKind::gaussian, DensityKind::histogram, DensityKind::photon_differential}) {
    settings.density.kind = kind;
    const PhotonDistribution light = distribute(bench, channels(4), settings);
    for (int channel = 0; channel < 4; ++channel) {
      const EndCounts& ends = light.ends[channel];
      EXPECT_EQ(light.emitted[channel], light.positions);
      EXPECT_EQ(std::accumulate(ends.begin(), ends.end(), std::uint64_t{0}), light.emitted[channel]);
      for (const RayEnd end : {RayEnd::plate, RayEnd::missed, RayEnd::obstacle})
        EXPECT_GT(ends[static_cast<int>(end)], 0u) << to_string(end);
      const double* const film = light.irradiance.plane(channel);
      const double on_film =
          std::accumulate(film, film + light.irradiance.plane_size(), 0.0) * bench.plate().pixel_area();
      const double deposited = static_cast<double>(ends[static_cast<int>(RayEnd::plate)]) * light.ray_area;
      EXPECT_NEAR(on_film, deposited, 1e-9 * deposited);
    }
    EXPECT_NEAR(static_cast<double>(light.positions) * light.ray_area, 4, 1e-9);  // The beam's cross section.
  }
}

TEST(PhotonDistribution, SomeChannelsPerPhotonEstimateTheSame) {
  const LightBench bench = make_bench(linear_tensor, 2.5, 32);
  PhotonSettings settings;
  settings.photons = 40000;
  settings.density.tau = 3;
  const Film all = distribute(bench, channels(8), settings).irradiance;
  settings.channels_per_photon = 2;
  const PhotonDistribution some = distribute(bench, channels(8), settings);
  EXPECT_EQ(some.positions, 40000u);
  for (int channel = 0; channel < 8; ++channel) {
    EXPECT_NEAR(static_cast<double>(some.emitted[channel]), 10000, 100);
    const auto pixels = static_cast<Eigen::Index>(all.plane_size());
    const Eigen::Map<const Eigen::ArrayXd> of_all(all.plane(channel), pixels),
        of_some(some.irradiance.plane(channel), pixels);
    // A kernel covers 4π τ² = 113 pixels. Each pixel has 10 positions, of which 2/8 count: 1100 rays. Independent rays
    // would deviate by 3%; stratified rays deviate less.
    EXPECT_LT((of_all - of_some).abs().sum() / of_all.sum(), 0.03);
  }
}

TEST(PhotonDistribution, InColourItIsTheChannelsColoured) {
  const LightBench bench = make_bench(linear_tensor, 2.5, 48);
  PhotonSettings settings;
  settings.photons = 5000;
  settings.channels_per_photon = 4;
  const PhotonDistribution bands = distribute(bench, channels(8), settings);
  for (int k = 0; k < 8; ++k) settings.colors.emplace_back(0.1 * k, 1 - 0.2 * k, 0.5);
  const PhotonDistribution rgb = distribute(bench, channels(8), settings);
  EXPECT_EQ(rgb.ends, bands.ends);
  EXPECT_EQ(rgb.ray_steps, bands.ray_steps);
  ASSERT_EQ(rgb.irradiance.channels, 3);
  for (int c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < rgb.irradiance.plane_size(); ++i) {
      double sum = 0;
      for (int k = 0; k < 8; ++k) sum += settings.colors[k][c] * bands.irradiance.plane(k)[i];
      ASSERT_NEAR(rgb.irradiance.plane(c)[i], sum, 1e-7);  // Quanta of 2^-25 of hundreds of photons.
    }
  settings.colors.pop_back();
  EXPECT_THROW(distribute(bench, channels(8), settings), std::invalid_argument);
}

TEST(PhotonDistribution, KeepsPhotonsIfAsked) {
  const LightBench bench = make_bench(linear_tensor, 2.5, 32);
  PhotonSettings settings;
  settings.photons = 300;
  settings.keep_photons = true;
  const PhotonDistribution light = distribute(bench, channels(2), settings);
  std::uint64_t deposited = 0;
  for (const EndCounts& ends : light.ends) deposited += ends[static_cast<int>(RayEnd::plate)];
  ASSERT_EQ(light.photons.size(), deposited);
  for (const PlatePhoton& photon : light.photons) {
    EXPECT_NEAR(photon.position.z(), -1.5, 1e-6);
    EXPECT_NEAR(photon.direction.norm(), 1, 1e-6);
    EXPECT_GT(photon.origin.z(), 1);
    EXPECT_NEAR(photon.power, 0.5 * light.ray_area, 1e-6);
    const bool first = photon.wavelength == 650;
    EXPECT_TRUE(first || photon.wavelength == 450);
    RayBatch again;
    again.add(photon.origin.cast<double>(), {0, 0, -1}, first ? 0.1 : 0.3);
    trace(bench.field, bench.geometry, {}, again);
    EXPECT_LT((again.position[0] - photon.position.cast<double>()).norm(), 1e-5);
  }
}

TEST(PhotonDistribution, StopsWhenCancelledAndReportsProgress) {
  const LightBench bench = make_bench(zero, 1.2, 16);
  PhotonSettings settings;
  settings.photons = 20000;
  Progress progress;
  std::uint64_t last = 0, total = 0;
  progress.report = [&](const std::string&, std::uint64_t done, std::uint64_t of) {
    EXPECT_GE(done, last);
    last = done;
    total = of;
  };
  distribute(bench, channels(1), settings, progress);
  EXPECT_EQ(last, total);
  EXPECT_GT(total, 10000u);
  progress.report = [&](const std::string&, std::uint64_t done, std::uint64_t) {
    if (done > 0) progress.cancelled = true;
  };
  EXPECT_THROW(distribute(bench, channels(1), settings, progress), Cancelled);
}

// Photons that are traced in parts, by ranks and in several runs: the result is that of one process.

/// Light that has four chunks.
PhotonSettings photon_settings(DensityKind kind) {
  PhotonSettings settings;
  settings.bending.step = 2;
  settings.photons = 200000;
  settings.channels_per_photon = 1;
  settings.density.kind = kind;
  settings.keep_photons = true;
  settings.fluence = FluenceKind::bands;
  return settings;
}

PhotonDistribution distribute(PhotonSettings settings, Job* job = nullptr, const Progress& progress = {}) {
  static const LightBench bench = make_bench(linear_tensor, 2.5, 24);
  const std::vector<LightChannel> four{{0.1, 650, 0.3}, {0.2, 600, 0.2}, {0.3, 550, 0.1}, {0.4, 450, 0.4}};
  settings.job = job;
  return distribute(bench, four, settings, progress);
}

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

TEST(KeptPhotons, WantTheOutputsOfTheirBeginning) {
  const PhotonSettings all = photon_settings(DensityKind::histogram);
  PhotonSettings fewer = all, unbanded = all;
  fewer.keep_photons = false;
  fewer.fluence = FluenceKind::none;
  PhotonSettings colored = fewer;
  colored.colors.assign(4, {0.5, 0.2, 0.1});  // As many values for a pixel as channels.
  unbanded.fluence = FluenceKind::all_light;
  const Results of_all = interrupted(all), of_fewer = interrupted(fewer);
  Job more({}, of_all);
  const PhotonDistribution continued = distribute(fewer, &more), anew = distribute(fewer);
  EXPECT_TRUE(continued.irradiance.values == anew.irradiance.values);
  EXPECT_EQ(continued.ends, anew.ends);
  EXPECT_EQ(continued.positions, anew.positions);
  EXPECT_EQ(continued.ray_steps, anew.ray_steps);
  EXPECT_EQ(continued.tensor_samples, anew.tensor_samples);
  EXPECT_TRUE(continued.photons.empty() && continued.fluence.empty());
  const auto expect_refused = [](const PhotonSettings& settings, const Results& results) {
    Job job({}, results);
    EXPECT_THROW(distribute(settings, &job), DamagedArchive);
  };
  expect_refused(all, of_fewer);
  expect_refused(colored, of_fewer);
  expect_refused(unbanded, of_all);
  expect_refused(all, {{of_all.begin()->first, std::make_shared<const std::string>("damaged")}});
}

/// Random positions fill the whole beam at once: the picture so far is as bright as the whole. Rows do not.
TEST(KeptPhotons, PicturesSoFarAreAsBrightAsTheirLight) {
  PhotonSettings settings = photon_settings(DensityKind::gaussian);
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
      EXPECT_NEAR(test::sum(first->irradiance.values) / test::sum(all.irradiance.values), 1, 0.02);
    else
      EXPECT_LT(test::sum(first->irradiance.values), 0.6 * test::sum(all.irradiance.values));
  }
}

TEST(KeptPhotons, OfOtherWorkAreRefused) {
  StrangeRanks ranks;
  Job job;
  job.ranks = &ranks;
  EXPECT_THROW(distribute(photon_settings(DensityKind::histogram), &job), DamagedArchive);
}

}  // namespace
}  // namespace tensorray
