#include "scenes/keys/scene_source.h"

#include <cstddef>

#include "base/text/text.h"

namespace tensorray {

std::string printable(const std::string& text) {
  constexpr std::size_t longest = 600;
  const std::string line = escaped(text);
  if (line.size() <= longest) return line;
  const auto is_within = [&line](std::size_t at) { return (static_cast<unsigned char>(line[at]) & 0xc0) == 0x80; };
  std::size_t end = longest / 2, begin = line.size() - longest / 2;  // Not within a character of UTF-8.
  while (end > longest / 2 - 3 && is_within(end)) --end;
  while (begin < line.size() - longest / 2 + 3 && is_within(begin)) ++begin;
  return line.substr(0, end) + " ... " + line.substr(begin);
}

std::filesystem::path SceneSource::resolve(const std::filesystem::path& written) const {
  return written.is_absolute() ? written : path.parent_path() / written;
}

void SceneSource::fail(const std::string& what) const { throw SceneError(printable(path.string() + ": " + what)); }

}  // namespace tensorray
