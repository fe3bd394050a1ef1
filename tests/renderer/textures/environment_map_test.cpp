#include "renderer/textures/environment_map.h"

#include <numeric>
#include <set>

#include "base/constants.h"
#include "renderer/sampling/random.h"
#include "renderer/sampling/sampling.h"
#include "renderer/textures/test_images.h"
#include "tests/renderer/statistics.h"

namespace tensorray {
namespace {

using testing::FloatEq, testing::FloatNear, testing::Pointwise;

/// A light whose only channel is its only band.
EnvironmentLight grey(int width, int height) {
  EnvironmentLight light;
  light.picture = Image(width, height, {"Y"});
  light.channel_spectra = Eigen::MatrixXf::Identity(1, 1);
  return light;
}

/// A dark, uneven sky in a general orientation: one row and some texels are 0, and one texel is bright.
EnvironmentLight uneven_sky() {
  EnvironmentLight light = grey(16, 9);
  for (int i = 0; i < 16 * 9; ++i) light.picture.pixels[i] = static_cast<float>(random_uniform(1, i, 0));
  for (int y = 3; y < 7; ++y)
    for (int x = 4; x < 9; ++x) *light.picture.pixel(x, y) = 0;
  *light.picture.pixel(12, 2) = 300;
  light.to_world = Eigen::AngleAxisd(1.1, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  return light;
}

float radiance(const EnvironmentMap& map, const Vector3d& direction) {
  std::vector<float> result{0};
  map.add_radiance(direction, result);
  return result[0];
}

TEST(EnvironmentMap, UpIsZAndTheMiddleIsX) {
  // With 8 x 5 texels, centres are at most half a texel from the poles and the axes.
  EnvironmentLight light = grey(8, 5);
  // The second rows from the poles do not matter. In the middle: the edges, the left, the middle, the right.
  light.picture.pixels = {1,  1,  1,  1,  1,  1,  1,  1,   //
                          0,  0,  0,  0,  0,  0,  0,  0,   //
                          40, 20, 20, 10, 10, 30, 30, 40,  //
                          0,  0,  0,  0,  0,  0,  0,  0,   //
                          2,  2,  2,  2,  2,  2,  2,  2};
  const EnvironmentMap map(light, {1});
  for (const auto& [direction, value] : std::vector<std::pair<Vector3d, float>>{
           {{0, 0, 1}, 1}, {{0, 0, -1}, 2}, {{1, 0, 0}, 10}, {{0, 1, 0}, 20}, {{0, -1, 0}, 30}, {{-1, 0, 0}, 40}})
    EXPECT_FLOAT_EQ(radiance(map, direction), value) << direction.transpose();

  // The middle of the picture becomes +y.
  light.to_world = Eigen::AngleAxisd(pi / 2, Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_FLOAT_EQ(radiance(EnvironmentMap(light, {1}), {0, 1, 0}), 10);
  EXPECT_FLOAT_EQ(radiance(EnvironmentMap(light, {1}), {0, 0, 1}), 1);
}

TEST(EnvironmentMap, HasNoSeam) {
  EnvironmentLight light = uneven_sky();
  light.to_world.setIdentity();
  const EnvironmentMap map(light, {1});
  for (double z = -0.9; z < 1; z += 0.1)
    EXPECT_NEAR(radiance(map, Vector3d(-1, 1e-7, z).normalized()), radiance(map, Vector3d(-1, -1e-7, z).normalized()),
                1e-4);
}

TEST(EnvironmentMap, ChannelsOfAnEvenSkyHaveSpectra) {
  EnvironmentLight light;
  light.picture = Image(7, 4, {"R", "G"});
  for (std::size_t i = 0; i < light.picture.pixels.size(); ++i) light.picture.pixels[i] = i % 2 == 0 ? 2 : 5;
  light.channel_spectra.resize(3, 2);
  light.channel_spectra << 1, 0, 0.5, 0.25, 0, 4;
  const EnvironmentMap map(light, {1, 2, 0.5});
  std::vector<float> sum{100, 0, 0};
  map.add_radiance({0, 0.6, 0.8}, sum);
  EXPECT_THAT(sum, ElementsAre(FloatEq(102), FloatEq(2.25), FloatEq(20)));
  EXPECT_NEAR(map.importance(), 4 * pi * (2 + 2 * 2.25 + 0.5 * 20), 2e-12);
  for (int i = 0; i < 100; ++i)
    EXPECT_NEAR(map.pdf(map.sample({random_uniform(6, i, 0), random_uniform(6, i, 1)})), 1 / (4 * pi), 1e-13);
}

TEST(EnvironmentMap, SamplesFollowTheDensity) {
  const EnvironmentMap map(uneven_sky(), {1});
  constexpr int rows = 12, columns = 24;  // Bins that differ from the texels and have equal solid angles.
  std::vector<double> weights(rows * columns);
  const auto bin = [](const Vector3d& d) {
    const int y = std::min(static_cast<int>((1 - d.z()) / 2 * rows), rows - 1);
    return y * columns + std::min(static_cast<int>((std::atan2(d.y(), d.x()) / (2 * pi) + 0.5) * columns), columns - 1);
  };
  // The density jumps at the edges of texels. There the midpoint rule is off by up to one row of its cells.
  constexpr int fine = 1200;
  for (int y = 0; y < fine; ++y)
    for (int x = 0; x < 2 * fine; ++x) {
      const double z = 1 - 2 * (y + 0.5) / fine, turn = pi * (x + 0.5) / fine, across = std::sqrt(1 - z * z);
      const Vector3d d(across * std::cos(turn), across * std::sin(turn), z);
      weights[bin(d)] += map.pdf(d) * 2 * pi / fine / fine;
    }
  EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 1, 2e-3);
  std::vector<int> counts(rows * columns);
  for (int i = 0; i < 50000; ++i) {
    const Vector3d d = map.sample({random_uniform(2, i, 0), random_uniform(2, i, 1)});
    ASSERT_NEAR(d.norm(), 1, 1e-14);
    ++counts[bin(d)];
  }
  EXPECT_GT(std::count_if(counts.begin(), counts.end(), [](int count) { return count > 10; }), 20);
  EXPECT_LT(std::abs(chi_square_score(counts, weights)), 4);
}

TEST(EnvironmentMap, WhatIsNoLightIsDark) {
  EnvironmentLight light = grey(4, 2);
  light.picture.pixels = {1, -1, NAN, INFINITY, 1, 1, 1, 1};
  const EnvironmentMap map(light, {1});
  for (int i = 0; i < 1000; ++i) {
    const Vector3d d = map.sample({random_uniform(7, i, 0), random_uniform(7, i, 1)});
    EXPECT_TRUE(radiance(map, d) >= 0 && radiance(map, d) <= 1 + 1e-6);
    EXPECT_TRUE(std::isfinite(map.pdf(d)));
  }
  const EnvironmentMap black(grey(4, 2), {1});
  EXPECT_EQ(black.importance(), 0);
  EXPECT_NEAR(black.sample({0.3, 0.7}).norm(), 1, 1e-14);
}

double mean(const Image& image) {
  return std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0) / static_cast<double>(image.pixels.size());
}

/// A smaller picture, each pixel of which is the mean of `factor` × `factor` pixels.
Image reduced(const Image& image, int factor) {
  Image result(image.width / factor, image.height / factor, image.channels);
  for (int y = 0; y < result.height * factor; ++y)
    for (int x = 0; x < result.width * factor; ++x)
      for (int c = 0; c < 3; ++c)
        result.pixel(x / factor, y / factor)[c] += image.pixel(x, y)[c] / static_cast<float>(factor * factor);
  return result;
}

/// Edges are anti-aliased exactly: a small picture equals a large one after reduction. (The grids are so small that
/// neither has labels.)
TEST(TestImagesTest, SmallPicturesAreLargeOnesReduced) {
  for (const TestImage which : {TestImage::checkerboard, TestImage::grid, TestImage::line})
    for (const auto& [width, height] : {std::pair(1, 1), {5, 3}, {31, 47}, {32, 32}, {50, 41}})
      EXPECT_THAT(test_image(which, width, height).pixels,
                  Pointwise(FloatNear(1e-5f), reduced(test_image(which, 4 * width, 4 * height), 4).pixels))
          << static_cast<int>(which) << ": " << width << " x " << height;
}

TEST(TestImagesTest, CheckerboardIsBlackAndWhiteInEqualParts) {
  const Image image = test_image(TestImage::checkerboard, 96, 64);  // Cells of 4 pixels.
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 96; ++x)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(image.pixel(x, y)[c], (x / 4 + y / 4) % 2 == 0 ? 1 : 0);
  EXPECT_EQ(mean(image), 0.5);
  EXPECT_NEAR(mean(test_image(TestImage::checkerboard, 101, 101)), 0.5, 1e-6);
  EXPECT_NEAR(mean(test_image(TestImage::checkerboard, 1, 1)), 0.5, 1e-6);
}

TEST(TestImagesTest, LineIsASixtyFourthOfTheWidthInTheMiddle) {
  for (const int width : {1, 7, 64, 100, 128, 1001}) {
    const Image image = test_image(TestImage::line, width, 3);
    EXPECT_NEAR(mean(image), 1 / 64.0, 1e-8) << width;
    for (int x = 0; x < width; ++x) {
      ASSERT_NEAR(*image.pixel(x, 0), *image.pixel(width - 1 - x, 0), 1e-6);
      const bool is_beside = std::abs(x + 0.5 - width / 2.0) > width / 128.0 + 0.5;
      ASSERT_TRUE(!is_beside || *image.pixel(x, 1) == 0) << width << " " << x;
    }
  }
  const Image image = test_image(TestImage::line, 128, 2);
  for (int x = 0; x < 128; ++x) EXPECT_EQ(*image.pixel(x, 1), x == 63 || x == 64 ? 1 : 0) << x;
}

/// The pixels of a cell of the grid without its lines, for comparison.
std::vector<float> cell_of(const Image& image, int left, int top, int cell) {
  std::vector<float> pixels;
  for (int y = top + cell / 8; y < top + cell - cell / 8; ++y)
    for (int x = left + cell / 8; x < left + cell - cell / 8; ++x)
      pixels.insert(pixels.end(), image.pixel(x, y), image.pixel(x, y) + 3);
  return pixels;
}

TEST(TestImagesTest, GridHasALabelOfItsOwnInEveryWholeCell) {
  const int cell = 32, columns = 40, rows = 16;  // With 40 columns, labels continue after Z.
  const Image image = test_image(TestImage::grid, columns * cell + 30, rows * cell);
  std::set<std::vector<float>> labels;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const std::vector<float> pixels = cell_of(image, 15 + column * cell, row * cell, cell);
      EXPECT_LT(*std::min_element(pixels.begin(), pixels.end()), 0.3) << "no label in column " << column;
      labels.insert(pixels);
    }
  EXPECT_EQ(labels.size(), static_cast<std::size_t>(columns * rows));
}

/// In a square picture the wheel fills 92 %.
TEST(TestImagesTest, ColorWheelHasRedAtTheRightAndGoesOnCounterClockwise) {
  const Image image = test_image(TestImage::color_wheel, 1024, 1024);
  const auto at = [&](double angle) -> Vector3d {  // Near the rim, beside the radial lines.
    const double r = 0.46 * 1024 * 0.94, x = r * std::cos(angle + 0.06), y = r * std::sin(angle + 0.06);
    return Eigen::Map<const Vector3f>(image.pixel(static_cast<int>(512 + x), static_cast<int>(512 - y))).cast<double>();
  };
  for (const int channel : {0, 1, 2}) {
    Eigen::Index largest = 0;
    at(2 * pi / 3 * channel).maxCoeff(&largest);
    EXPECT_EQ(largest, channel);
  }
  const Vector3d yellow = at(1.4);
  EXPECT_LT(yellow[2], 0.3 * std::min(yellow[0], yellow[1]));
}

}  // namespace
}  // namespace tensorray
