#pragma once
/// @file tests/images/picture_files.h
/// Picture files made byte by byte, for features that readers must support but that write_image does not use.

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace tensorray {

/// The bytes of a number, least significant first.
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
  std::uint32_t crc = 0xFFFFFFFF;
  for (const unsigned char byte : name + data) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0xEDB88320 : 0);
  }
  return big_endian(static_cast<std::uint32_t>(data.size())) + name + data + big_endian(~crc);
}

/// Wraps data in the container of Deflate (zlib), without compression.
inline std::string zlib_stored(const std::string& data) {
  constexpr std::size_t longest = 65535;
  std::string result = "\x78\x01";
  for (std::size_t begin = 0; begin < data.size(); begin += longest) {
    const std::string block = data.substr(begin, longest);
    const auto size = static_cast<std::uint16_t>(block.size());
    result += (begin + longest >= data.size() ? '\1' : '\0') + little_endian(size) +
              little_endian(static_cast<std::uint16_t>(~size)) + block;
  }
  std::uint32_t a = 1, b = 0;
  for (const unsigned char byte : data) {
    a = (a + byte) % 65521;
    b = (b + a) % 65521;
  }
  return result + big_endian(b << 16 | a);
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

/// An RGB TIFF of 64 x 64 pixels of 8 bits in eight strips, whose directory is in front of them. @param is_deflated
/// Each strip is a stream of zlib. @param first_strip  Where the directory says that the first strip is; 0: where it
/// is.
inline std::string striped_tiff(bool is_deflated, std::uint32_t first_strip = 0) {
  const auto entry = [](int tag, int type, std::uint32_t count, std::uint32_t value) {
    return little_endian(static_cast<std::uint16_t>(tag)) + little_endian(static_cast<std::uint16_t>(type)) +
           little_endian(count) + little_endian(value);
  };
  constexpr std::uint32_t strips = 8, rows = 8, bits_at = 122, offsets_at = 128, counts_at = offsets_at + 4 * strips;
  std::string strip(64 * rows * 3, '\0');
  for (std::size_t i = 0; i < strip.size(); ++i) strip[i] = static_cast<char>(100 + i * i % 101);
  if (is_deflated) strip = zlib_stored(strip);
  const auto size = static_cast<std::uint32_t>(strip.size());
  std::string file = std::string("II*\0\x08\0\0\0\x09\0", 10);
  file +=
      entry(256, 4, 1, 64) + entry(257, 4, 1, 64) + entry(258, 3, 3, bits_at) + entry(259, 3, 1, is_deflated ? 8 : 1);
  file += entry(262, 3, 1, 2) + entry(273, 4, strips, offsets_at) + entry(277, 3, 1, 3) + entry(278, 4, 1, rows);
  file += entry(279, 4, strips, counts_at) + std::string(4, '\0');
  for (int i = 0; i < 3; ++i) file += little_endian(std::uint16_t{8});
  for (std::uint32_t i = 0; i < strips; ++i)
    file += little_endian(i == 0 && first_strip > 0 ? first_strip : counts_at + 4 * strips + i * size);
  for (std::uint32_t i = 0; i < strips; ++i) file += little_endian(size);
  for (std::uint32_t i = 0; i < strips; ++i) file += strip;
  return file;
}

/// A TIFF of one row of 8-bit values. @param photometric  2: RGB, 5: CMYK. @param extra  Meaning of the channel after
/// the colours. 0: there is none, 1: alpha, colours multiplied by it, 2: alpha, colours not multiplied by it.
inline std::string tiff_file(int width, int channels, int photometric, int extra, const std::string& values) {
  const auto entry = [](int tag, int type, std::uint32_t count, std::uint32_t value) {
    return little_endian(static_cast<std::uint16_t>(tag)) + little_endian(static_cast<std::uint16_t>(type)) +
           little_endian(count) + little_endian(value);
  };
  constexpr std::uint32_t bits_at = 8, pixels_at = 16;
  const auto size = static_cast<std::uint32_t>(values.size()), directory_at = pixels_at + size + size % 2;
  std::string file = std::string("II*\0", 4) + little_endian(directory_at);
  for (int i = 0; i < 4; ++i) file += little_endian(std::uint16_t{8});
  file += values + std::string(size % 2, '\0') + little_endian(static_cast<std::uint16_t>(extra ? 10 : 9));
  file += entry(256, 4, 1, width) + entry(257, 4, 1, 1);
  file += channels == 4 ? entry(258, 3, 4, bits_at) : entry(258, 3, 3, bits_at);
  file += entry(259, 3, 1, 1) + entry(262, 3, 1, photometric) + entry(273, 4, 1, pixels_at);
  file += entry(277, 3, 1, channels) + entry(278, 4, 1, 1) + entry(279, 4, 1, size);
  if (extra) file += entry(338, 3, 1, extra);
  return file + little_endian(std::uint32_t{0});
}

/// Bounds of pixels, both inclusive, as in OpenEXR.
struct ExrWindow {
  int x0, y0, x1, y1;
};

/// An uncompressed OpenEXR file of 32-bit floats.
/// @param channels  Names in alphabetical order.
/// @param values    For each row of the data window, for each channel, its values along the row.
inline std::string exr_file(const ExrWindow& display, const ExrWindow& data, const std::vector<std::string>& channels,
                            const std::vector<float>& values) {
  const std::string zero(1, '\0');
  const auto attribute = [&](const std::string& name, const std::string& type, const std::string& value) {
    return name + zero + type + zero + little_endian(static_cast<std::int32_t>(value.size())) + value;
  };
  const auto box = [](const ExrWindow& w) {
    return little_endian(w.x0) + little_endian(w.y0) + little_endian(w.x1) + little_endian(w.y1);
  };
  std::string list;
  for (const std::string& name : channels)
    list += name + zero + little_endian(2) + little_endian(0) + little_endian(1) + little_endian(1);
  std::string file = "\x76\x2f\x31\x01" + little_endian(2) + attribute("channels", "chlist", list + zero) +
                     attribute("compression", "compression", zero) + attribute("dataWindow", "box2i", box(data)) +
                     attribute("displayWindow", "box2i", box(display)) + attribute("lineOrder", "lineOrder", zero) +
                     attribute("pixelAspectRatio", "float", little_endian(1.0f)) +
                     attribute("screenWindowCenter", "v2f", little_endian(0.0f) + little_endian(0.0f)) +
                     attribute("screenWindowWidth", "float", little_endian(1.0f)) + zero;
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
