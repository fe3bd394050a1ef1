#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>

#include <zlib.h>

#include "base/text/byte_order.h"
#include "base/text/text.h"
#include "renderer/images/formats.h"

namespace tensorray {
namespace {

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
