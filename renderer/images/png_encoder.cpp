#include "renderer/images/png_encoder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>

#include <tbb/parallel_for.h>
#include <zlib.h>

namespace tensorray {
namespace {

using Bytes = std::vector<unsigned char>;

constexpr std::size_t strip_bytes = 1 << 18;  // Of rows that are compressed together.
constexpr int level = 6;
constexpr const char* color_space = "oiio:ColorSpace";
constexpr std::size_t longest_name = 79;  // Of a text; the format's limit.

void append(Bytes& bytes, std::uint32_t number) {
  for (const int shift : {24, 16, 8, 0}) bytes.push_back(static_cast<unsigned char>(number >> shift));
}

void append_chunk(Bytes& file, const std::string& type, const Bytes& data) {
  append(file, static_cast<std::uint32_t>(data.size()));
  const std::size_t checked = file.size();
  file.insert(file.end(), type.begin(), type.end());
  file.insert(file.end(), data.begin(), data.end());
  append(file, static_cast<std::uint32_t>(crc32_z(0, &file[checked], file.size() - checked)));
}

Bytes header(const Image& image) {
  const std::size_t channels = image.channels.size();
  Bytes data;
  append(data, static_cast<std::uint32_t>(image.width));
  append(data, static_cast<std::uint32_t>(image.height));
  const unsigned char kind = channels == 1 ? 0 : channels == 3 ? 2 : 6;
  for (const unsigned char byte :
       {std::uint8_t{16}, std::uint8_t{kind}, std::uint8_t{0}, std::uint8_t{0}, std::uint8_t{0}})
    data.push_back(byte);
  return data;
}

/// The names of the format for these attributes; others keep theirs.
std::string text_name(const std::string& attribute) {
  if (attribute == "ImageDescription") return "Description";
  return attribute == "Artist" ? "Author" : attribute;
}

void append_text(Bytes& file, const std::string& attribute, const std::string& text) {
  const std::string name = text_name(attribute);
  if (name.empty() || name.size() > longest_name) return;
  Bytes data(name.begin(), name.end());
  data.push_back(0);
  data.insert(data.end(), text.begin(), text.end());
  append_chunk(file, "tEXt", data);
}

/// Bytes of a row, and of a pixel.
struct RowLayout {
  std::size_t row, pixel;
};

/// A row as 16-bit numbers, high byte first.
void pack_row(const Image& image, int y, Bytes& row) {
  const float* const values = image.pixel(0, y);
  for (std::size_t i = 0; 2 * i < row.size(); ++i) {
    const auto number = static_cast<unsigned>(values[i] * 65535.0f + 0.5f);
    row[2 * i] = static_cast<unsigned char>(number >> 8);
    row[2 * i + 1] = static_cast<unsigned char>(number);
  }
}

int paeth(int left, int up, int corner) {
  const int to_left = std::abs(up - corner), to_up = std::abs(left - corner),
            to_corner = std::abs(left + up - 2 * corner);
  if (to_left <= to_up && to_left <= to_corner) return left;
  return to_up <= to_corner ? up : corner;
}

/// Writes the filter's number and the filtered row. @return the sum of the sizes of its bytes as signed numbers.
template <class Predict>
std::size_t filter_row(int number, const Bytes& row, const Bytes& above, std::size_t pixel, Bytes& to,
                       const Predict& predict) {
  to[0] = static_cast<unsigned char>(number);
  std::size_t sum = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const int left = i < pixel ? 0 : row[i - pixel], corner = i < pixel ? 0 : above[i - pixel];
    const auto rest = static_cast<unsigned char>(row[i] - predict(left, int{above[i]}, corner));
    to[i + 1] = rest;
    sum += static_cast<std::size_t>(std::min<int>(rest, 256 - rest));
  }
  return sum;
}

/// Appends the row by the filter that leaves the smallest sum, as the format recommends.
void append_filtered(const Bytes& row, const Bytes& above, std::size_t pixel, std::array<Bytes, 3>& tries,
                     Bytes& strip) {
  for (Bytes& each : tries) each.resize(row.size() + 1);
  const std::array<std::size_t, 3> sums{
      filter_row(1, row, above, pixel, tries[0], [](int left, int, int) { return left; }),
      filter_row(2, row, above, pixel, tries[1], [](int, int up, int) { return up; }),
      filter_row(4, row, above, pixel, tries[2], paeth)};
  const Bytes& best = tries[static_cast<std::size_t>(std::min_element(sums.begin(), sums.end()) - sums.begin())];
  strip.insert(strip.end(), best.begin(), best.end());
}

/// A part of the compressed data, which ends at a whole byte.
struct Strip {
  Bytes compressed;
  uLong checksum = 0;
  std::size_t size = 0;  // Before compression.
};

/// Runs of equal bytes are all that is looked for: that is several times as fast, and these pictures have little else.
Bytes deflated(const Bytes& bytes, bool is_last) {
  z_stream stream{};
  if (deflateInit2(&stream, level, Z_DEFLATED, -MAX_WBITS, 9, Z_RLE) != Z_OK) throw std::runtime_error("zlib failed");
  Bytes result(deflateBound(&stream, static_cast<uLong>(bytes.size())) + 16);
  stream.next_in = const_cast<Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = result.data();
  stream.avail_out = static_cast<uInt>(result.size());
  const int status = deflate(&stream, is_last ? Z_FINISH : Z_SYNC_FLUSH);
  const bool is_done = stream.avail_in == 0 && status == (is_last ? Z_STREAM_END : Z_OK);
  result.resize(stream.total_out);
  deflateEnd(&stream);
  if (!is_done) throw std::runtime_error("zlib failed");
  return result;
}

Strip compress_rows(const Image& image, int first, int end) {
  const std::size_t pixel = 2 * image.channels.size(), row_bytes = pixel * static_cast<std::size_t>(image.width);
  Bytes above(row_bytes), row(row_bytes), rows;
  rows.reserve(static_cast<std::size_t>(end - first) * (row_bytes + 1));
  std::array<Bytes, 3> tries;
  if (first > 0) pack_row(image, first - 1, above);
  for (int y = first; y < end; ++y) {
    pack_row(image, y, row);
    append_filtered(row, above, pixel, tries, rows);
    std::swap(row, above);
  }
  return {deflated(rows, end == image.height), adler32_z(adler32(0, nullptr, 0), rows.data(), rows.size()),
          rows.size()};
}

/// The picture's rows as a stream of zlib.
Bytes compressed_rows(const Image& image) {
  const std::size_t row_bytes = 2 * image.channels.size() * static_cast<std::size_t>(image.width);
  const int rows = static_cast<int>(std::max<std::size_t>(1, strip_bytes / row_bytes));
  std::vector<Strip> strips(static_cast<std::size_t>((image.height + rows - 1) / rows));
  tbb::parallel_for(std::size_t{0}, strips.size(), [&](std::size_t i) {
    const int first = static_cast<int>(i) * rows;
    strips[i] = compress_rows(image, first, std::min(first + rows, image.height));
  });
  Bytes stream{0x78, 0x5e};
  uLong checksum = adler32(0, nullptr, 0);
  for (const Strip& strip : strips) {
    stream.insert(stream.end(), strip.compressed.begin(), strip.compressed.end());
    checksum = adler32_combine(checksum, strip.checksum, static_cast<z_off_t>(strip.size));
  }
  append(stream, static_cast<std::uint32_t>(checksum));
  return stream;
}

}  // namespace

std::vector<unsigned char> encode_png(const Image& image, const ImageMetadata& metadata) {
  Bytes file{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  append_chunk(file, "IHDR", header(image));
  const auto space = metadata.find(color_space);
  if (space == metadata.end() || space->second == "sRGB") {
    append_chunk(file, "sRGB", {0});  // Perceptual.
    Bytes gamma;
    append(gamma, 45455);  // What sRGB demands for programs that do not know it: 1/2.2.
    append_chunk(file, "gAMA", gamma);
  }
  for (const auto& [name, text] : metadata)
    if (name != color_space) append_text(file, name, text);
  const Bytes rows = compressed_rows(image);
  constexpr std::size_t longest = std::numeric_limits<std::int32_t>::max();  // Of a chunk.
  for (std::size_t at = 0; at < rows.size(); at += longest) {
    const auto begin = rows.begin() + static_cast<std::ptrdiff_t>(at);
    append_chunk(file, "IDAT", {begin, begin + static_cast<std::ptrdiff_t>(std::min(longest, rows.size() - at))});
  }
  append_chunk(file, "IEND", {});
  return file;
}

}  // namespace tensorray
