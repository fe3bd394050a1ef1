#include "renderer/openimageio/png_chunks.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>

#include "base/text/text.h"

namespace tensorray::openimageio {
namespace {

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
  if (start != "\x89PNG\r\n\x1a\n") return;
  ChunkReader file(path);
  file.read(start.size());
  for (std::string type; type != "IEND";) {
    std::size_t left = file.number();
    file.begin();
    type = file.read(4);
    for (; left > 0; left -= std::min(left, piece)) file.read(std::min(left, piece));
    const std::uint32_t computed = file.crc();
    if (file.number() != computed)
      throw std::runtime_error("the file is cut off or damaged: its chunk " + escaped(type) + " has another CRC");
  }
}

}  // namespace tensorray::openimageio
