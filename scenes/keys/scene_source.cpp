#include "scenes/keys/scene_source.h"

#include <cstddef>

#include "base/text/text.h"

namespace tensorray {

std::string printable(const std::string& text) {
  constexpr std::size_t longest = 600;
  const std::string line = escaped(text);
  if (line.size() <= longest) return line;
  return line.substr(0, longest / 2) + " ... " + line.substr(line.size() - longest / 2);
}

std::filesystem::path SceneSource::resolve(const std::filesystem::path& written) const {
  return written.is_absolute() ? written : path.parent_path() / written;
}

void SceneSource::fail(const std::string& what) const { throw SceneError(printable(path.string() + ": " + what)); }

}  // namespace tensorray
