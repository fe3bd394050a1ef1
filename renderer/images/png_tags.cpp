#include "renderer/images/png_tags.h"

#include <cstdint>
#include <fstream>
#include <vector>

#include "base/text/byte_order.h"

namespace tensorray {
namespace {

constexpr std::uint32_t longest_tag = 64;  // Bytes; those that are read have 1 to 32.

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

void add_png_tags(const std::filesystem::path& path, ColorTags& tags) {
  std::ifstream file(path, std::ios::binary);
  std::string head(8, '\0');
  if (!file.read(&head[0], 8) || head != "\x89PNG\r\n\x1a\n") return;
  while (file.read(&head[0], 8)) {
    const std::uint32_t size = number_at(head, 0);
    const std::string name = head.substr(4);
    if (name == "IDAT") return;  // All of these chunks come before the pixels.
    std::string data(size <= longest_tag ? size : 0, '\0');
    file.read(&data[0], static_cast<std::streamsize>(data.size()));
    file.seekg(static_cast<std::streamoff>(size - data.size() + 4), std::ios::cur);  // And its checksum.
    if (file) add_tag(name, data, tags);
  }
}

}  // namespace tensorray
