#pragma once
/// Pictures for tests, and picture files made byte by byte, for features that readers must support but that write_image
/// does not use.

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <zlib.h>

#include "renderer/images/formats.h"

namespace tensorray {

/// A picture whose values are all different and within [0, 1], and which compresses badly.
inline Image noise_image(int width, int height, std::vector<std::string> channels = {"R", "G", "B"}) {
  Image image(width, height, std::move(channels));
  std::uint32_t state = 1;
  for (float& value : image.pixels)
    value = static_cast<float>((state = state * 1664525u + 1013904223u) >> 8) * 0x1p-24f;
  return image;
}

/// What is left of a file that was cut off. @param part  From 0 to 1.
inline std::string first_part(const std::string& bytes, double part) {
  return bytes.substr(0, static_cast<std::size_t>(part * static_cast<double>(bytes.size())));
}

inline std::string exr_bytes(const Image& image, const ImageMetadata& metadata = {}) {
  const std::vector<unsigned char> bytes = encode_exr(image, metadata, 1);
  return {bytes.begin(), bytes.end()};
}

/// A picture whose pixel (x, y) has this colour.
template <class Color>
Image image_of(int width, int height, const Color& color) {
  Image image(width, height, {"R", "G", "B"});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) Eigen::Vector3f::Map(image.pixel(x, y)) = color(x, y).template cast<float>();
  return image;
}

/// The bytes of a number, or of several, each with the least significant byte first.
template <class Number>
std::string little_endian(Number number) {
  std::string bytes(sizeof(Number), '\0');
  std::memcpy(&bytes[0], &number, sizeof(Number));
  return bytes;
}

inline std::string big_endian(std::uint32_t number) {
  const std::string bytes = little_endian(number);
  return {bytes.rbegin(), bytes.rend()};
}

inline std::string png_chunk(const std::string& name, const std::string& data) {
  const std::string summed = name + data;
  const uLong sum = crc32(0, reinterpret_cast<const Bytef*>(summed.data()), static_cast<uInt>(summed.size()));
  return big_endian(static_cast<std::uint32_t>(data.size())) + summed + big_endian(static_cast<std::uint32_t>(sum));
}

/// Wraps data in the container of Deflate (zlib), without compression.
inline std::string zlib_stored(const std::string& data) {
  uLongf size = compressBound(data.size());
  std::string result(size, '\0');
  compress2(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(data.data()), data.size(),
            Z_NO_COMPRESSION);
  result.resize(size);
  return result;
}

/// A PNG of 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 (RGBA) channels of 8 or 16 bits. `values` are row by row from the
/// top.
inline std::string png_file(int width, int height, int channels, int bits, const std::vector<int>& values) {
  std::string rows;
  for (std::size_t i = 0; i < values.size(); ++i) {
    // Filter type 0: no prediction in this row.
    if (i % (static_cast<std::size_t>(width) * channels) == 0) rows += '\0';
    if (bits == 16) rows += static_cast<char>(values[i] >> 8);
    rows += static_cast<char>(values[i]);
  }
  const char color_type[] = {0, 4, 2, 6};
  const std::string header = big_endian(width) + big_endian(height) + static_cast<char>(bits) +
                             color_type[channels - 1] + std::string(3, '\0');
  return "\x89PNG\r\n\x1A\n" + png_chunk("IHDR", header) + png_chunk("IDAT", zlib_stored(rows)) + png_chunk("IEND", "");
}

/// Tags of a TIFF: how many 32-bit numbers each has, and the number, or the place of the numbers.
using TiffTags = std::map<int, std::array<std::int64_t, 2>>;

inline std::string tiff_directory(const TiffTags& tags) {
  std::string directory = little_endian(static_cast<std::uint16_t>(tags.size()));
  for (const auto& [tag, numbers] : tags)
    directory += little_endian(static_cast<std::uint16_t>(tag)) + little_endian(std::uint16_t{4}) +
                 little_endian(static_cast<std::uint32_t>(numbers[0])) +
                 little_endian(static_cast<std::uint32_t>(numbers[1]));
  return directory + little_endian(std::uint32_t{0});
}

/// A TIFF of one strip. @param photometric  1: grey, 2: RGB, 5: CMYK.
/// @param more  Further tags, such as 338: the meaning of the channel after the colours (1: alpha, colours multiplied
/// by it, 2: alpha, colours not multiplied by it).
inline std::string tiff_file(int width, int height, int channels, int bits, int photometric, const std::string& pixels,
                             const TiffTags& more = {}) {
  constexpr int bits_at = 8, pixels_at = 24;
  const auto size = static_cast<std::int64_t>(pixels.size());
  TiffTags tags{{256, {1, width}},    {257, {1, height}},      {258, {channels, bits_at}},
                {259, {1, 1}},        {262, {1, photometric}}, {273, {1, pixels_at}},
                {277, {1, channels}}, {278, {1, height}},      {279, {1, size}}};
  tags.insert(more.begin(), more.end());
  std::string file = std::string("II*\0", 4) + little_endian(static_cast<std::uint32_t>(pixels_at + size + size % 2));
  for (int i = 0; i < 4; ++i) file += little_endian(static_cast<std::uint32_t>(bits));
  return file + pixels + std::string(pixels.size() % 2, '\0') + tiff_directory(tags);
}

/// An RGB TIFF of 64 x 64 pixels of 8 bits in eight strips, whose directory is in front of them.
/// @param is_deflated  Each strip is a stream of zlib.
/// @param first_strip  Where the directory says that the first strip is; 0: where it is.
inline std::string striped_tiff(bool is_deflated, std::uint32_t first_strip = 0) {
  constexpr std::uint32_t strips = 8, rows = 8, bits_at = 122, offsets_at = bits_at + 12, counts_at = offsets_at + 32;
  std::string strip(64 * rows * 3, '\0');
  for (std::size_t i = 0; i < strip.size(); ++i) strip[i] = static_cast<char>(100 + i * i % 101);
  if (is_deflated) strip = zlib_stored(strip);
  const auto size = static_cast<std::uint32_t>(strip.size());
  const int compression = is_deflated ? 8 : 1;
  const TiffTags tags{{256, {1, 64}},          {257, {1, 64}},   {258, {3, bits_at}},
                      {259, {1, compression}}, {262, {1, 2}},    {273, {strips, offsets_at}},
                      {277, {1, 3}},           {278, {1, rows}}, {279, {strips, counts_at}}};
  std::string file = std::string("II*\0\x08\0\0\0", 8) + tiff_directory(tags);
  for (int i = 0; i < 3; ++i) file += little_endian(std::uint32_t{8});
  for (std::uint32_t i = 0; i < strips; ++i)
    file += little_endian(i == 0 && first_strip > 0 ? first_strip : counts_at + 4 * strips + i * size);
  for (std::uint32_t i = 0; i < strips; ++i) file += little_endian(size);
  for (std::uint32_t i = 0; i < strips; ++i) file += strip;
  return file;
}

/// Bounds of pixels, both inclusive, as in OpenEXR.
struct ExrWindow {
  int x0, y0, x1, y1;
};

inline std::string exr_attribute(const std::string& name, const std::string& type, const std::string& value) {
  const std::string zero(1, '\0');
  return name + zero + type + zero + little_endian(static_cast<std::int32_t>(value.size())) + value;
}

/// The header of an uncompressed OpenEXR file of 32-bit floats.
/// @param channels  In alphabetical order.
/// @param halved    Those that have a sample for every second pixel along x and y.
inline std::string exr_header(const ExrWindow& display, const ExrWindow& data, const std::vector<std::string>& channels,
                              const std::set<std::string>& halved = {}) {
  const std::string zero(1, '\0');
  std::string list;
  for (const std::string& name : channels) {
    const int step = halved.count(name) > 0 ? 2 : 1;
    list += name + zero + little_endian(2) + little_endian(0) + little_endian(step) + little_endian(step);
  }
  return "\x76\x2f\x31\x01" + little_endian(2) + exr_attribute("channels", "chlist", list + zero) +
         exr_attribute("compression", "compression", zero) + exr_attribute("dataWindow", "box2i", little_endian(data)) +
         exr_attribute("displayWindow", "box2i", little_endian(display)) +
         exr_attribute("lineOrder", "lineOrder", zero) +
         exr_attribute("pixelAspectRatio", "float", little_endian(1.0f)) +
         exr_attribute("screenWindowCenter", "v2f", little_endian(0.0f) + little_endian(0.0f)) +
         exr_attribute("screenWindowWidth", "float", little_endian(1.0f)) + zero;
}

/// @param channels  Names in alphabetical order.
/// @param values    For each row of the data window, for each channel, its values along the row.
inline std::string exr_file(const ExrWindow& display, const ExrWindow& data, const std::vector<std::string>& channels,
                            const std::vector<float>& values) {
  std::string file = exr_header(display, data, channels);
  const std::size_t rows = data.y1 - data.y0 + 1, row_values = values.size() / rows, row_bytes = row_values * 4;
  const std::size_t rows_at = file.size() + rows * 8;
  for (std::size_t row = 0; row < rows; ++row)
    file += little_endian(static_cast<std::uint64_t>(rows_at + row * (row_bytes + 8)));
  for (std::size_t row = 0; row < rows; ++row) {
    file += little_endian(data.y0 + static_cast<int>(row)) + little_endian(static_cast<std::int32_t>(row_bytes));
    file.append(reinterpret_cast<const char*>(&values[row * row_values]), row_bytes);
  }
  return file;
}

}  // namespace tensorray
