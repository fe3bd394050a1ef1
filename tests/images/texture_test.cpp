#include "renderer/textures/texture.h"

#include <tuple>
#include <utility>

#include "renderer/color/file_colors.h"
#include "tests/images/picture_files.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

const std::vector<Wrap> every_wrap{Wrap::none, Wrap::clamp, Wrap::repeat, Wrap::mirror};

/// The coordinates of a texel's centre; y counts from the top, as in an Image.
Vector2d centre(const Image& image, double x, double y) {
  return {(x + 0.5) / image.width, 1 - (y + 0.5) / image.height};
}

/// A footprint of x by y texels along the picture's axes.
Matrix2d texels(const Image& image, double x, double y) {
  return Vector2d(x / image.width, y / image.height).asDiagonal();
}

/// The colour that a look-up of texel (x, y) should return.
Vector4f color_of(const Image& image, int x, int y) {
  const float* const pixel = image.pixel(x, y);
  return {pixel[0], pixel[1], pixel[2], image.channels.size() > 3 ? pixel[3] : 1.0f};
}

Vector4f mean_of(const Image& image) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) sum += color_of(image, x, y).cast<double>();
  return (sum / image.width / image.height).cast<float>();
}

double difference(const Vector4f& a, const Vector4f& b) { return (a - b).cwiseAbs().maxCoeff(); }

TEST(TextureTest, FootprintsOfATexelGiveTheTexels) {
  for (const Image& image :
       {noise_image(512, 512), noise_image(300, 200), noise_image(37, 211, {"R", "G", "B", "A"}), noise_image(1000, 3)})
    for (const Wrap wrap : every_wrap) {
      const Texture texture(image, wrap);
      EXPECT_EQ(std::pair(texture.width(), texture.height()), std::pair(image.width, image.height));
      double worst = 0;
      for (const double size : {1.0, 0.999, 0.5, 1e-3, 0.0})
        for (int y = 0; y < image.height; y += 3)
          for (int x = 0; x < image.width; x += 7)
            worst = std::max(worst, difference(texture.lookup(centre(image, x, y), texels(image, size, size)),
                                               color_of(image, x, y)));
      EXPECT_EQ(worst, 0) << image.width << " x " << image.height << ", " << static_cast<int>(wrap);
    }
}

TEST(TextureTest, MagnifiedTexelsAreInterpolatedLinearly) {
  const Image image = noise_image(50, 40);
  const Texture texture(image, Wrap::clamp);
  for (const Matrix2d& footprint : {texels(image, 0.1, 0.1), texels(image, 0.9, 0.01)})
    for (double x = 0; x < 48; x += 1.13)
      for (double y = 0; y < 38; y += 1.37) {
        const int column = static_cast<int>(x), row = static_cast<int>(y);
        const auto u = static_cast<float>(x - column), v = static_cast<float>(y - row);
        const Vector4f expected =
            (1 - v) * ((1 - u) * color_of(image, column, row) + u * color_of(image, column + 1, row)) +
            v * ((1 - u) * color_of(image, column, row + 1) + u * color_of(image, column + 1, row + 1));
        EXPECT_LT(difference(texture.lookup(centre(image, x, y), footprint), expected), 2e-5) << x << " " << y;
      }
}

TEST(TextureTest, LongFootprintsAverageAlongThemAndStaySharpAcross) {
  // One bright row; the second channel has stripes across it.
  const Image image = image_of(512, 512, [](int x, int y) { return Vector3d(y == 256, x % 2, 0); });
  const Texture texture(image, Wrap::repeat);
  for (const double length : {2.0, 5.5, 16.0, 31.0})
    for (const double x : {100.0, 100.3, 100.5}) {
      const Vector4f on = texture.lookup(centre(image, x, 256), texels(image, length, 1));
      EXPECT_NEAR(on[0], 1, 1e-4);
      EXPECT_NEAR(on[1], 0.5, 0.51 / length);
      EXPECT_NEAR(texture.lookup(centre(image, x, 257), texels(image, length, 1))[0], 0, 1e-4);
    }
  // The same along the other axis, and along a diagonal that crosses the row.
  EXPECT_NEAR(texture.lookup(centre(image, 100, 256), texels(image, 1, 16))[0], 1.0 / 16, 0.01);
  EXPECT_NEAR(texture.lookup(centre(image, 101, 256), texels(image, 1, 16))[1], 1, 1e-4);
}

TEST(TextureTest, ALinearRampStaysLinearAtEveryFootprint) {
  const Image image = image_of(640, 480, [](int x, int y) { return Vector3d(x, y, 0); });
  const Texture texture(image, Wrap::clamp);
  for (double size = 0.5; size < 40; size *= 1.3)
    for (const double stretch : {1.0, 3.7}) {
      Matrix2d footprint = texels(image, size * stretch, size);
      footprint(1, 0) = footprint(1, 1);
      const Vector4f seen = texture.lookup(centre(image, 301.7, 222.2), footprint);
      // Levels are exact means over areas of equal shape, so a ramp stays a ramp; single precision limits the accuracy.
      EXPECT_NEAR(seen[0], 301.7, 1e-2) << size;
      EXPECT_NEAR(seen[1], 222.2, 1e-2) << size;
    }
}

TEST(TextureTest, HugeFootprintsGiveTheMean) {
  const double nan = NAN, infinity = INFINITY;
  for (const Image& image :
       {noise_image(300, 200), noise_image(1, 1), noise_image(513, 2), noise_image(100, 100, {"R", "G", "B", "A"})})
    for (const Wrap wrap : every_wrap) {
      const Texture texture(image, wrap);
      const Vector4f mean = mean_of(image);
      for (const double size : {1.0, 3.0, 1e9, 1e200, infinity, nan})
        for (const Vector2d& st : {Vector2d(0.5, 0.5), Vector2d(0.1, 0.9)}) {
          Matrix2d footprint = Matrix2d::Identity() * size * image.width / std::min(image.width, image.height);
          EXPECT_LT(difference(texture.lookup(st, footprint), mean), 1e-5) << size;
          if (std::isfinite(size)) continue;
          footprint = Matrix2d::Zero();
          footprint(0, 1) = size;
          EXPECT_LT(difference(texture.lookup(st, footprint), mean), 1e-5);
        }
      for (const double s : {nan, infinity, -infinity})
        EXPECT_EQ(texture.lookup({s, 0.5}, texels(image, 1, 1)), Vector4f(Vector4f::Zero()));
    }
}

TEST(TextureTest, Wraps) {
  const Image image = noise_image(30, 20);
  const Matrix2d footprint = texels(image, 1, 1);
  const auto seen = [&](Wrap wrap, int x, int y) {
    return Texture(image, wrap).lookup(centre(image, x, y), footprint);
  };
  const Vector4f nothing = Vector4f::Zero();
  EXPECT_EQ(seen(Wrap::none, -1, 5), nothing);
  EXPECT_EQ(seen(Wrap::none, 30, 5), nothing);
  EXPECT_EQ(seen(Wrap::none, 3, 2000), nothing);
  EXPECT_EQ(seen(Wrap::clamp, -4, 5), color_of(image, 0, 5));
  EXPECT_EQ(seen(Wrap::clamp, 1000000, 2000), color_of(image, 29, 19));
  EXPECT_EQ(seen(Wrap::clamp, 3, -1), color_of(image, 3, 0));
  EXPECT_EQ(seen(Wrap::repeat, -1, 5), color_of(image, 29, 5));
  EXPECT_EQ(seen(Wrap::repeat, 30 * 1000000 + 4, -20 * 1000 + 7), color_of(image, 4, 7));
  EXPECT_EQ(seen(Wrap::mirror, -1, 5), color_of(image, 0, 5));
  EXPECT_EQ(seen(Wrap::mirror, 31, 22), color_of(image, 28, 17));
  EXPECT_EQ(seen(Wrap::mirror, 60 * 1000 + 4, -40 * 1000 - 8), color_of(image, 4, 7));
}

TEST(TextureTest, EdgesAreAsSoftAsTheFootprint) {
  const Image image = image_of(256, 256, [](int, int) { return Vector3d(1, 1, 1); });
  const Texture texture(image, Wrap::none);
  for (const double size : {1.0, 4.0, 16.0}) {
    const Matrix2d footprint = texels(image, size, size);
    EXPECT_LT(difference(texture.lookup({0, 0.5}, footprint), Vector4f::Constant(0.5f)), 1e-5) << size;
    EXPECT_LT(difference(texture.lookup({size / 256, 0.5}, footprint), Vector4f::Ones()), 1e-5) << size;
    EXPECT_LT(difference(texture.lookup({-size / 256, 0.5}, footprint), Vector4f::Zero()), 1e-5) << size;
  }
}

Texture texture_of(const std::filesystem::path& file, const std::string& color_space = "") {
  return {file, ColorManagement({}), color_space, Wrap::clamp};
}

/// A texel of a picture that is one pixel high.
Vector4f texel_of(const Texture& texture, int x) {
  return texture.lookup({(x + 0.5) / texture.width(), 0.5}, Matrix2d::Zero());
}

/// Converts sRGB values, of which 255 is the greatest, to linear light and multiplies them by alpha.
Vector4f linear(double r, double g, double b, double alpha = 1) {
  const Vector3d light = (Vector3d(r, g, b) / 255).unaryExpr(&srgb_light);
  return (alpha * light.homogeneous()).cast<float>();
}

TEST(TextureFileTest, EveryEightBitNumberIsDecodedExactly) {
  std::vector<int> values;
  for (int i = 0; i < 256; ++i) values.insert(values.end(), {i, 255 - i, i / 2});
  const Temporary file("all.png", png_file(256, 1, 3, 8, values));
  const Texture srgb = texture_of(file), plain = texture_of(file, "scene_linear");
  for (int i = 0; i < 256; ++i) {
    EXPECT_LT(difference(texel_of(srgb, i), linear(i, 255 - i, i / 2)), 1e-6) << i;
    EXPECT_LT(difference(texel_of(plain, i), Eigen::Vector4i(i, 255 - i, i / 2, 255).cast<float>() / 255), 1e-7) << i;
  }
}

TEST(TextureFileTest, FormatsOfPngAndTiff) {
  const std::string rgba = png_file(2, 1, 4, 8, {10, 20, 250, 51, 3, 2, 1, 255});
  // No ink, full cyan, full black.
  const std::string cmyk = tiff_file(3, 1, 4, 8, 5, std::string("\0\0\0\0\xFF\0\0\0\0\0\0\xFF", 12));
  const Vector4f brown = linear(100, 50, 10, 0.2);
  using Case = std::tuple<std::string, std::string, std::vector<Vector4f>>;
  for (const auto& [name, content, expected] : std::vector<Case>{
           {"grey.png", png_file(2, 1, 1, 8, {51, 200}), {linear(51, 51, 51), linear(200, 200, 200)}},
           {"grey_alpha.png", png_file(2, 1, 2, 8, {51, 102, 200, 0}), {linear(51, 51, 51, 0.4), Vector4f::Zero()}},
           {"rgba.png", rgba, {linear(10, 20, 250, 0.2), linear(3, 2, 1)}},
           {"deep.png", png_file(1, 1, 3, 16, {1, 256, 65535}), {linear(1 / 257.0, 256 / 257.0, 255)}},
           {"straight.tif", tiff_file(1, 1, 4, 8, 2, "\x64\x32\x0A\x33", {{338, {1, 2}}}), {brown}},
           {"multiplied.tif", tiff_file(1, 1, 4, 8, 2, "\x14\x0A\x02\x33", {{338, {1, 1}}}), {brown}},
           {"cmyk.tif", cmyk, {linear(255, 255, 255), linear(0, 255, 255), linear(0, 0, 0)}}}) {
    const Temporary file(name, content);
    const Texture texture = texture_of(file);
    ASSERT_EQ(texture.width(), static_cast<int>(expected.size())) << name;
    for (std::size_t x = 0; x < expected.size(); ++x) {
      const Vector4f texel = texel_of(texture, static_cast<int>(x));
      EXPECT_LE(difference(texel, expected[x]), 1e-6 * expected[x][3]) << name << " " << x << ": " << texel.transpose();
    }
  }
}

TEST(TextureFileTest, ChannelsOfExrAreFoundByNameAndTakenAsTheyAre) {
  const auto first = [](const std::vector<std::string>& channels, const std::vector<float>& values) {
    const Temporary file("channels.exr", exr_file({0, 0, 0, 0}, {0, 0, 0, 0}, channels, values));
    return texel_of(texture_of(file), 0);
  };
  EXPECT_EQ(first({"A", "B", "G", "R"}, {1, 1e20f, 1e-20f, -2}), Vector4f(-2, 1e-20f, 1e20f, 1));
  EXPECT_EQ(first({"A", "B", "G", "R"}, {0, NAN, 2, 3}), Vector4f(3, 2, 0, 0));  // Light with alpha 0; NaN counts as 0.
  EXPECT_EQ(first({"A", "B", "G", "R", "Z"}, {0.5f, 0.1f, 0.2f, 0.3f, 9}), Vector4f(0.3f, 0.2f, 0.1f, 0.5f));
  EXPECT_EQ(first({"AO", "B", "G", "N.x", "R"}, {7, 0.1f, 0.2f, 8, 0.3f}), Vector4f(0.3f, 0.2f, 0.1f, 1));
  EXPECT_EQ(first({"beauty.B", "beauty.G", "beauty.R", "depth.Z"}, {1, 2, 3, 4}), Vector4f(3, 2, 1, 1));
  EXPECT_EQ(first({"Y", "Z"}, {0.7f, 4}), Vector4f(0.7f, 0.7f, 0.7f, 1));
  EXPECT_EQ(first({"Z"}, {4}), Vector4f(4, 4, 4, 1));
  EXPECT_EQ(first({"A", "V"}, {0.5f, 0.25f}), Vector4f(0.25f, 0.25f, 0.25f, 0.5f));
  EXPECT_THAT(message([&] { first({"X", "Z"}, {1, 2}); }), AllOf(HasSubstr("channels.exr"), HasSubstr("X, Z")));
}

TEST(TextureFileTest, OutsideOfItsDataWindowAPictureIsTransparent) {
  // The lower row of the right half of a 4 x 2 picture, and one pixel beyond its edge.
  const Temporary file("window.exr", exr_file({10, 20, 13, 21}, {12, 21, 14, 21}, {"B", "G", "R"},
                                              {0.1f, 0.2f, 0.3f, 1, 2, 3, 4, 5, 6}));
  const Texture texture = texture_of(file);
  ASSERT_EQ(std::pair(texture.width(), texture.height()), std::pair(4, 2));
  const auto texel = [&](int x, int y) { return texture.lookup({(x + 0.5) / 4, 1 - (y + 0.5) / 2}, Matrix2d::Zero()); };
  EXPECT_EQ(texel(2, 1), Vector4f(4, 1, 0.1f, 1));
  EXPECT_EQ(texel(3, 1), Vector4f(5, 2, 0.2f, 1));
  EXPECT_EQ(texel(1, 1), Vector4f(Vector4f::Zero()));
  EXPECT_EQ(texel(3, 0), Vector4f(Vector4f::Zero()));
}

TEST(TextureFileTest, LevelsOfLargeFilesHaveTheirMean) {
  constexpr int width = 4099, height = 4101;  // Too large to be stored as floats; most levels have odd sizes.
  std::string values(static_cast<std::size_t>(width) * height, '\0');
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<char>(i % width * 7 + i / width * 13);
  double mean = 0;
  for (int value = 0; value < 256; ++value) {
    const auto count = std::count(values.begin(), values.end(), static_cast<char>(value));
    mean += srgb_light(value / 255.0) * static_cast<double>(count) / width / height;
  }
  const Temporary file("large.tif", tiff_file(width, height, 1, 8, 1, values));
  const Texture texture(file, ColorManagement({}), "", Wrap::repeat);
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(4098, 17), std::pair(1234, 4100)})
    EXPECT_NEAR(texture.lookup({(x + 0.5) / width, 1 - (y + 0.5) / height}, Matrix2d::Zero())[0],
                srgb_light((x * 7 + y * 13) % 256 / 255.0), 1e-4);
  EXPECT_NEAR(texture.lookup({0, 0}, 2 * Matrix2d::Identity())[0], mean, 1e-5);
  for (const double size : {300.0, 900.0})
    EXPECT_NEAR(texture.lookup({0.4, 0.7}, Vector2d(size / width, size / height).asDiagonal())[0], mean, 2e-3) << size;
}

/// What is said of a bad file, without the beginning, which names it.
std::string error_of(const std::string& name, const std::string& content) {
  const Temporary file(name, content);
  const std::string text = message([&] { texture_of(file); }), beginning = "cannot read " + file.string() + ": ";
  return text.rfind(beginning, 0) == 0 ? text.substr(beginning.size()) : text;
}

TEST(TextureFileTest, BadFilesAreRefused) {
  EXPECT_EQ(error_of("silent.ppm", "P6 9 9 255\nshort"), "the file is cut off or damaged");  // Its reader says nothing.
  const std::string too_large = png_file(60000, 60000, 3, 8, {0});  // Refused before it is read.
  EXPECT_EQ(error_of("a.png", too_large), "its 60000 x 60000 pixels take more than 8 GiB; make it smaller");
}

TEST(TextureFileTest, NoPartOfATiffIsMadeUp) {
  for (const bool is_deflated : {false, true}) {
    const std::string whole = striped_tiff(is_deflated);
    EXPECT_EQ(error_of("whole.tif", whole), "nothing was thrown") << is_deflated;
    for (const double part : {0.2, 0.5, 0.99})
      EXPECT_THAT(error_of("cut.tif", first_part(whole, part)), StartsWith("the file is cut off or damaged"))
          << is_deflated << part;
    EXPECT_THAT(error_of("far.tif", striped_tiff(is_deflated, 4000000000u)), HasSubstr("damaged")) << is_deflated;
  }
  for (std::size_t at = 400; at < striped_tiff(true).size(); at += 997) {
    std::string changed = striped_tiff(true);
    changed[at] = static_cast<char>(~changed[at]);  // Only the sum of zlib's stream tells.
    EXPECT_THAT(error_of("changed.tif", changed), HasSubstr("damaged")) << at;
  }
}

}  // namespace
}  // namespace tensorray
