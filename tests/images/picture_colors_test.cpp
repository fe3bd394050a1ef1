// What picture files say about their colours and their position, and what is made of it.

#include <array>
#include <functional>
#include <tuple>
#include <utility>

#include <lcms2.h>

#include "renderer/color/chromaticities.h"
#include "renderer/color/color.h"
#include "renderer/color/file_colors.h"
#include "renderer/textures/texture.h"
#include "tests/images/picture_files.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

/// The built-in config, whose working space is linear Rec. 709, whatever $OCIO is.
const ColorManagement& color() {
  static const ColorManagement management({builtin_config_word, "", ""});
  return management;
}

/// The mean of a picture in the working space.
Vector3d light_of(const std::string& name, const std::string& content, const std::string& layer = "",
                  std::vector<std::string>* notes = nullptr) {
  const Temporary file(name, content);
  const Texture texture(file, color(), "", Wrap::clamp, layer, notes);
  return texture.lookup({0.5, 0.5}, Matrix2d::Identity()).head<3>().cast<double>();
}

/// A PNG of one pixel with chunks before its pixels.
std::string png_with(const std::string& chunks, const std::vector<int>& rgb) {
  std::string file = png_file(1, 1, 3, 8, rgb);
  return file.insert(file.find("IDAT") - 4, chunks);
}

std::string gamma_chunk(double gamma) { return png_chunk("gAMA", big_endian(static_cast<std::uint32_t>(gamma * 1e5))); }

std::string chromaticities_chunk(const Chromaticities& colors) {
  std::string data;
  for (const Vector2d& place : {colors.white, colors.red, colors.green, colors.blue})
    for (const double number : place) data += big_endian(static_cast<std::uint32_t>(std::lround(number * 1e5)));
  return png_chunk("cHRM", data);
}

std::string profile_chunk(const std::string& profile) {
  return png_chunk("iCCP", std::string("a profile\0\0", 11) + zlib_stored(profile));
}

const Chromaticities p3{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.3127, 0.3290}};
const Vector3d p3_red(1.22494, -0.04206, -0.01964);  // In Rec. 709, as published with the space.

std::vector<float> table_of(const std::function<double(double)>& curve) {
  std::vector<float> table;
  for (int i = 0; i < 4096; ++i) table.push_back(static_cast<float>(curve(i / 4095.0)));
  return table;
}

std::string p3_profile() { return make_icc_profile("P3", p3, table_of(srgb_light)); }

/// XYZ of a colour by a profile.
Vector3d xyz_by(const std::string& profile, const Vector3d& color, bool grey = false) {
  Vector4f pixel(Vector4f::Ones());
  pixel.head<3>() = color.cast<float>();
  icc_to_xyz(profile, grey)(pixel.data(), 1);
  EXPECT_EQ(pixel[3], 1);
  return pixel.head<3>().cast<double>();
}

TEST(PictureColors, PngChunksInTheirOrder) {
  const double half = 128 / 255.0;
  const Vector3d linear = Vector3d::Constant(half), srgb = Vector3d::Constant(srgb_light(half));
  const std::vector<int> grey{128, 128, 128}, red{255, 0, 0};
  const std::string of_p3 = chromaticities_chunk(p3), of_srgb = png_chunk("sRGB", std::string(1, '\0'));
  const std::string code_points = png_chunk("cICP", std::string("\x0c\x0d\0\1", 4));
  using Case = std::tuple<std::string, std::vector<int>, Vector3d>;
  for (const auto& [chunks, rgb, expected] :
       std::vector<Case>{{"", grey, srgb},
                         {gamma_chunk(1), grey, linear},
                         {gamma_chunk(0.5), grey, Vector3d::Constant(half * half)},
                         {gamma_chunk(0.45455), grey, srgb},
                         {of_srgb + gamma_chunk(1), grey, srgb},
                         {of_p3, red, p3_red},
                         {of_p3, grey, srgb},
                         {of_p3 + gamma_chunk(1), {128, 0, 0}, half * p3_red},
                         {of_srgb + of_p3, red, Vector3d(1, 0, 0)},
                         {profile_chunk(p3_profile()), red, p3_red},
                         {profile_chunk(p3_profile()) + of_p3, grey, srgb},
                         {code_points + of_srgb, red, p3_red}}) {
    std::vector<std::string> notes;
    const Vector3d light = light_of("a.png", png_with(chunks, rgb), "", &notes);
    EXPECT_LT((light - expected).cwiseAbs().maxCoeff(), 4e-4) << chunks << "\n" << light.transpose();
    EXPECT_THAT(notes, IsEmpty());
  }
}

TEST(PictureColors, ProfilesThatCannotBeUsedAreSaidAndNotUsed) {
  std::string damaged = p3_profile();
  for (std::size_t at = 0; (at = damaged.find("curv", at)) != std::string::npos;) damaged.replace(at, 4, "none");
  const std::string code_points = png_chunk("cICP", std::string("\x09\x10\0\1", 4));  // Rec. 2020, PQ.
  for (const auto& [chunk, text] : {std::pair(profile_chunk(damaged), "it is damaged, or has no colours"),
                                    {code_points, "code points (primaries 9, curve 16)"}}) {
    std::vector<std::string> notes;
    const Vector3d light = light_of("a.png", png_with(chunk, {255, 0, 0}), "", &notes);
    EXPECT_LT((light - Vector3d(1, 0, 0)).norm(), 1e-5);
    EXPECT_THAT(notes, ElementsAre(HasSubstr(text)));
  }
}

TEST(IccProfileTest, ReadsWhatItWrites) {
  using Curve = double (*)(double);
  for (const Curve curve : {+[](double x) { return std::pow(x, 2.4); }, +[](double x) { return x; }, Curve{srgb_light},
                            +[](double x) { return 0.2 * x + 0.8 * x * x; }}) {
    const std::string profile = make_icc_profile("x", p3, table_of(curve));
    for (double x = 0; x <= 1; x += 1.0 / 32) {
      const Vector3d color(x, 1 - x, 0.5 * x), light = color.unaryExpr(curve);
      EXPECT_LT((xyz_by(profile, color) - rgb_to_xyz(p3) * light).cwiseAbs().maxCoeff(), 2e-3) << x;  // 2.4 is 614/256.
    }
  }
}

TEST(IccProfileTest, DamagedOnesAreRefused) {
  std::string profile = p3_profile();
  for (std::size_t size = 0; size < 400; size += 7)
    EXPECT_THROW(icc_to_xyz(profile.substr(0, size), false), std::runtime_error) << size;
  EXPECT_THROW(icc_to_xyz(profile, true), std::runtime_error);
}

/// A profile of tables: its values are the roots of light in P3.
std::string profile_of_tables() {
  const auto sampler = [](const cmsUInt16Number* in, cmsUInt16Number* out, void*) -> cmsInt32Number {
    const Vector3d light = Vector3d(in[0], in[1], in[2]).unaryExpr([](double x) { return std::pow(x / 65535, 2); });
    const Vector3d d50(0.9642, 1, 0.8249);
    const Vector3d xyz = *adaptation(xyz_of(d65_white()), d50) * rgb_to_xyz(p3) * light;
    const cmsCIEXYZ color{xyz.x(), xyz.y(), xyz.z()};
    cmsCIELab lab;
    cmsXYZ2Lab(nullptr, &lab, &color);
    cmsFloat2LabEncoded(out, &lab);
    return 1;
  };
  cmsHPROFILE profile = cmsCreateProfilePlaceholder(nullptr);
  cmsSetProfileVersion(profile, 4.3);
  cmsSetDeviceClass(profile, cmsSigOutputClass);
  cmsSetColorSpace(profile, cmsSigRgbData);
  cmsSetPCS(profile, cmsSigLabData);
  cmsPipeline* tables = cmsPipelineAlloc(nullptr, 3, 3);
  cmsStage* table = cmsStageAllocCLut16bit(nullptr, 33, 3, 3, nullptr);
  cmsStageSampleCLut16bit(table, sampler, nullptr, 0);
  // The format wants curves before and behind a table.
  for (cmsStage* stage :
       {cmsStageAllocToneCurves(nullptr, 3, nullptr), table, cmsStageAllocToneCurves(nullptr, 3, nullptr)})
    cmsPipelineInsertStage(tables, cmsAT_END, stage);
  cmsWriteTag(profile, cmsSigAToB0Tag, tables);
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string bytes(size, '\0');
  cmsSaveProfileToMem(profile, bytes.data(), &size);
  cmsPipelineFree(tables);
  cmsCloseProfile(profile);
  return bytes;
}

TEST(IccProfileTest, OfTablesAreRead) {
  const std::string profile = profile_of_tables();
  for (const Vector3d& color : {Vector3d(1, 1, 1), Vector3d(0.5, 0, 0), Vector3d(0.3, 0.6, 0.9)}) {
    const Vector3d light = rgb_to_xyz(p3) * color.cwiseAbs2();
    EXPECT_LT((xyz_by(profile, color) - light).cwiseAbs().maxCoeff(), 0.005) << color.transpose();
  }
}

TEST(PictureColors, ChromaticitiesOfExr) {
  const std::string acescg = "0.713 0.293 0.165 0.83 0.128 0.044 0.32168 0.33767";
  using Case = std::tuple<Vector3f, std::string, Vector3d>;
  for (const auto& [rgb, chromaticities, expected] :
       std::vector<Case>{{{0.2f, 0.5f, 4}, "", {0.2, 0.5, 4}},
                         {{0.2f, 0.5f, 4}, "0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329", {0.2, 0.5, 4}},
                         {{0.95046f, 1, 1.08906f}, "1 0 0 1 0 0 0.333333 0.333333", {1, 1, 1}},  // D65.
                         {{1, 1, 1}, acescg, {1, 1, 1}},
                         {{1, 0, 0}, acescg, {1.70505, -0.13026, -0.02400}},
                         {{1, 0, 0}, "0.68 0.32 0.265 0.69 0.15 0.06 0.3127 0.329", p3_red}}) {
    Image image(1, 1, {"R", "G", "B"});
    Vector3f::Map(image.pixel(0, 0)) = rgb;
    ImageMetadata metadata;
    if (!chromaticities.empty()) metadata["chromaticities"] = chromaticities;
    const Vector3d light = light_of("a.exr", exr_bytes(image, metadata));
    EXPECT_LT((light - expected).cwiseAbs().maxCoeff(), 3e-4) << chromaticities << ": " << light.transpose();
  }
}

TEST(PictureColors, WorkingSpacesHaveTheirPublishedNumbers) {
  const std::array<double, 8> rec709{0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};
  EXPECT_EQ(color().working_chromaticities(), rec709);
  const Chromaticities acescg{{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, {0.32168, 0.33767}};
  const Matrix3d adapted = *adaptation(xyz_of(acescg.white), xyz_of(d65_white())) * rgb_to_xyz(acescg);
  EXPECT_EQ(numbers_of(named_chromaticities(adapted)), numbers_of(acescg));
  const Chromaticities odd{{0.7, 0.31}, {0.2, 0.7}, {0.14, 0.05}, d65_white()};
  EXPECT_THAT(numbers_of(named_chromaticities(rgb_to_xyz(odd))),
              testing::Pointwise(testing::DoubleNear(1e-12), numbers_of(odd)));
}

/// A TIFF of RGB integers. @param values  One for each sample.
std::string tiff_of(int width, int height, int bits, int orientation, const std::vector<std::uint32_t>& values,
                    TiffTags more = {}) {
  std::string pixels;
  for (const std::uint32_t value : values) pixels += little_endian(value).substr(0, static_cast<std::size_t>(bits / 8));
  more[274] = {1, orientation};
  return tiff_file(width, height, 3, bits, 2, pixels, more);
}

/// Headers that contradict the pixels, or other headers: no more is read or written than there is.
TEST(PictureSizes, AreThoseOfThePixels) {
  // Only TIFF has integers of 24 bits, whatever a text says.
  const std::string text = png_chunk("tEXt", std::string("oiio:BitsPerSample\0", 19) + "24");
  EXPECT_LT((light_of("a.png", png_with(text, {255, 0, 255})) - Vector3d(1, 0, 1)).norm(), 1e-5);

  const std::vector<std::uint32_t> pixel{255, 0, 255};
  constexpr int full_width = 33300, full_height = 33301;
  for (const std::uint32_t size : {0xffffffffu, 0x80000000u, 0x40000000u}) {
    const std::string damaged = tiff_of(1, 1, 8, 1, pixel, {{full_width, {1, size}}, {full_height, {1, 1}}});
    EXPECT_THAT(message([&] { light_of("a.tif", damaged); }), HasSubstr("it may be damaged")) << size;
  }
}

TEST(PictureColors, IntegersOfAllSizesAreSrgb) {
  for (const int bits : {8, 16, 24, 32})
    for (const double value : {0.5, 0.123, 1.0}) {
      const double greatest = std::pow(2, bits) - 1;
      const auto stored = static_cast<std::uint32_t>(std::floor(value * greatest));
      const Vector3d light = light_of("a.tif", tiff_of(1, 1, bits, 1, {stored, 0, stored}));
      const double expected = srgb_light(stored / greatest);
      EXPECT_LT((light - Vector3d(expected, 0, expected)).norm(), 1e-5) << bits << " " << value;
    }
}

/// The rows of a picture whose greys are letters.
std::string rows_of(const std::string& name, const std::string& content) {
  const Temporary file(name, content);
  const NativeImage image = read_native_image(file);
  std::string rows;
  for (int i = 0; i < image.width * image.height; ++i) {
    float rgba[4];
    read_pixels(image, i % image.width, i / image.width, 1, rgba);
    const double grey = 255 * rgba[1];
    EXPECT_NEAR(grey, std::round(grey), 1e-3);
    rows += static_cast<char>(std::lround(grey));
    if ((i + 1) % image.width == 0) rows += ' ';
  }
  return rows;
}

TEST(PictureOrientation, PicturesStandUpright) {
  // The rows of the stored picture are abc and def.
  const std::vector<std::string> turned{"abc def ",  "cba fed ",  "fed cba ",  "def abc ",
                                        "ad be cf ", "da eb fc ", "fc eb da ", "cf be ad "};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    std::vector<std::uint32_t> values;
    for (std::uint32_t grey = 'a'; grey <= 'f'; ++grey) values.insert(values.end(), 3, grey);
    const std::string rows = rows_of("a.tif", tiff_of(3, 2, 8, orientation, values));
    EXPECT_EQ(rows, turned[static_cast<std::size_t>(orientation - 1)]) << orientation;
  }
  const std::string exif("MM\0*\0\0\0\x08\0\1\x01\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0", 26);
  std::string phone = png_file(2, 1, 1, 8, {'a', 'b'});
  phone.insert(phone.find("IDAT") - 4, png_chunk("eXIf", exif));
  EXPECT_EQ(rows_of("a.png", phone), "a b ");
}

TEST(PictureLayers, AreChosenByName) {
  Image image(1, 1, {"R", "G", "B", "Z", "key.B", "key.G", "key.R", "fill.R", "fill.G", "fill.B", "fill.A"});
  image.pixels = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 1};
  const std::string content = exr_bytes(image);
  EXPECT_EQ(light_of("a.exr", content), Vector3d(1, 2, 3));
  EXPECT_EQ(light_of("a.exr", content, "key"), Vector3d(7, 6, 5));
  EXPECT_EQ(light_of("a.exr", content, "fill"), Vector3d(8, 9, 10));
  EXPECT_EQ(light_of("a.exr", content, "Z"), Vector3d(4, 4, 4));
  EXPECT_THAT(message([&] { light_of("a.exr", content, "rim"); }),
              HasSubstr("it has no layer \"rim\"; its layers: fill, key"));
}

/// A part of an EXR: one pixel. @param channels  In alphabetical order.
struct ExrPart {
  std::string name;
  std::vector<std::string> channels;
  std::vector<float> values;
};

/// A file of several parts; or of one, which has no name.
std::string exr_parts(const std::vector<ExrPart>& parts) {
  const ExrWindow pixel{0, 0, 0, 0};
  if (parts.size() == 1) return exr_file(pixel, pixel, parts[0].channels, parts[0].values);
  std::string file = "\x76\x2f\x31\x01" + little_endian(2 | 0x1000), tables, chunks;
  for (const ExrPart& part : parts) {
    const std::string header = exr_header(pixel, pixel, part.channels);
    file += header.substr(8, header.size() - 9) + exr_attribute("chunkCount", "int", little_endian(1)) +
            exr_attribute("name", "string", part.name) + exr_attribute("type", "string", "scanlineimage") + '\0';
  }
  file += '\0';
  for (std::size_t i = 0; i < parts.size(); ++i) {
    tables += little_endian(static_cast<std::uint64_t>(file.size() + 8 * parts.size() + chunks.size()));
    chunks += little_endian(static_cast<std::int32_t>(i)) + little_endian(0) +
              little_endian(static_cast<std::int32_t>(4 * parts[i].values.size()));
    for (const float value : parts[i].values) chunks += little_endian(value);
  }
  return file + tables + chunks;
}

TEST(PictureLayers, ColoursCountBeforeDepthAndItIsSaid) {
  const ExrPart depth{"depth", {"Z"}, {9}}, plain{"rgba", {"B", "G", "R"}, {3, 2, 1}}, grey{"g", {"Y"}, {7}},
      diffuse{"light", {"diffuse.blue", "diffuse.green", "diffuse.red"}, {6, 5, 4}},
      nuke{"", {"depth.Z", "diffuse.blue", "diffuse.green", "diffuse.red"}, {9, 6, 5, 4}};
  for (const auto& [parts, light, said] : std::vector<std::tuple<std::vector<ExrPart>, Vector3d, std::string>>{
           {{depth, plain}, {1, 2, 3}, "a.exr: its colours are taken from the part \"rgba\"; its layers: depth, rgba"},
           {{plain, depth}, {1, 2, 3}, ""},
           {{plain, {"right", {"B", "G", "R"}, {0, 0, 0}}}, {1, 2, 3}, "the part \"rgba\"; its layers: rgba, right"},
           {{depth, diffuse, plain}, {1, 2, 3}, "the part \"rgba\""},
           {{depth, diffuse}, {4, 5, 6}, "the layer \"diffuse\"; its layers: depth, light, diffuse"},
           {{nuke}, {4, 5, 6}, "the layer \"diffuse\"; its layers: depth, diffuse"},
           {{depth, grey}, {7, 7, 7}, "its grey is taken from the part \"g\""},
           {{depth, {"far", {"Z"}, {8}}}, {9, 9, 9}, ""}}) {
    std::vector<std::string> notes;
    EXPECT_EQ(light_of("a.exr", exr_parts(parts), "", &notes), light) << said;
    ASSERT_EQ(notes.size(), said.empty() ? 0u : 1u) << said;
    EXPECT_THAT(notes.empty() ? said : notes[0], HasSubstr(said));
  }
  EXPECT_EQ(light_of("a.exr", exr_parts({nuke}), "diffuse"), Vector3d(4, 5, 6));
  EXPECT_EQ(light_of("a.exr", exr_parts({depth, diffuse}), "light"), Vector3d(4, 5, 6));
}

TEST(PictureColors, NonFiniteTexelsAreCountedAndSaid) {
  Image image(2, 2, {"R", "G", "B", "Z"});
  image.pixels = {0, NAN, INFINITY, 0, 0, 0, 0, 0, -INFINITY, 0, 0, 0, 0, 0, 0, NAN};  // The last, Z, is not read.
  std::vector<std::string> notes;
  light_of("a.exr", exr_bytes(image), "", &notes);
  EXPECT_THAT(notes, ElementsAre(HasSubstr("a.exr: 2 pixels have values that are not finite")));
}

/// An EXR of 2 x 2 pixels as luminance and chroma, which has one sample for all four.
std::string luminance_chroma(const Vector3d& rgb) {
  const Vector3d weights(0.2126, 0.7152, 0.0722);
  const double luminance = weights.dot(rgb);
  const std::string file = exr_header({0, 0, 1, 1}, {0, 0, 1, 1}, {"BY", "RY", "Y"}, {"BY", "RY"});
  const auto number = [](double value) { return little_endian(static_cast<float>(value)); };
  const std::string pair = number(luminance) + number(luminance);
  const std::string chroma = number(rgb[2] / luminance - 1) + number(rgb[0] / luminance - 1);
  const auto row = [](int y, const std::string& values) {
    return little_endian(y) + little_endian(static_cast<std::int32_t>(values.size())) + values;
  };
  const std::string first = row(0, chroma + pair);
  const std::uint64_t first_at = file.size() + 16;
  return file + little_endian(first_at) + little_endian(first_at + first.size()) + first + row(1, pair);
}

TEST(PictureColors, LuminanceAndChroma) {
  const Vector3d rgb(0.2, 0.5, 0.8);
  EXPECT_LT((light_of("a.exr", luminance_chroma(rgb)) - rgb).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_THAT(message([&] { light_of("a.exr", luminance_chroma(rgb), "key"); }), HasSubstr("cannot read"));
  std::string cut = luminance_chroma(rgb);
  cut.resize(cut.size() - 4);
  EXPECT_THAT(message([&] { light_of("a.exr", cut); }), HasSubstr("cannot read"));
}

/// The displays of the built-in config, and how files for them are marked.
TEST(DisplayEncodingTest, OfEachDisplay) {
  EXPECT_TRUE(color().display_encoding().is_srgb);
  EXPECT_THAT(color().display_encoding().icc_profile, IsEmpty());
  const ColorManagement video({builtin_config_word, "Rec.1886", ""});
  EXPECT_FALSE(video.display_encoding().is_srgb);
  const std::string& profile = video.display_encoding().icc_profile;
  for (const Vector3d& color : {Vector3d(1, 0, 0), Vector3d(0, 0.5, 1), Vector3d(0.1, 0.9, 0.5)}) {
    const Vector3d light = color.unaryExpr([](double x) { return std::pow(x, 2.4); });
    EXPECT_LT((xyz_by(profile, color) - rec709_to_xyz() * light).cwiseAbs().maxCoeff(), 1e-3);
  }
  const ColorManagement raw({builtin_config_word, "sRGB", "Raw"});
  EXPECT_FALSE(raw.display_encoding().is_srgb);
  EXPECT_THAT(raw.display_encoding().icc_profile, IsEmpty());
}

TEST(DisplayEncodingTest, FilesHoldTheProfile) {
  Image image(2, 2, {"R", "G", "B"});
  image.pixels = {1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0};
  const ImageMetadata metadata{{"oiio:ColorSpace", ""}, {"ICCProfile", p3_profile()}};
  for (const auto& [name, tolerance] : {std::pair("a.png", 1e-3), {"a.jpg", 0.02}, {"a.tif", 1e-3}}) {
    const Temporary file(name);
    write_image(file, image, metadata);
    const std::string content = read_bytes(file);
    EXPECT_LT((light_of(std::string("b_") + name, content) - p3_red).norm(), tolerance) << name;
    EXPECT_THAT(content, Not(HasSubstr("sRGB"))) << name;
  }
}

TEST(PngTextTest, OtherScriptsAreUnicode) {
  const Image image(1, 1, {"R", "G", "B"});
  const Temporary plain("plain.png"), foreign("foreign.png");
  write_image(plain, image, {{"Artist", "Mueller"}});
  write_image(foreign, image, {{"Artist", "M\xc3\xbcller \xe5\xbc\xb5"}});
  EXPECT_THAT(read_bytes(plain), HasSubstr(std::string("tEXtAuthor\0Mueller", 18)));
  // Name, no compression, no language, no translated name, text.
  EXPECT_THAT(read_bytes(foreign), HasSubstr(std::string("iTXtAuthor\0\0\0\0\0", 15) + "M\xc3\xbcller \xe5\xbc\xb5"));
}

}  // namespace
}  // namespace tensorray
