#include "integrators/lens/lens.h"

#include "renderer/sampling/random.h"
#include "tests/scenes/pictures/pictures.h"
#include "tests/tracing/support.h"

namespace tensorray {
namespace {

/// A lens scene that renders quickly; `rest` contains further keys of the integrator.
std::string small_lens(const std::string& rest, const std::string& kind = R"("kind": "point_load", "resolution": 17)") {
  return R"({"field": {"generate": {)" + kind + R"(}},
             "light": {"wavelengths": {"count": 10}},
             "receiver": {"resolution": [48, 32], "size": [2.4, 1.6]},
             "integrator": {"type": "lens", )" +
         rest + "}}";
}

constexpr const char* no_bending =
    R"("kind": "constant", "resolution": 9, "tensor": [[0, 0, 0], [0, 0, 0], [0, 0, 0]])";

using Lens = Pictures;

TEST_F(Lens, WithoutAFieldThePictureIsTheImage) {
  Image picture(48, 32, {"R", "G", "B"});  // Random colours whose display values have 8 bits.
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    picture.pixels[i] = static_cast<float>(std::floor(256 * random_uniform(1, i, 0)) / 255);
  write_image(in_folder("photo.png"), picture);
  write("scene.json", small_lens(R"("image": "photo.png")", no_bending));
  for (const std::string settings : {"integrator.mode=gather", "integrator.mode=scatter", "bending.rgb=[0.1,0.2,0.3]",
                                     "light.spectrum=A", "integrator.image_plane.depth=0.5"}) {
    render({settings, "output.view=Un-tone-mapped"}, {"out.png"});
    const Image seen = read_image(in_folder("out.png"));
    ASSERT_EQ(seen.width, 48);
    ASSERT_EQ(seen.channels.size(), 4u);
    // Half a step of 8 bits is 0.002. The slope of sRGB near black makes an error of 1e-4 from single precision.
    for (const char* color : {"R", "G", "B"})
      EXPECT_THAT(channel(seen, color), testing::Pointwise(testing::FloatNear(2e-4f), channel(picture, color)))
          << settings;
    EXPECT_THAT(channel(seen, "A"), testing::Each(1.0f));
  }
}

/// Light with alpha 0, such as a flame's, in a layer of the file, with a texel that is not finite.
TEST_F(Lens, LightWithoutAlphaIsKept) {
  Image glow(48, 32, {"R", "G", "B", "fire.R", "fire.G", "fire.B", "fire.A"});
  const float values[] = {0.5f, 0.5f, 0.5f, 3, 2, 1, 0};
  for (std::size_t i = 0; i < glow.pixels.size(); ++i) glow.pixels[i] = values[i % 7];
  glow.pixel(0, 0)[3] = NAN;
  write_image(in_folder("glow.exr"), glow);
  for (const std::string mode : {"gather", "scatter"}) {
    write("scene.json",
          small_lens(R"("image": "glow.exr", "image_layer": "fire", "mode": ")" + mode + "\"", no_bending));
    const Image seen = render({});
    const float* const pixel = seen.pixel(24, 16);
    EXPECT_LT((Vector3f(pixel) - Vector3f(3, 2, 1)).norm(), 1e-3) << mode;
    EXPECT_EQ(pixel[3], 0) << mode;
  }
  EXPECT_THAT(notes_, Contains(HasSubstr("glow.exr: 1 pixels have values that are not finite")));
}

TEST_F(Lens, DepthsStandSideBySideAndLessOfTheVolumeBendsLess) {
  // The field turns light about z at a constant rate. A longer path is deflected more.
  write("scene.json", small_lens(R"("image": "grid", "image_plane": {"depth": [0, 0.25, 0.5, 0.75, 0.95]})",
                                 R"("kind": "constant", "resolution": 9,
                                    "tensor": [[0, 0.75, 0], [-0.75, 0, 0], [0, 0, 0]])"));
  for (const std::string mode : {"gather", "scatter"}) {
    const Image image = render({"integrator.mode=" + mode, "light.direction=[0,1,0]", "receiver.resolution=[32,32]",
                                "receiver.size=[3,3]", "field.scale=1"});
    ASSERT_EQ(image.width, 5 * 32 + 4);
    const std::vector<float> aside = channel(image, "displacement.x");
    const auto middle = [&](int panel) {
      return std::abs(aside[static_cast<std::size_t>(16 * image.width + 33 * panel + 16)]);
    };
    for (int panel = 1; panel < 5; ++panel) EXPECT_LT(middle(panel), middle(panel - 1)) << mode << " " << panel;
    EXPECT_GT(middle(4), 0) << mode;
  }
}

/// Where no light of the image arrives, the picture that is looked at is hatched; the EXR is as it was, and between
/// pictures nothing is drawn.
TEST_F(Lens, IsHatchedWhereNoLightArrives) {
  write("scene.json",
        small_lens(R"("image": "color_wheel", "image_plane": {"depth": [0, 0.5], "size": [1, 1]})", no_bending));
  const Image linear = render({}, {"hatched.png"}), same = render({"integrator.empty=transparent"}, {"empty.png"});
  EXPECT_EQ(linear.pixels, same.pixels);
  const std::vector<float> alpha = channel(linear, "A"), hatched = channel(read_image(in_folder("hatched.png")), "A"),
                           empty = channel(read_image(in_folder("empty.png")), "A");
  for (std::size_t i = 0; i < alpha.size(); ++i) {
    const bool is_gap = i % 97 == 48, sees = alpha[i] == 1;
    EXPECT_EQ(hatched[i], is_gap ? 0 : 1) << i;
    if (sees || alpha[i] == 0) {
      EXPECT_EQ(empty[i], sees ? 1 : 0) << i;
    }
  }
  EXPECT_NEAR(sum(alpha), 2 * 20 * 20, 1);  // Of 48 × 32 pixels of 0.05.
}

/// Pixels that are brighter than all their neighbours, in one colour: a fold's light has none.
TEST_F(Lens, NoPixelStandsOutBesideAFold) {
  write("scene.json", R"({
    "field": {"generate": {"kind": "point_load", "resolution": 65}, "eigenvalues": "absolute"},
    "bending": {"a": 0.3, "b": -0.0002}, "light": {"wavelengths": {"count": 12}},
    "receiver": {"distance": 0.1, "size": [2.2, 2.2], "resolution": [256, 256]},
    "integrator": {"type": "lens", "image": "checkerboard", "image_plane": {"distance": 0.1}, "samples": 2}})");
  const Image image = render({});
  int count = 0;
  for (const int color : {0, 1, 2})
    for (int y = 1; y < 255; ++y)
      for (int x = 1; x < 255; ++x) {
        float around = 0;
        for (int i = 0; i < 9; ++i)
          if (i != 4) around = std::max(around, image.pixel(x + i % 3 - 1, y + i / 3 - 1)[color]);
        count += std::min(image.pixel(x, y)[color], 1.0f) > std::min(around, 1.0f) + 0.04f;
      }
  EXPECT_EQ(count, 0);
}

TEST_F(Lens, OverlayDrawsOverThePictureAlone) {
  write("scene.json", small_lens(R"("image": "color_wheel", "mode": "gather")"));
  const Image plain = render({}), drawn = render({"integrator.overlay=grid"});
  EXPECT_NE(channel(plain, "R"), channel(drawn, "R"));
  for (const std::string& name : plain.channels)
    EXPECT_TRUE(name.size() == 1 || channel(plain, name) == channel(drawn, name)) << name;
}

TEST_F(Lens, AlphaIsMultipliedInWhereTheFormatWantsItSo) {
  Image picture(2, 2, {"R", "G", "B", "A"});
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) picture.pixels[i] = i % 4 == 3 ? 0.5f : 1;
  write_image(in_folder("photo.png"), picture);
  write("scene.json", small_lens(R"("image": "photo.png")", no_bending));
  const Settings small{"receiver.resolution=[2,2]", "receiver.size=[2,2]", "output.view=Un-tone-mapped"};
  const Image linear = render(small, {"out.png"}), shown = read_image(in_folder("out.png"));
  EXPECT_NEAR(channel(linear, "R")[0], 0.5, 1e-4);
  EXPECT_NEAR(channel(linear, "A")[0], 0.5, 1e-4);
  EXPECT_NEAR(channel(shown, "R")[0], 1, 1e-4);
  EXPECT_NEAR(channel(shown, "A")[0], 0.5, 1e-4);
  render(small, {"out.jpg"});
  EXPECT_NEAR(read_image(in_folder("out.jpg")).pixels[0], 0.735, 0.01) << "half the light, on the sRGB curve";
}

TEST_F(Lens, StrongFieldsLeaveNothingThatIsNotFinite) {
  write("scene.json", small_lens(R"("image": "checkerboard")"));
  for (const std::string mode : {"gather", "scatter"})
    for (const std::string scale : {"300", "1e8"})
      render({"integrator.mode=" + mode, "field.scale=" + scale, "receiver.resolution=[12,8]",
              "bending.max_steps=20"});  // It expects finite values.
}

constexpr int pixels = 16;  // Pixels of 1/16.

Plate plate_at(double z) {
  Plate plate;
  plate.center = {0, 0, z};
  plate.size = {1, 1};
  plate.resolution = {pixels, pixels};
  return plate;
}

/// Draws obstacles where light goes along +z from an image to a receiver at z = 2.
void draw(std::vector<TriangleMesh> obstacles, double image_z, int samples, Image& image) {
  Surfaces surfaces;
  surfaces.bounds = box_between({-1, -1, -1}, {1, 1, 1});
  surfaces.obstacles = std::move(obstacles);
  const Geometry shown = obstacles_of(surfaces);
  for (int i = 0; i < pixels * pixels; ++i) {
    const Vector2i at(i % pixels, i / pixels);
    Eigen::Map<Vector4f> pixel(image.pixel(at.x(), at.y()));
    Eigen::Vector4d seen = pixel.cast<double>();
    draw_obstacles(shown, {plate_at(2), {nullptr, plate_at(image_z)}, Vector3d::UnitZ()}, samples, at, seen);
    pixel = seen.cast<float>();
  }
}

TEST(LensObstacles, CoverTheirPartOfEachPixelWhereThePictureIsTransparent) {
  const double pixel = 1.0 / pixels;  // The box covers pixels 4 to 11 along x, and a half of pixel 12.
  Image image(pixels, pixels, {"R", "G", "B", "A", "length"});
  for (int y = 0; y < pixels; ++y)
    for (int x = 0; x < pixels; ++x) image.pixel(x, y)[3] = static_cast<float>(y % 2) / 2;
  const Image before = image;
  draw({box_between({-4 * pixel, -2 * pixel, 0}, {4.5 * pixel, 3 * pixel, 0.5})}, -2, 4, image);
  const float grey = image.pixel(6, 6)[0];
  EXPECT_GT(grey, 0.2f);
  for (int y = 0; y < pixels; ++y)
    for (int x = 0; x < pixels; ++x) {
      const float covered = y < 5 || y >= 10 || x < 4 || x > 12 ? 0.0f : x == 12 ? 0.5f : 1.0f;
      const float open = 1 - before.pixel(x, y)[3];
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.pixel(x, y)[c], open * covered * grey, 1e-6) << x << " " << y;
      EXPECT_NEAR(image.pixel(x, y)[3], 1 - open * (1 - covered), 1e-6) << x << " " << y;
      EXPECT_EQ(image.pixel(x, y)[4], 0);
    }
}

TEST(LensObstacles, BehindTheImageTheyAreNotSeen) {
  Image image(pixels, pixels, {"R", "G", "B", "A"});
  const TriangleMesh obstacle = box_between({-0.5, -0.5, -0.5}, {0.5, 0.5, -0.25});
  draw({obstacle}, 0, 1, image);
  EXPECT_THAT(image.pixels, testing::Each(0.0f));
  draw({obstacle}, -2, 1, image);
  EXPECT_EQ(image.pixel(8, 8)[3], 1);
}

}  // namespace
}  // namespace tensorray
