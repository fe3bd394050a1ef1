#include "integrators/photon_distribution/photon_distribution.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/tracing/support.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A cube in parallel light along −z, and a plate behind it.
struct Bench {
  TensorField field;
  Geometry geometry;
  Beam beam;

  static Bench make(const TensorFunction& tensor, double plate_size, int resolution, Surfaces extra = {}) {
    TensorField field = cube_field(9, tensor);
    Surfaces surfaces = std::move(extra);
    surfaces.bounds = box_mesh(field.index_bounds(), field.to_world());
    surfaces.plate = plate_across({0, 0, -1}, 1.5);
    surfaces.plate->size = {plate_size, plate_size};
    surfaces.plate->resolution = {resolution, resolution};
    Beam beam = silhouette_beam(field.corners(), {0, 0, -1}, Vector3d::UnitY());
    return {std::move(field), Geometry(std::move(surfaces)), std::move(beam)};
  }
};

std::vector<LightChannel> channels(int count) {
  std::vector<LightChannel> result;
  for (int i = 0; i < count; ++i)
    result.push_back({0.1 + 0.2 * i / std::max(1, count - 1), 650 - 200.0 * i / std::max(1, count - 1), 1.0 / count});
  return result;
}

PhotonDistribution distribute(const Bench& bench, const std::vector<LightChannel>& light, PhotonSettings settings) {
  return distribute_photons(bench.field, bench.geometry, bench.beam, light, settings, Progress());
}

Matrix3d zero(const Vector3d&) { return Matrix3d::Zero(); }

std::uint64_t ended(const EndCounts& counts) {
  std::uint64_t sum = 0;
  for (const std::uint64_t count : counts) sum += count;
  return sum;
}

TEST(PhotonDistribution, EveryRayIsAccountedFor) {
  Surfaces extra;
  extra.obstacles.push_back(
      box_mesh(Eigen::AlignedBox3d(Vector3d(-0.3, -0.3, -0.3), Vector3d(0.2, 0.2, 0.2)), Eigen::Affine3d::Identity()));
  const Bench bench = Bench::make(linear_tensor, 1.5, 32, std::move(extra));
  PhotonSettings settings;
  settings.photons = 3000;
  for (const DensityKind kind : {DensityKind::gaussian, DensityKind::histogram, DensityKind::photon_differential}) {
    settings.density.kind = kind;
    const PhotonDistribution light = distribute(bench, channels(4), settings);
    const Plate& plate = *bench.geometry.surfaces().plate;
    for (int channel = 0; channel < 4; ++channel) {
      const EndCounts& ends = light.ends[channel];
      EXPECT_EQ(light.emitted[channel], light.positions);
      EXPECT_EQ(ended(ends), light.emitted[channel]);
      for (const RayEnd end : {RayEnd::plate, RayEnd::missed, RayEnd::obstacle})
        EXPECT_GT(ends[static_cast<int>(end)], 0u) << to_string(end);
      double on_film = 0;
      for (std::size_t i = 0; i < light.irradiance.plane_size(); ++i)
        on_film += light.irradiance.plane(channel)[i] * plate.pixel_area();
      const double deposited = static_cast<double>(ends[static_cast<int>(RayEnd::plate)]) * light.ray_area;
      EXPECT_NEAR(on_film, deposited, 1e-9 * deposited);
    }
    EXPECT_NEAR(static_cast<double>(light.positions) * light.ray_area, 4, 1e-9);  // The beam's cross section.
  }
}

TEST(PhotonDistribution, IsTheSameOnAnyNumberOfThreadsAndForTheSameSeed) {
  const Bench bench = Bench::make(linear_tensor, 2.5, 48);
  PhotonSettings settings;
  settings.photons = 5000;  // More than one chunk.
  settings.seed = 11;
  settings.channels_per_photon = 2;
  settings.keep_photons = true;
  for (const BeamPattern pattern :
       {BeamPattern::grid, BeamPattern::stratified, BeamPattern::sobol, BeamPattern::random}) {
    settings.pattern = pattern;
    settings.density.kind = pattern == BeamPattern::sobol ? DensityKind::photon_differential : DensityKind::gaussian;
    const auto on_threads = [&](int threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      return distribute(bench, channels(4), settings);
    };
    const PhotonDistribution one = on_threads(1);
    for (const int threads : {2, 8}) {
      const PhotonDistribution many = on_threads(threads);
      EXPECT_EQ(one.irradiance.values, many.irradiance.values);
      EXPECT_EQ(one.ends, many.ends);
      EXPECT_EQ(one.tensor_samples, many.tensor_samples);
      ASSERT_EQ(one.photons.size(), many.photons.size());
      for (std::size_t i = 0; i < one.photons.size(); ++i) ASSERT_EQ(one.photons[i].position, many.photons[i].position);
    }
    PhotonSettings other = settings;
    other.seed = 12;
    EXPECT_NE(one.irradiance.values, distribute(bench, channels(4), other).irradiance.values);
  }
}

TEST(PhotonDistribution, SomeChannelsPerPhotonEstimateTheSame) {
  const Bench bench = Bench::make(linear_tensor, 2.5, 32);
  PhotonSettings settings;
  settings.photons = 40000;
  settings.density.tau = 3;
  const Film all = distribute(bench, channels(8), settings).irradiance;
  settings.channels_per_photon = 2;
  const PhotonDistribution some = distribute(bench, channels(8), settings);
  EXPECT_EQ(some.positions, 40000u);
  for (int channel = 0; channel < 8; ++channel) {
    EXPECT_NEAR(static_cast<double>(some.emitted[channel]), 10000, 100);
    double difference = 0, sum = 0;
    for (std::size_t i = 0; i < all.plane_size(); ++i) {
      difference += std::abs(all.plane(channel)[i] - some.irradiance.plane(channel)[i]);
      sum += all.plane(channel)[i];
    }
    // A kernel covers 4π τ² = 113 pixels. Each pixel has 10 positions, of which 2/8 count: 1100 rays. Independent rays
    // would deviate by 3%; stratified rays deviate less.
    EXPECT_LT(difference / sum, 0.03);
  }
}

TEST(PhotonDistribution, InColourItIsTheChannelsColoured) {
  const Bench bench = Bench::make(linear_tensor, 2.5, 48);
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
  const Bench bench = Bench::make(linear_tensor, 2.5, 32);
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
  const Bench bench = Bench::make(zero, 1.2, 16);
  PhotonSettings settings;
  settings.photons = 20000;
  Progress progress;
  std::uint64_t last = 0, total = 0;
  progress.report = [&](const std::string&, std::uint64_t done, std::uint64_t of) {
    EXPECT_GE(done, last);
    last = done;
    total = of;
  };
  distribute_photons(bench.field, bench.geometry, bench.beam, channels(1), settings, progress);
  EXPECT_EQ(last, total);
  EXPECT_GT(total, 10000u);
  progress.report = [&](const std::string&, std::uint64_t done, std::uint64_t) {
    if (done > 0) progress.cancelled = true;
  };
  EXPECT_THROW(distribute_photons(bench.field, bench.geometry, bench.beam, channels(1), settings, progress), Cancelled);
}

}  // namespace
}  // namespace tensorray
