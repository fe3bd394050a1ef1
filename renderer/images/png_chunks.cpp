#include "renderer/images/png_chunks.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>

#include "base/text/byte_order.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

constexpr const char* magic = "\x89PNG\r\n\x1a\n";
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

constexpr std::size_t piece = 1 << 16;

std::array<std::uint32_t, 256> crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    table[byte] = byte;
    for (int bit = 0; bit < 8; ++bit) table[byte] = (table[byte] >> 1) ^ (table[byte] & 1 ? 0xedb88320u : 0);
  }
  return table;
}

/// Reads bytes, and computes their CRC (PNG specification, annex D).
class ChunkReader {
 public:
  explicit ChunkReader(const std::filesystem::path& path) : file_(path, std::ios::binary) {}

  void begin() { crc_ = 0xffffffffu; }

  std::string read(std::size_t count) {
    std::string bytes(count, '\0');
    if (!file_.read(bytes.data(), static_cast<std::streamsize>(count)))
      throw std::runtime_error("the file is cut off or damaged");
    for (const char byte : bytes) crc_ = (crc_ >> 8) ^ table_[(crc_ ^ static_cast<unsigned char>(byte)) & 0xff];
    return bytes;
  }

  std::uint32_t number() {
    std::uint32_t value = 0;
    for (const char byte : read(4)) value = value << 8 | static_cast<unsigned char>(byte);
    return value;
  }

  bool is_at_end() { return file_.peek() == std::ifstream::traits_type::eof(); }

  std::uint32_t crc() const { return ~crc_; }

 private:
  std::ifstream file_;
  std::uint32_t crc_ = 0;
  const std::array<std::uint32_t, 256> table_ = crc_table();
};

}  // namespace

void check_png(const std::filesystem::path& path) {
  std::string start(8, '\0');
  std::ifstream(path, std::ios::binary).read(start.data(), 8);
  if (start != magic) return;
  ChunkReader file(path);
  file.read(start.size());
  for (std::string type; type != "IEND";) {
    if (type == "IDAT" && file.is_at_end()) return;  // All pixels may be there without an end.
    std::size_t left = file.number();
    file.begin();
    type = file.read(4);
    for (; left > 0; left -= std::min(left, piece)) file.read(std::min(left, piece));
    const std::uint32_t computed = file.crc();
    const bool is_needed = type[0] >= 'A' && type[0] <= 'Z';  // Others, such as comments, are left out where damaged.
    if (file.number() != computed && is_needed)
      throw std::runtime_error("the file is cut off or damaged: its chunk " + escaped(type) + " has another CRC");
  }
}

void add_png_tags(const std::filesystem::path& path, ColorTags& tags) {
  std::ifstream file(path, std::ios::binary);
  std::string head(8, '\0');
  if (!file.read(&head[0], 8) || head != magic) return;
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
