#include "renderer/images/image.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/images/picture_files.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A picture that is smooth enough for JPEG.
Image gradient() {
  Image image(64, 48, {"R", "G", "B"});
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      image.pixel(x, y)[0] = static_cast<float>(x) / 63;
      image.pixel(x, y)[1] = static_cast<float>(y) / 47;
      image.pixel(x, y)[2] = 0.25f;
    }
  return image;
}

double largest_difference(const Image& a, const Image& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.pixels.size(), b.pixels.size());
  double largest = 0;
  for (std::size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); ++i)
    largest = std::max(largest, std::abs(static_cast<double>(a.pixels[i]) - b.pixels[i]));
  return largest;
}

class EveryEnding : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(ImageTest, EveryEnding, ::testing::ValuesIn(image_endings()),
                         [](const auto& ending) { return ending.param.substr(1); });

TEST_P(EveryEnding, WritesAndReadsBack) {
  const Temporary file("there_and_back" + GetParam());
  const Image image = gradient();
  write_image(file.path(), image);
  const Image read = read_image(file.path());
  EXPECT_EQ(read.channels, image.channels);
  // Half a step of the format; the error of JPEG at this quality is a few steps.
  const double tolerance = GetParam() == ".exr" ? 0 : GetParam()[1] == 'j' ? 5 / 255.0 : 0.51 / 65535;
  EXPECT_LE(largest_difference(read, image), tolerance);
}

TEST_P(EveryEnding, KeepsDescriptions) {
  const Temporary file("described" + GetParam());
  write_image(file.path(), gradient(), {{"ImageDescription", "seed 4711"}, {"Software", "tensorray 9.9"}});
  EXPECT_THAT(read_bytes(file.path()), HasSubstr("seed 4711"));
  EXPECT_THAT(read_bytes(file.path()), HasSubstr("tensorray 9.9"));
}

TEST_P(EveryEnding, FullDiskIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no device that is always full";
  // The disk becomes full when the file is closed (small picture) and while it is written.
  for (const Image& image : {gradient(), noise_image(512, 512, {"R", "G", "B"})}) {
    const Temporary file("full_disk" + GetParam());
    std::filesystem::create_symlink("/dev/full", file.path());
    EXPECT_EQ(message([&] { write_image(file.path(), image); }),
              "cannot write " + file.path().string() + ": No space left on device");
  }
}

TEST_P(EveryEnding, FilesThatWereCutOffAreRefused) {
  const Temporary whole("whole" + GetParam());
  write_image(whole.path(), noise_image(100, 80, {"R", "G", "B"}));
  const std::string bytes = read_bytes(whole.path());
  for (const double part : {0.001, 0.3, 0.5, 0.9, 0.999}) {
    const Temporary file("cut" + GetParam(),
                         bytes.substr(0, static_cast<std::size_t>(part * static_cast<double>(bytes.size()))));
    ::testing::internal::CaptureStderr();  // Libraries add no lines of their own.
    const std::string text = message([&] { read_image(file.path()); });
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << part;
    EXPECT_THAT(text, HasSubstr("cannot read " + file.path().string() + ": ")) << part;
    EXPECT_THAT(text, Not(::testing::EndsWith(": "))) << part;
  }
}

TEST(ImageTest, TheSamePictureGivesTheSameBytesAtAnyTime) {
  const ImageMetadata metadata{{"ImageDescription", "a scene"}, {"Software", "tensorray"}};
  const auto write_all = [&] {
    std::vector<std::string> files;
    for (const std::string& ending : image_endings()) {
      const Temporary file("any_time" + ending);
      write_image(file.path(), gradient(), metadata);
      files.push_back(read_bytes(file.path()));
    }
    return files;
  };
  const std::vector<std::string> first = write_all();
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // Time stamps have a resolution of one second.
  const std::vector<std::string> second = write_all();
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_TRUE(first[i] == second[i]) << image_endings()[i];
}

TEST(ImageTest, PngKeepsAllMetadataAndIsMarkedAsSrgb) {
  const Temporary file("metadata.PNG");
  write_image(file.path(), gradient(), {{"scene", "{\"x\": 1}"}, {"ImageDescription", "a picture"}});
  EXPECT_THAT(read_bytes(file.path()), HasSubstr(std::string("Description\0a picture", 21)));
  EXPECT_THAT(read_bytes(file.path()), HasSubstr("{\"x\": 1}"));
  EXPECT_THAT(read_bytes(file.path()), HasSubstr("sRGB"));
  write_image(file.path(), gradient(), {{"oiio:ColorSpace", "Rec709"}});
  EXPECT_THAT(read_bytes(file.path()), Not(HasSubstr("sRGB")));
}

TEST(ImageTest, DisplayFormatsClip) {
  for (const std::string ending : {".png", ".tif"}) {
    const Temporary file("clipped" + ending);
    Image image(3, 1, {"R", "G", "B"});
    image.pixels = {-0.5f, 2, 0.25f, std::nanf(""), INFINITY, -INFINITY, 1, 0, 0.5f};
    write_image(file.path(), image);
    const std::vector<float> expected{0, 1, 0.25f, 0, 1, 0, 1, 0, 0.5f}, read = read_image(file.path()).pixels;
    ASSERT_EQ(read.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(read[i], expected[i], 0.51 / 65535) << i;
  }
}

TEST(ImageTest, DisplayFormatsChooseTheirChannels) {
  const auto kept = [](const std::string& ending, const std::vector<std::string>& channels) {
    const Temporary file("channels" + ending);
    const Image image = noise_image(16, 16, channels);
    write_image(file.path(), image);
    const Image read = read_image(file.path());
    const double tolerance = ending == ".jpg" ? 1 : 0.51 / 65535;
    for (std::size_t c = 0; c < read.channels.size(); ++c)
      EXPECT_NEAR(read.pixel(3, 5)[c], image.pixel(3, 5)[c], tolerance) << ending;
    return read.channels.size();
  };
  for (const std::string ending : {".png", ".tif", ".jpg"}) {
    EXPECT_EQ(kept(ending, {"Y"}), 1u);
    EXPECT_EQ(kept(ending, {"Y", "A"}), 1u);
    EXPECT_EQ(kept(ending, {"R", "G", "B"}), 3u);
    EXPECT_EQ(kept(ending, {"R", "G", "B", "A"}), ending == ".jpg" ? 3u : 4u);
    EXPECT_EQ(kept(ending, {"R", "G", "B", "Z"}), 3u);
    EXPECT_EQ(kept(ending, {"R", "G", "B", "A", "Z"}), ending == ".jpg" ? 3u : 4u);
  }
}

TEST(ImageTest, UnknownEndingsAreRefused) {
  const std::string text = message([] { write_image("/tmp/picture.bmpx", gradient()); });
  EXPECT_EQ(text,
            "cannot write /tmp/picture.bmpx: unknown picture ending \".bmpx\"; known: .exr, .png, .jpg, .jpeg, .tif, "
            ".tiff");
  EXPECT_THROW(write_image("/tmp/picture", gradient()), std::runtime_error);
}

}  // namespace
}  // namespace tensorray
