#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>

#include <png.h>
#include <zlib.h>

#include "base/text/byte_order.h"
#include "base/text/text.h"
#include "renderer/images/formats.h"

namespace tensorray {
namespace {

using Bytes = std::vector<unsigned char>;

constexpr const char* color_space = "oiio:ColorSpace";
constexpr const char* profile = "ICCProfile";
constexpr std::size_t longest_name = 79;  // Of a text; the format's limit.

/// The names of the format for these attributes; others keep theirs.
std::string text_name(const std::string& attribute) {
  if (attribute == "ImageDescription") return "Description";
  return attribute == "Artist" ? "Author" : attribute;
}

/// What is written beside the pixels. libpng reports errors by a jump, over which nothing may be destroyed.
struct Contents {
  int color_type = 0, bits = 16;
  bool is_srgb = true;
  std::string icc_profile;  // Empty: none.
  std::vector<std::pair<std::string, std::string>> texts;
  Bytes row;  // Values of 8 bits, or of 16, high byte first.
};

Contents contents_of(const Image& image, const ImageMetadata& metadata, int bits) {
  Contents contents;
  contents.bits = bits;
  const std::size_t channels = image.channels.size();
  contents.color_type = channels == 1   ? PNG_COLOR_TYPE_GRAY
                        : channels == 3 ? PNG_COLOR_TYPE_RGB
                                        : PNG_COLOR_TYPE_RGB_ALPHA;
  contents.row.resize(static_cast<std::size_t>(bits / 8) * channels * static_cast<std::size_t>(image.width));
  const auto space = metadata.find(color_space);
  contents.is_srgb = space == metadata.end() || space->second == "sRGB";
  if (metadata.count(profile) > 0) contents.icc_profile = metadata.at(profile);
  for (const auto& [name, text] : metadata) {
    const std::string key = text_name(name);
    if (name != color_space && name != profile && !key.empty() && key.size() <= longest_name)
      contents.texts.emplace_back(key, text);
  }
  return contents;
}

void set_row(const Image& image, int y, int bits, Bytes& row) {
  const float* const values = image.pixel(0, y);
  for (std::size_t i = 0; bits == 8 && i < row.size(); ++i)
    row[i] = static_cast<unsigned char>(values[i] * 255.0f + 0.5f);
  for (std::size_t i = 0; bits == 16 && i < row.size(); i += 2) {
    const auto number = static_cast<unsigned>(values[i / 2] * 65535.0f + 0.5f);
    row[i] = static_cast<unsigned char>(number >> 8);
    row[i + 1] = static_cast<unsigned char>(number);
  }
}

bool is_ascii(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x80; });
}

/// @return whether it succeeded.
bool write(png_structp png, png_infop info, const Image& image, Contents& contents, std::vector<png_text>& texts) {
  if (setjmp(png_jmpbuf(png))) return false;
  // The format allows more than libpng does unless it is told so.
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  // Runs of equal bytes are all that is looked for: that is several times as fast, and these pictures have little else.
  png_set_compression_strategy(png, Z_RLE);
  if (contents.bits == 8) png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);  // Trying all takes longer.
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height), contents.bits,
               contents.color_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (contents.is_srgb) png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  if (!contents.icc_profile.empty())
    png_set_iCCP(png, info, "display", PNG_COMPRESSION_TYPE_BASE,
                 reinterpret_cast<png_const_bytep>(contents.icc_profile.data()),
                 static_cast<png_uint_32>(contents.icc_profile.size()));
  png_set_text(png, info, texts.data(), static_cast<int>(texts.size()));
  png_write_info(png, info);
  for (int y = 0; y < image.height; ++y) {
    set_row(image, y, contents.bits, contents.row);
    png_write_row(png, contents.row.data());
  }
  png_write_end(png, info);
  return true;
}

void append(png_structp png, png_bytep data, std::size_t size) {
  auto& file = *static_cast<Bytes*>(png_get_io_ptr(png));
  try {
    file.insert(file.end(), data, data + size);
  } catch (const std::bad_alloc&) {
    png_error(png, "there is not enough memory");
  }
}

[[noreturn]] void keep_error(png_structp png, png_const_charp message) {
  *static_cast<std::string*>(png_get_error_ptr(png)) = message;
  png_longjmp(png, 1);
}

constexpr const char* magic = "\x89PNG\r\n\x1a\n";
constexpr std::uint32_t longest_tag = 64;  // Bytes; those that are read have 1 to 32.
constexpr std::uint32_t piece = 1 << 16;   // Bytes that are read at once.

std::uint32_t number_at(const std::string& bytes, std::size_t at) {
  return read_number<std::uint32_t>(bytes.data() + at, ByteOrder::big);
}

void add_tag(const std::string& name, const std::string& data, ColorTags& tags) {
  if (name == "sRGB" && data.size() == 1) tags.is_srgb = true;
  if (name == "gAMA" && data.size() == 4 && number_at(data, 0) > 0) tags.gamma = number_at(data, 0) / 1e5;
  if (name == "cICP" && data.size() == 4)
    tags.code_points = {static_cast<unsigned char>(data[0]), static_cast<unsigned char>(data[1])};
  if (name != "cHRM" || data.size() != 32) return;
  // White comes first in the file.
  std::array<double, 8>& colors = tags.chromaticities.emplace();
  for (std::size_t i = 0; i < 8; ++i) colors[(i + 6) % 8] = number_at(data, 4 * i) / 1e5;
}

}  // namespace

std::vector<unsigned char> encode_png(const Image& image, const ImageMetadata& metadata, int bits) {
  Contents contents = contents_of(image, metadata, bits);
  std::vector<png_text> texts;
  std::string no_language;
  for (auto& [name, text] : contents.texts) {
    png_text each{};
    each.key = name.data();
    each.text = text.data();
    if (is_ascii(text)) {
      each.compression = PNG_TEXT_COMPRESSION_NONE;
      each.text_length = text.size();
    } else {  // Plain text of the format is Latin-1; this is UTF-8.
      each.compression = PNG_ITXT_COMPRESSION_NONE;
      each.itxt_length = text.size();
      each.lang = each.lang_key = no_language.data();
    }
    texts.push_back(each);
  }
  Bytes file;
  std::string error = "there is not enough memory";
  png_structp png =
      png_create_write_struct(PNG_LIBPNG_VER_STRING, &error, keep_error, [](png_structp, png_const_charp) {});
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  if (png) png_set_write_fn(png, &file, append, [](png_structp) {});
  const bool is_written = info && write(png, info, image, contents, texts);
  png_destroy_write_struct(&png, &info);
  if (!is_written) throw std::runtime_error("the picture cannot be encoded as PNG: " + error);
  return file;
}

std::optional<ColorTags> read_png_chunks(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(8, '\0');
  if (!file.read(bytes.data(), 8) || bytes != magic) return std::nullopt;
  const auto take = [&](std::uint32_t count) {
    bytes.resize(count);
    if (!file.read(bytes.data(), count)) throw std::runtime_error("the file is cut off or damaged");
  };
  const auto add_to_crc = [&](uLong crc, std::size_t first) {
    return crc32(crc, reinterpret_cast<const Bytef*>(bytes.data() + first), static_cast<uInt>(bytes.size() - first));
  };
  ColorTags tags;
  for (std::string type; type != "IEND";) {
    take(8);
    const std::uint32_t size = number_at(bytes, 0);
    type = bytes.substr(4);
    uLong crc = add_to_crc(0, 4);
    for (std::uint32_t left = size; left > 0; left -= std::min(left, piece)) {
      take(std::min(left, piece));
      crc = add_to_crc(crc, 0);
    }
    const std::string data = size <= longest_tag ? bytes.substr(0, size) : std::string();
    take(4);
    const bool is_needed = type[0] >= 'A' && type[0] <= 'Z';  // Others, such as comments, are left out where damaged.
    if (number_at(bytes, 0) == crc)
      add_tag(type, data, tags);
    else if (is_needed)
      throw std::runtime_error("the file is cut off or damaged: its chunk " + escaped(type) + " has another CRC");
  }
  return tags;
}

}  // namespace tensorray
