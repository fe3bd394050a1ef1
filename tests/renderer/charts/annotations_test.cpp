#include "renderer/charts/annotations.h"

#include "base/geometry/box.h"
#include "renderer/charts/color_bar.h"
#include "renderer/charts/ink.h"
#include "renderer/charts/lettering.h"
#include "tests/names.h"

namespace tensorray {
namespace {

Image blank(int width, int height, float value) {
  Image image(width, height, {"R", "G", "B"});
  std::fill(image.pixels.begin(), image.pixels.end(), value);
  return image;
}

template <class Predicate>
std::vector<Vector2i> pixels_where(const Image& image, const Predicate& predicate) {
  std::vector<Vector2i> found;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (predicate(image.pixel(x, y))) found.emplace_back(x, y);
  return found;
}

/// The box of the pixels that differ from `value` by more than half.
Eigen::AlignedBox2i drawn_box(const Image& image, float value) {
  return box_of(pixels_where(image, [=](const float* p) { return std::abs(p[0] - value) > 0.5f; }));
}

TEST(AnnotationsTest, RoundLengthsAreTheGreatestThatFit) {
  const std::vector<std::pair<double, double>> cases{{1, 1},     {1.99, 1},      {2, 2},      {4.9, 2},
                                                     {5, 5},     {9.99, 5},      {10, 10},    {0.013, 0.01},
                                                     {0.5, 0.5}, {3e-24, 2e-24}, {7e25, 5e25}};
  for (const auto& [limit, length] : cases) EXPECT_DOUBLE_EQ(round_length(limit), length) << limit;
}

/// The bar is black on white and white on black, and as long as its number says: length / pixel size.
TEST(AnnotationsTest, ScaleBarHasItsLength) {
  for (const float ground : {0.0f, 1.0f})
    for (const double pixel_size : {0.013, 0.0049, 1.0, 3.3e-9, 7e20}) {
      const int width = 300, height = 200, margin = 13;
      Image image = blank(width, height, ground);
      draw_scale_bar(image, pixel_size, "mm");
      double ink = 0;
      for (int x = 0; x < width; ++x) ink += std::abs(image.pixel(x, height - margin - 1)[0] - ground);
      const double length = round_length(0.4 * height * pixel_size);
      EXPECT_NEAR(ink, length / pixel_size, 1e-4) << pixel_size << " on " << ground;
      EXPECT_EQ(drawn_box(image, ground).min().x(), margin);
      EXPECT_EQ(drawn_box(image, ground).max().y(), height - margin - 1);
    }
}

/// A caption ends at the margin, on its base line, and changes nothing left of its width.
TEST(AnnotationsTest, CaptionIsInTheLowerRightCorner) {
  Image image = blank(300, 200, 0);
  draw_caption(image, "scale 7");
  const Eigen::AlignedBox2i ink = drawn_box(image, 0);
  const double letter = 13;
  EXPECT_NEAR(ink.max().x(), 300 - letter, 3);
  EXPECT_NEAR(ink.max().y(), 200 - letter, 2);
  EXPECT_NEAR(ink.min().x(), 300 - letter - text_width("scale 7", letter), 3);
  EXPECT_NEAR(ink.min().y(), 200 - 2 * letter, 2);
}

/// Axes of a plate lie along its right and up; an axis that points at the viewer is no line.
TEST(AnnotationsTest, AxesPointAsThePictureShowsThem) {
  const auto axes = [](const Vector3d& right, const Vector3d& up) {
    Image image = blank(400, 400, 0);
    draw_axes(image, right, up);
    return image;
  };
  const Image x_and_y = axes({1, 0, 0}, {0, 1, 0});
  EXPECT_NE(x_and_y.pixels, axes({0, 1, 0}, {0, 0, 1}).pixels);   // Other letters at the same lines.
  EXPECT_NE(x_and_y.pixels, axes({-1, 0, 0}, {0, 1, 0}).pixels);  // From behind: a cross, no dot, and x to the left.
  // x has 3 letters and a half, and y as much; the letter of z is left and below of the origin.
  const Eigen::AlignedBox2i flat = drawn_box(x_and_y, 0);
  EXPECT_NEAR(flat.sizes().x(), (3 + 0.9 + 0.9) * 13, 13);
  EXPECT_NEAR(flat.sizes().y(), (3 + 0.9 + 0.9) * 13, 13);
  EXPECT_EQ(flat.min().x(), 13);
  EXPECT_NEAR(flat.min().y(), 13, 3);  // Small letters are lower than capital ones, for which there is room.
  // Seen along the diagonal, all three are lines.
  const Vector3d view = Vector3d(-1, -1, -1).normalized();
  const Vector3d right = view.cross(Vector3d::UnitZ()).normalized();
  EXPECT_FALSE(drawn_box(axes(right, right.cross(view)), 0).isEmpty());
}

/// Legends with short words, one or two, are beside the picture and cover none of it. The room is even.
TEST(AnnotationsTest, RoomIsForALegendAndLeavesThePicture) {
  for (const auto& [width, height] : {std::pair(200, 200), {512, 512}, {200, 900}, {1920, 1080}, {24, 16}}) {
    const Image with_room = with_room_beside(blank(width, height, 0.6f));
    Image wide = with_room;
    for (const std::size_t part : {0, 1})
      draw_color_bar(wide, {"largest\n1/mm", {0, 0.0123}, [](double) { return Vector3d(1, 0, 0); }}, {part, 2});
    wide = with_room_below(wide);
    draw_caption(wide, "a line that is longer than most, which is why its letters are smaller than they would be");
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) ASSERT_EQ(wide.pixel(x, y)[0], 0.6f) << width << ": " << x << ", " << y;
    EXPECT_EQ((wide.width - width) % 2 + (wide.height - height) % 2, 0);
    EXPECT_EQ(with_room.pixel(width, 0)[0], 1);
    const Image coarse = with_room_below(with_room_beside(blank(width / 4, height / 4, 0.6f), 4), 4);
    EXPECT_NEAR(4 * coarse.width, wide.width, 8 + width % 4);
    EXPECT_NEAR(4 * coarse.height, wide.height, 8 + height % 4);
  }
}

TEST(AnnotationsTest, DirectionsOfAPatientHaveTheirLetters) {
  const std::vector<std::pair<Vector3d, std::string>> cases{{{1, 0, 0}, "R"},       {{-1, 0, 0}, "L"},
                                                            {{0, 1, 0}, "A"},       {{0, -1, 0}, "P"},
                                                            {{0, 0, 1}, "S"},       {{0, 0, -1}, "I"},
                                                            {{0.3, 0, 0.954}, "S"}, {{0.6, 0, -0.8}, "IR"},
                                                            {{-0.8, 0.6, 0}, "LA"}, {{-0.66, -0.57, 0.49}, "LPS"}};
  for (const auto& [direction, letters] : cases) EXPECT_EQ(anatomical_letters(direction), letters);
}

/// Dashes of 6.5 pixels, which go on from stroke to stroke.
TEST(AnnotationsTest, HiddenLinesAreDashed) {
  for (const bool hidden : {false, true}) {
    Image image = blank(300, 200, 1);
    draw_outline(image,
                 {{{20, 50}, {152, 50}, false}, {{20, 100.5}, {64, 100.5}, true}, {{64, 100.5}, {152, 100.5}, true}},
                 true, hidden);
    const auto ink = [&](int y) {
      double sum = 0;
      for (int x = 0; x < 300; ++x) sum += 1 - image.pixel(x, y)[0];
      return sum;
    };
    EXPECT_NEAR(ink(49), 132, 2);
    EXPECT_NEAR(ink(100), hidden ? 66 : 0, hidden ? 12 : 1e-9);  // Each dash has round ends.
  }
}

std::vector<std::string> labels(const ValueRange& range, int most = 7) {
  std::vector<std::string> texts;
  for (const Tick& tick : round_ticks(range, most)) texts.push_back(tick.label);
  return texts;
}

TEST(RoundTicksTest, ScalesAreLinearOrLogarithmic) {
  EXPECT_THAT(labels({0, 3.7}), ElementsAre("0", "1", "2", "3"));
  EXPECT_THAT(labels({0, 1}), ElementsAre("0", "0.2", "0.4", "0.6", "0.8", "1.0"));
  EXPECT_THAT(labels({-0.012, 0.03}), ElementsAre("-0.01", "0", "0.01", "0.02", "0.03"));
  EXPECT_THAT(labels({1000, 1002}, 3), ElementsAre("1000", "1001", "1002"));
  EXPECT_THAT(labels({-2.4e-6, 2.4e-6}), ElementsAre("-2e-6", "-1e-6", "0", "1e-6", "2e-6"));
  EXPECT_THAT(labels({0, 3e7}), ElementsAre("0", "0.5e7", "1.0e7", "1.5e7", "2.0e7", "2.5e7", "3.0e7"));
  EXPECT_THAT(labels({2e-4, 0.7, true}), ElementsAre("0.001", "0.01", "0.1"));
  EXPECT_THAT(labels({1, 1000, true}), ElementsAre("1", "10", "100", "1000"));
  EXPECT_THAT(labels({3, 30, true}), ElementsAre("5", "10", "20"));
  EXPECT_THAT(labels({3, 4, true}, 4), ElementsAre("3.0", "3.5", "4.0"));
  EXPECT_THAT(labels({1e-9, 1e6, true}), ElementsAre("1e-9", "1e-6", "0.001", "1", "1000", "1e6"));
}

/// A colour bar whose green increases with the position. Its red and blue are constant and appear nowhere else.
ColorBar green_bar() {
  return {"|T V|", {0, 4}, [](double x) { return Vector3d(0.25, x, 0.125); }};
}

std::vector<Vector2i> pixels_of_bar(const Image& image) {
  return pixels_where(image, [](const float* p) { return p[0] == 0.25f && p[2] == 0.125f; });
}

TEST(ColorBarTest, ShowsAllPositionsFromTheBottomToTheTop) {
  for (const int size : {200, 400, 801}) {
    Image image = blank(size * 3 / 2, size, 0);
    draw_color_bar(image, green_bar());
    const std::vector<Vector2i> pixels = pixels_of_bar(image);
    ASSERT_FALSE(pixels.empty());
    const int top = pixels.front().y(), bottom = pixels.back().y();
    EXPECT_NEAR(bottom - top + 1, 0.6 * size, 1);
    EXPECT_NEAR(top + bottom, size, 0.15 * size);  // The bar is vertically centred, below its title.
    EXPECT_GT(pixels.front().x(), image.width * 0.75);
    for (const Vector2i& p : pixels)
      EXPECT_NEAR(image.pixel(p.x(), p.y())[1], (bottom + 0.5 - p.y()) / (bottom - top + 1), 1e-6);
  }
}

/// The lines of the ticks are white, at the heights of 0, 1, ... 4, to the right of the frame of the bar.
TEST(ColorBarTest, TicksAreAtTheirValues) {
  Image image = blank(1000, 1000, 0);
  draw_color_bar(image, green_bar());
  const std::vector<Vector2i> pixels = pixels_of_bar(image);
  const double top = pixels.front().y(), bottom = pixels.back().y() + 1.0;
  const int x = pixels.back().x() + 6;
  std::vector<double> middles;
  for (int y = 0, first = -1; y < image.height; ++y) {
    const bool is_ink = image.pixel(x, y)[0] > 0.9f;
    if (is_ink && first < 0) first = y;
    if (!is_ink && first >= 0) {
      if (first > top - 5) middles.push_back((first + y) / 2.0);
      first = -1;
    }
  }
  ASSERT_EQ(middles.size(), 5u);
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(middles[i], top + (bottom - top) * i / 4, 1);
}

TEST(ColorBarTest, IsCutOffWhereThePictureIsSmall) {
  for (const int size : {1, 7, 40}) {
    Image image = blank(size, size, 0.5f);
    draw_color_bar(image, green_bar());
    draw_color_key(image, {"", {{"x", {1, 0, 0}}, {"y", {0, 1, 0}}, {"z", {0, 0, 1}}}});
    for (const float value : image.pixels) EXPECT_TRUE(value >= 0 && value <= 1);
  }
}

TEST(ColorKeyTest, ShowsEachColorOnceFromTheTop) {
  Image image = blank(400, 400, 0);
  draw_color_key(image, {"", {{"x", {1, 0, 0}}, {"y", {0, 1, 0}}, {"z", {0, 0, 1}}}});
  std::vector<Vector2i> pixels[3];
  for (int c = 0; c < 3; ++c)
    pixels[c] =
        pixels_where(image, [c](const float* p) { return p[c] == 1 && p[(c + 1) % 3] == 0 && p[(c + 2) % 3] == 0; });
  EXPECT_GT(pixels[0].size(), 100u);
  EXPECT_EQ(pixels[0].size(), pixels[1].size());
  EXPECT_EQ(pixels[0].size(), pixels[2].size());
  EXPECT_LT(pixels[0].back().y(), pixels[1].front().y());
  EXPECT_LT(pixels[1].back().y(), pixels[2].front().y());
}

}  // namespace
}  // namespace tensorray
