#include "base/text/content_hash.h"

#include <cstring>
#include <fstream>
#include <vector>

#include "base/errors.h"

namespace tensorray {
namespace {

std::uint64_t mixed(std::uint64_t hash, std::uint64_t word) {
  hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
  return hash ^ hash >> 32;
}

}  // namespace

std::uint64_t content_hash(std::string_view bytes, std::uint64_t before) {
  std::uint64_t hash = mixed(before, bytes.size());
  std::uint64_t word = 0;
  for (; bytes.size() >= sizeof word; bytes.remove_prefix(sizeof word)) {
    std::memcpy(&word, bytes.data(), sizeof word);
    hash = mixed(hash, word);
  }
  word = 0;
  if (!bytes.empty()) std::memcpy(&word, bytes.data(), bytes.size());
  return mixed(hash, word);
}

std::uint64_t file_hash(const std::filesystem::path& file) {
  require_readable(file);
  std::ifstream stream(file, std::ios::binary);
  std::vector<char> buffer(1 << 20);
  std::uint64_t hash = 0;
  do {
    stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    hash = content_hash({buffer.data(), static_cast<std::size_t>(stream.gcount())}, hash);
  } while (stream);
  if (stream.bad()) fail(file, "cannot be read");
  return hash;
}

}  // namespace tensorray
