#include "scenes/scene_source.h"

#include <cstddef>

#include <fmt/core.h>

#include "scenes/read_scene.h"

namespace tensorray {

std::string printable(const std::string& text) {
  constexpr std::size_t longest = 600;
  std::string line;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) {
      line += fmt::format("\\x{:02x}", byte);
    } else {
      line += c;
    }
  }
  if (line.size() > longest) line = line.substr(0, longest / 2) + " ... " + line.substr(line.size() - longest / 2);
  return line;
}

std::filesystem::path SceneSource::resolve(const std::filesystem::path& written) const {
  return written.is_absolute() ? written : path.parent_path() / written;
}

void SceneSource::fail(const std::string& what) const { throw SceneError(printable(path.string() + ": " + what)); }

}  // namespace tensorray
