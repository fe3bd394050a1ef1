#include "tracing/flow/wavelength_tracer.h"

#include <functional>

#include "base/constants.h"
#include "tests/names.h"

namespace tensorray {
namespace {

using Eigen::Vector2f;

/// A map of one vertex whose light moves with the sample t, from 0 to 1, as `landing` says.
FlowMap small_map(const std::function<Vector2f(float)>& landing) {
  FlowMap map;
  map.wavelengths = range_samples;
  for (std::size_t sample = 0; sample < range_samples; ++sample)
    map.landings.push_back(landing(static_cast<float>(sample) / (range_samples - 1)));
  map.ends.assign(range_samples, RayEnd::plate);
  return map;
}

struct Predicted {
  std::vector<int> traced;
  float error = 0;  // The greatest of the others.
  std::vector<RayEnd> ends;
};

/// Predicts what is not wanted.
Predicted predict(FlowMap map, float tolerance) {
  const FlowMap exact = map;
  std::fill(map.landings.begin(), map.landings.end(), Vector2f(std::nanf(""), 0));
  WavelengthPrediction prediction(map, 0, {100, 100}, tolerance);
  Predicted result;
  for (; !prediction.wanted().empty(); prediction.go_on())
    for (const int sample : prediction.wanted()) {
      result.traced.push_back(sample);
      map.landings[sample] = exact.landings[sample];
      map.ends[sample] = exact.ends[sample];
    }
  result.ends = map.ends;
  for (std::size_t i = 0; i < range_samples; ++i) {
    if (exact.ends[i] != RayEnd::plate) continue;
    EXPECT_TRUE(map.landings[i].allFinite()) << i;
    result.error = std::max(result.error, (map.landings[i] - exact.landings[i]).norm());
  }
  return result;
}

TEST(WavelengthPrediction, CubicsAreExact) {
  const Predicted all =
      predict(small_map([](float t) { return Vector2f(40 + 10 * t * t * t, 50 - 20 * t * t); }), 1e-4f);
  EXPECT_EQ(all.traced.size(), 5);
  EXPECT_LT(all.error, 1e-4);
}

/// Of t⁴, a cubic through samples at a distance h misses (t − t₀)(t − t₁)(t − t₂)(t − t₃), at most h⁴.
TEST(WavelengthPrediction, IsOfFourthOrder) {
  for (const float speed : {1.0f, 0.5f}) {
    const Predicted all =
        predict(small_map([&](float t) { return Vector2f(100 * std::pow(speed * t, 4.0f), 50); }), 10);
    EXPECT_EQ(all.traced.size(), 5);
    EXPECT_NEAR(all.error, 100 * std::pow(speed / 4, 4), 1e-3) << speed;
  }
}

/// A middle that is predicted badly has its halves divided; what is predicted then is far better than the middle was.
TEST(WavelengthPrediction, IsAsGoodAsTheToleranceAsks) {
  const FlowMap map = small_map([](float t) { return Vector2f(50 + 10 * std::sin(5 * t), 50 * t); });
  std::size_t before = 0;
  for (const float tolerance : {3.0f, 0.3f, 0.03f}) {
    const Predicted all = predict(map, tolerance);
    EXPECT_LT(all.error, tolerance / 2) << tolerance;
    EXPECT_GT(all.traced.size(), before) << tolerance;
    before = all.traced.size();
  }
  EXPECT_LT(before, range_samples);
}

/// A wave of ten samples. A cubic through every second one misses 0.08 of its amplitude between them: so these are
/// enough, unless a cubic through every fourth one misses four tolerances.
TEST(WavelengthPrediction, EverySecondSampleIsEnoughForSmallWaves) {
  for (const auto& [amplitude, traced] : {std::pair(0.5f, 17), std::pair(5.0f, 33)}) {
    const auto wave = [&](float t) { return amplitude * static_cast<float>(std::cos(pi * 6.4 * t)); };
    const Predicted all = predict(small_map([&](float t) { return Vector2f(50 + wave(t), 50 * t); }), 0.1f);
    EXPECT_EQ(all.traced.size(), traced);
    EXPECT_LT(all.error, 0.1f / 2);
  }
}

/// Light that leaves by another face from sample 12 on.
TEST(WavelengthPrediction, AKinkNeedsAllSamplesOnlyWhereItIs) {
  const Predicted all =
      predict(small_map([](float t) { return Vector2f(40 + 50 * std::max(t - 0.35f, 0.0f), 50 * t); }), 0.02f);
  EXPECT_LT(all.error, 0.02);
  for (const int sample : {10, 11, 12, 13}) EXPECT_EQ(std::count(all.traced.begin(), all.traced.end(), sample), 1);
  for (const int sample : {3, 26, 31}) EXPECT_EQ(std::count(all.traced.begin(), all.traced.end(), sample), 0);
}

/// A body stops light from one sample on, or up to it.
TEST(WavelengthPrediction, TheEndOfLightIsBisected) {
  for (const std::size_t end : {1, 13, 20, 31})
    for (const bool is_after : {false, true}) {
      FlowMap map = small_map([](float t) { return Vector2f(40, 50 * t); });
      for (std::size_t sample = 0; sample < range_samples; ++sample)
        if ((sample >= end) == is_after) map.ends[sample] = RayEnd::obstacle;
      const Predicted all = predict(map, 0.01f);
      EXPECT_EQ(all.ends, map.ends) << end << is_after;
      EXPECT_LT(all.error, 1e-4) << end << is_after;
      EXPECT_LE(all.traced.size(), 10) << end << is_after;  // 5, and 3 of the gap; one landed sample needs another.
    }
}

}  // namespace
}  // namespace tensorray
