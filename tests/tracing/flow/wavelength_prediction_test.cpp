// Landings at the samples that are not traced.

#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "tracing/flow/wavelength_tracer.h"

namespace tensorray {
namespace {

using Eigen::Vector2f;

/// A map of vertices on a line; their light moves with the sample t, from 0 to 1, as `landing` says.
FlowMap small_map(const std::vector<double>& vertices, const std::function<Vector2f(double, double)>& landing) {
  FlowMap map;
  map.wavelengths = range_samples;
  for (const double x : vertices)
    for (std::size_t sample = 0; sample < range_samples; ++sample) {
      map.landings.push_back(landing(x, static_cast<double>(sample) / (range_samples - 1)));
      map.ends.push_back(RayEnd::plate);
    }
  return map;
}

/// Forgets what is not traced of the last of three vertices, predicts it, and returns the greatest error; -1 if it is
/// not predicted.
double error_of(FlowMap map, const Parents& parents, std::size_t step, float tolerance) {
  const FlowMap exact = map;
  const std::size_t first = 2 * range_samples;
  for (std::size_t sample = 0; sample < range_samples; ++sample) {
    if (sample % step == 0) continue;
    map.landings[first + sample].setConstant(std::nanf(""));
    map.ends[first + sample] = RayEnd::missed;
  }
  if (!WavelengthPrediction(map, 2, parents, {100, 100}).predict(step, tolerance)) return -1;
  float greatest = 0;
  for (std::size_t sample = 0; sample < range_samples; ++sample) {
    EXPECT_EQ(map.ends[first + sample], RayEnd::plate);
    greatest = std::max(greatest, (map.landings[first + sample] - exact.landings[first + sample]).norm());
  }
  return greatest;
}

const Parents both{{0, 1}, 2};

Vector2f smooth(double x, double t) {
  return Vector2f(static_cast<float>(40 + 3 * x + 10 * std::sin(2 * t + 0.2 * x)), static_cast<float>(50 - 20 * t * t));
}

TEST(WavelengthPrediction, CubicsAreExact) {
  const FlowMap map = small_map({0, 1, 0.5}, [](double x, double t) {
    return Vector2f(static_cast<float>(40 + x + 10 * t * t * t), static_cast<float>(50 - 20 * t * t));
  });
  // Five samples: the second one deviates from a parabola by 10 · 3/64 pixels.
  EXPECT_EQ(error_of(map, {}, 8, 0.468f), -1);
  EXPECT_NEAR(error_of(map, {}, 8, 0.47f), 0, 1e-5);
}

/// The error of a cubic through samples at a distance h is at most 1/24 h⁴ times the fourth derivative, here 160: it
/// falls to a sixteenth with half the distance.
TEST(WavelengthPrediction, IsOfFourthOrder) {
  const FlowMap map = small_map({0, 1, 0.5}, smooth);
  const double coarse = error_of(map, {}, 8, 10), fine = error_of(map, {}, 4, 10);
  EXPECT_LT(coarse, 160.0 / 24 * std::pow(0.25, 4));
  EXPECT_GT(coarse, 1e-3);
  EXPECT_NEAR(coarse / fine, 16, 5);
}

/// What the polynomials miss is the same of neighbours, to second order in their distance.
TEST(WavelengthPrediction, ParentsLeaveOnlyWhatDiffers) {
  const double alone = error_of(small_map({0, 1, 0.5}, smooth), {}, 8, 10);
  const FlowMap far = small_map({0, 1, 0.5}, smooth), near = small_map({0, 0.5, 0.25}, smooth);
  EXPECT_LT(error_of(far, both, 8, 10), alone / 50);
  EXPECT_NEAR(error_of(far, both, 16, 10) / error_of(near, both, 16, 10), 4, 0.5);
}

TEST(WavelengthPrediction, ThreeSamplesNeedParentsThatAgree) {
  const FlowMap map = small_map({0, 1, 0.5}, smooth);
  EXPECT_EQ(error_of(map, {}, 16, 10), -1);
  EXPECT_GE(error_of(map, both, 16, 0.1f), 0);
  EXPECT_LT(error_of(map, both, 16, 0.1f), 0.1);
  const FlowMap apart = small_map({0, 100, 50}, smooth);  // A parent of another phase.
  EXPECT_EQ(error_of(apart, both, 16, 0.1f), -1);
}

/// Light that leaves by another face from sample 12 on.
TEST(WavelengthPrediction, AKinkNeedsAllSamplesOnlyWhereItIs) {
  FlowMap map = small_map({0, 1, 0.5}, [](double x, double t) {
    return Vector2f(static_cast<float>(40 + x + 10 * std::max(t - 0.35, 0.0)), static_cast<float>(50 * t));
  });
  WavelengthPrediction prediction(map, 2, {}, {100, 100});
  for (const std::size_t step : {8, 4, 2}) EXPECT_FALSE(prediction.predict(step, 0.02f)) << step;
  for (const std::size_t sample : {10, 11, 14}) EXPECT_TRUE(prediction.is_open(sample)) << sample;
  for (const std::size_t sample : {3, 18, 26, 31}) EXPECT_FALSE(prediction.is_open(sample)) << sample;
  EXPECT_TRUE(prediction.predict(1, 0.02f));
}

/// Light of a parent that does not land says nothing about others.
TEST(WavelengthPrediction, ParentsWhoseLightEndsElsewhereAreLeftOut) {
  FlowMap map = small_map({0, 1, 0.5}, smooth);
  map.ends[5] = RayEnd::obstacle;
  EXPECT_FALSE(WavelengthPrediction(map, 2, both, {100, 100}).parents_agree(16, 10));
  EXPECT_EQ(error_of(map, both, 8, 10), error_of(map, {}, 8, 10));
}

}  // namespace
}  // namespace tensorray
