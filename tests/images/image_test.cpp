#include "renderer/images/image.h"

#include <chrono>
#include <clocale>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <stdexcept>
#include <thread>

#include <dlfcn.h>

#include "renderer/film/spectral_image.h"
#include "tests/images/picture_files.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

using testing::FloatNear, testing::Pointwise;

/// A picture that is smooth enough for JPEG.
Image gradient() {
  return image_of(64, 48, [](int x, int y) { return Vector3d(x / 63.0, y / 47.0, 0.25); });
}

constexpr float half_step = 0.51f / 65535;  ///< Of 16 bits, and a little more.

class EveryEnding : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(ImageTest, EveryEnding, ::testing::ValuesIn(image_endings()),
                         [](const auto& ending) { return ending.param.substr(1); });

TEST_P(EveryEnding, ReadsBackPicturesAndDescriptions) {
  const Temporary file("there_and_back" + GetParam());
  const Image image = gradient();
  write_image(file, image, {{"ImageDescription", "seed 4711"}, {"Software", "tensorray 9.9"}});
  EXPECT_THAT(read_bytes(file), AllOf(HasSubstr("seed 4711"), HasSubstr("tensorray 9.9")));
  const Image read = read_image(file);
  EXPECT_EQ(std::tie(read.width, read.height, read.channels), std::tie(image.width, image.height, image.channels));
  // The error of JPEG at this quality is a few steps.
  const float tolerance = GetParam() == ".exr" ? 0 : GetParam()[1] == 'j' ? 5 / 255.0f : half_step;
  EXPECT_THAT(read.pixels, Pointwise(FloatNear(tolerance), image.pixels));
}

TEST_P(EveryEnding, FilesThatWereCutOffAreRefused) {
  const Temporary whole("whole" + GetParam());
  write_image(whole, noise_image(100, 80));
  const std::string bytes = read_bytes(whole);
  for (const double part : {0.001, 0.3, 0.5, 0.9, 0.999}) {
    const Temporary file("cut" + GetParam(), first_part(bytes, part));
    ::testing::internal::CaptureStderr();  // Libraries add no lines of their own.
    const std::string text = message([&] { read_image(file); });
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << part;
    EXPECT_THAT(text, AllOf(HasSubstr("cannot read " + file.string() + ": "), Not(EndsWith(": ")))) << part;
  }
}

TEST(ImageTest, TheSamePictureGivesTheSameBytesAtAnyTime) {
  const ImageMetadata metadata{{"ImageDescription", "a scene"}, {"Software", "tensorray"}};
  const auto write_all = [&] {
    std::map<std::string, std::size_t> hashes;
    for (const std::string& ending : image_endings()) {
      const Temporary file("any_time" + ending);
      write_image(file, gradient(), metadata);
      hashes[ending] = std::hash<std::string>()(read_bytes(file));
    }
    return hashes;
  };
  const auto first = write_all();
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // Time stamps have a resolution of one second.
  EXPECT_EQ(write_all(), first);
}

TEST(ImageTest, PngKeepsAllMetadataAndIsMarkedAsSrgb) {
  const Temporary file("metadata.PNG");
  write_image(file, gradient(), {{"scene", "{\"x\": 1}"}, {"ImageDescription", "a picture"}});
  EXPECT_THAT(read_bytes(file),
              AllOf(HasSubstr(std::string("Description\0a picture", 21)), HasSubstr("{\"x\": 1}"), HasSubstr("sRGB")));
  write_image(file, gradient(), {{"oiio:ColorSpace", "Rec709"}});
  EXPECT_THAT(read_bytes(file), Not(HasSubstr("sRGB")));
}

TEST(ImageTest, DisplayFormatsClip) {
  for (const std::string ending : {".png", ".tif"}) {
    const Temporary file("clipped" + ending);
    Image image(3, 1, {"R", "G", "B"});
    image.pixels = {-0.5f, 2, 0.25f, std::nanf(""), INFINITY, -INFINITY, 1, 0, 0.5f};
    write_image(file, image);
    const std::vector<float> expected{0, 1, 0.25f, 0, 1, 0, 1, 0, 0.5f};
    EXPECT_THAT(read_image(file).pixels, Pointwise(FloatNear(half_step), expected)) << ending;
  }
}

TEST(ImageTest, DisplayFormatsChooseTheirChannels) {
  const auto kept = [](const std::string& ending, const std::vector<std::string>& channels) {
    const Temporary file("channels" + ending);
    const Image image = noise_image(16, 16, channels);
    write_image(file, image);
    const Image read = read_image(file);
    const double tolerance = ending == ".jpg" ? 1 : half_step;
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
  EXPECT_EQ(message([] { write_image("/tmp/a.bmpx", gradient()); }),
            "cannot write /tmp/a.bmpx: unknown picture ending \".bmpx\"; known: .exr, .png, .jpg, .jpeg, .tif, .tiff");
  EXPECT_THROW(write_image("/tmp/picture", gradient()), std::runtime_error);
}

/// A picture whose values are all different, and beside them those that are not numbers.
Image picture(int width, int height, std::vector<std::string> channels) {
  Image image(width, height, std::move(channels));  // A ramp, which compresses well.
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = 0.37f * static_cast<float>(i) - 100;
  const std::vector<float> odd{NAN, INFINITY, -INFINITY, -0.0f, 1e-42f, -100, 1e38f};
  std::copy_n(odd.begin(), std::min(odd.size(), image.pixels.size()), image.pixels.begin());
  return image;
}

TEST(ExrEncoderTest, PicturesAreReadBackBitForBit) {
  // OpenImageIO gives R, G, B, A first, and the others in alphabetical order.
  using Names = std::vector<std::string>;
  for (const Names& channels : {Names{"Y"},
                                {"R", "G", "B"},
                                {"R", "G", "B", "A"},
                                {"R", "G", "B", "A", "Z", "albedo.R", "normal.X", "sun.R"},
                                {"R", "G", "B", "S0.423,750000nm", "S0.511,250000nm"}})
    for (const auto& [width, height] : {std::pair(1, 1), {5, 16}, {70, 37}}) {
      const Image image = picture(width, height, channels);
      const Temporary file("picture.exr", exr_bytes(image));
      const Image read = read_image(file);
      ASSERT_EQ(std::tie(read.channels, read.width, read.height), std::tie(channels, width, height));
      EXPECT_EQ(std::memcmp(read.pixels.data(), image.pixels.data(), sizeof(float) * image.pixels.size()), 0);
    }
}

TEST(ExrEncoderTest, MetadataThatTheFormatHasNoPlaceForIsLeftOut) {
  const Image image = picture(2, 2, {"R", "G", "B"});
  const std::string plain = exr_bytes(image);
  for (const std::string name : {"", "channels", "dataWindow", "capDate", "type", "oiio:ColorSpace"})
    EXPECT_TRUE(exr_bytes(image, {{name, "text"}}) == plain) << name;
}

TEST(ExrEncoderTest, ChannelsOfTheSameNameAreAllWritten) {
  const std::string name(255, 'n');  // The format's limit.
  const Temporary file("names.exr", exr_bytes(picture(3, 2, {"R", "G", "B", "R", "", name + "1", name + "2"})));
  EXPECT_THAT(read_image(file).channels, ElementsAre("R", "G", "B", "channel3", "channel4", "channel6", name));
}

TEST(ExrEncoderTest, PicturesThatAreTooLargeAreErrors) {
  Image image = picture(1, 1, {"R"});
  image.width = 1 << 30;
  EXPECT_THAT(message([&] { exr_bytes(image); }), HasSubstr("cannot be encoded as EXR: "));
}

/// In a process of its own, as other tests load it.
TEST(ExrEncoderDeathTest, WritingDoesNotLoadOpenImageIO) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto is_loaded = [] { return dlopen("libtensorray_pictures.so", RTLD_LAZY | RTLD_NOLOAD) != nullptr; };
  const auto write = [&](const std::string& ending) {
    const Temporary file("alone" + ending);
    prepare_images({file});
    write_image(file, Image(3, 3, {"R", "G", "B"}));
    return is_loaded();
  };
  EXPECT_EXIT(std::exit(write(".exr") || write(".png") || !write(".tif")), ::testing::ExitedWithCode(0), "");
}

Film counting_film(int width, int height, int channels) {
  Film film(width, height, channels);
  for (std::size_t i = 0; i < film.values.size(); ++i) film.values[i] = 0.25 * static_cast<double>(i);
  return film;
}

TEST(LinearImageTest, EqualsTheSumOverBands) {
  std::vector<Band> bands(2);
  bands[0].xyz = {1, 2, 3};
  bands[1].xyz = {0, 0.5, 0};
  Matrix3d matrix;
  matrix << 1, 0, 0, 0, 0, 1, 0, 2, 0;
  const Image image = linear_image(counting_film(4, 3, 2), bands, matrix);
  for (int i = 0; i < 4 * 3; ++i) {
    const Vector3d expected = matrix * (0.25 * i * bands[0].xyz + 0.25 * (12 + i) * bands[1].xyz);
    EXPECT_EQ(Vector3f(image.pixel(i % 4, i / 4)), Vector3f(expected.cast<float>())) << i;
  }
}

TEST(SpectralImageTest, FollowsTheLayout) {
  const std::vector<Band> bands = make_bands(illuminant("D65"), 380, 730, 4);
  const Film film = counting_film(4, 3, 4);
  const SpectralImage spectral = spectral_image(film, bands, SpectralQuantity::irradiance, 10, Matrix3d::Identity());
  EXPECT_THAT(spectral.image.channels,
              ElementsAre("R", "G", "B", "S0.423,750000nm", "S0.511,250000nm", "S0.598,750000nm", "S0.686,250000nm"));
  EXPECT_EQ(spectral.metadata.at("spectralLayoutVersion"), "1.0");
  EXPECT_EQ(spectral.metadata.at("emissiveUnits"), "W.m^-2.nm^-1");
  const SpectralImage radiance = spectral_image(film, bands, SpectralQuantity::radiance, 10, Matrix3d::Identity());
  EXPECT_EQ(radiance.metadata.at("emissiveUnits"), "W.m^-2.sr^-1.nm^-1");
  EXPECT_EQ(radiance.image.pixels, spectral.image.pixels);
  const Image rgb = linear_image(film, bands, Matrix3d::Identity());
  for (int k = 0; k < 4; ++k) {
    const double expected = film.plane(k)[6] * 10 * bands[k].power / bands[k].width;
    EXPECT_FLOAT_EQ(spectral.image.pixel(2, 1)[3 + k], static_cast<float>(expected));
  }
  for (int c = 0; c < 3; ++c) EXPECT_EQ(spectral.image.pixel(2, 1)[c], rgb.pixel(2, 1)[c]);
}

TEST(SpectralImageTest, NamesHaveSixDecimalsInEveryLocale) {
  std::vector<Band> bands(3);
  bands[0].wavelength = 380;
  bands[1].wavelength = 1000 / 3.0;
  bands[2].wavelength = 1250.0000004;
  const char* const changed = std::setlocale(LC_NUMERIC, "de_DE.UTF-8");  // Null if the locale is not installed.
  for (Band& band : bands) band.width = 1;
  const Image image = spectral_image(Film(1, 1, 3), bands, SpectralQuantity::irradiance, 1, Matrix3d::Identity()).image;
  std::setlocale(LC_NUMERIC, "C");
  EXPECT_THAT(image.channels, ElementsAre("R", "G", "B", "S0.380,000000nm", "S0.333,333333nm", "S0.1250,000000nm"))
      << (changed ? changed : "C");
}

TEST(ImageDistance, IsAPartOfTheExactPicture) {
  Image exact(2, 1, {"R"}), other(2, 1, {"R"});
  exact.pixels = {3, 4};
  other.pixels = {3, 5};
  EXPECT_DOUBLE_EQ(relative_distance(other, exact), 0.2);
  EXPECT_EQ(relative_distance(exact, exact), 0);
  Image more(1, 1, {"R", "G", "B", "folds"});
  more.pixels = {1, 1, 1, 8};
  Image less = more;
  less.pixels.back() = 2;
  EXPECT_EQ(relative_distance(more, less), 0) << "only colours count";
  EXPECT_EQ(relative_distance(exact, Image(2, 1, {"R"})), 0);
  EXPECT_THROW(relative_distance(exact, Image(1, 2, {"R"})), std::invalid_argument);
  EXPECT_THROW(relative_distance(exact, Image(2, 1, {"R", "G"})), std::invalid_argument);
}

}  // namespace
}  // namespace tensorray
