#include <cmath>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "renderer/images/formats.h"
#include "tests/images/picture_files.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A picture whose values are all different, and beside them those that are not numbers.
Image picture(int width, int height, std::vector<std::string> channels) {
  Image image(width, height, std::move(channels));
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = 0.37f * static_cast<float>(i) - 100;
  const std::vector<float> odd{NAN, INFINITY, -INFINITY, -0.0f, 1e-42f};
  for (std::size_t i = 0; i < std::min(odd.size(), image.pixels.size()); ++i) image.pixels[i] = odd[i];
  return image;
}

std::string file_of(const Image& image, const ImageMetadata& metadata = {}, int threads = 1) {
  const std::vector<unsigned char> bytes = encode_exr(image, metadata, threads);
  return {bytes.begin(), bytes.end()};
}

TEST(ExrEncoderTest, PicturesAreReadBackBitForBit) {
  // OpenImageIO gives R, G, B, A first, and the others in alphabetical order.
  for (const std::vector<std::string>& channels :
       {std::vector<std::string>{"Y"}, std::vector<std::string>{"R", "G", "B"},
        std::vector<std::string>{"R", "G", "B", "A"},
        std::vector<std::string>{"R", "G", "B", "A", "Z", "albedo.R", "normal.X", "sun.R"},
        std::vector<std::string>{"R", "G", "B", "S0.423,750000nm", "S0.511,250000nm"}})
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(5, 16), std::pair(70, 37)}) {
      const Image image = picture(width, height, channels);
      const Temporary file("picture.exr", file_of(image));
      const Image read = read_image(file.path());
      ASSERT_EQ(read.channels, channels);
      ASSERT_EQ(read.width, width);
      ASSERT_EQ(read.height, height);
      EXPECT_EQ(std::memcmp(read.pixels.data(), image.pixels.data(), sizeof(float) * image.pixels.size()), 0);
    }
}

TEST(ExrEncoderTest, MetadataThatTheFormatHasNoPlaceForIsLeftOut) {
  const Image image = picture(2, 2, {"R", "G", "B"});
  const std::string plain = file_of(image);
  for (const std::string name : {"", "channels", "dataWindow", "capDate", "type", "oiio:ColorSpace"})
    EXPECT_TRUE(file_of(image, {{name, "text"}}) == plain) << name;
}

TEST(ExrEncoderTest, ChannelsOfTheSameNameAreAllWritten) {
  const std::string name(300, 'n');
  const Temporary file("names.exr", file_of(picture(3, 2, {"R", "G", "B", "R", "", name + "1", name + "2"})));
  EXPECT_EQ(read_image(file.path()).channels,
            (std::vector<std::string>{"R", "G", "B", "channel3", "channel4", "channel6", name.substr(0, 255)}));
}

TEST(ExrEncoderTest, AnyNumberOfThreadsGivesTheSameBytes) {
  const Image image = picture(300, 200, {"R", "G", "B", "A"});
  const std::string one = file_of(image, {}, 1);
  for (const int threads : {2, 5, 0}) EXPECT_TRUE(file_of(image, {}, threads) == one) << threads;
}

TEST(ExrEncoderTest, PicturesThatAreTooLargeAreErrors) {
  Image image = picture(1, 1, {"R"});
  image.width = 1 << 30;
  EXPECT_THAT(message([&] { encode_exr(image, {}, 1); }), HasSubstr("cannot be encoded as EXR: "));
}

/// In a process of its own, as other tests load it.
TEST(ExrEncoderDeathTest, WritingDoesNotLoadOpenImageIO) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto is_loaded = [] { return dlopen("libtensorray_pictures.so", RTLD_LAZY | RTLD_NOLOAD) != nullptr; };
  const auto write = [&](const std::string& ending) {
    const Temporary file("alone" + ending);
    prepare_images({file.path()});
    write_image(file.path(), Image(3, 3, {"R", "G", "B"}));
    return is_loaded();
  };
  EXPECT_EXIT(std::exit(write(".exr") || write(".png") || !write(".tif")), ::testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace tensorray
