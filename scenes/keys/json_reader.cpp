#include "scenes/keys/json_reader.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <vector>

#include <fmt/core.h>

#include "base/text/text.h"

namespace tensorray {
namespace {

constexpr std::size_t largest_file = std::size_t{64} << 20;  // Bytes. Only a wrong file, such as a VDB, is larger.

std::string read_text(const SceneSource& source) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(source.path, error);
  if (!std::filesystem::exists(status)) source.fail("no such file; give the path of a scene file");
  if (std::filesystem::is_directory(status)) source.fail("is a folder; give the path of a scene file");

  errno = 0;
  std::ifstream file(source.path, std::ios::binary);
  if (!file) source.fail(fmt::format("cannot be read: {}", std::strerror(errno)));
  std::string text;
  std::vector<char> buffer(1 << 16);
  while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || file.gcount() > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(file.gcount()));
    if (text.size() > largest_file) source.fail("is larger than 64 MiB, which no scene file is; give another file");
  }
  if (file.bad()) source.fail("cannot be read to its end");
  return text;
}

/// Refuses repeated keys and deep nesting, which JSON allows.
Json parse(const std::string& text, bool comments) {
  using Event = Json::parse_event_t;
  std::vector<std::set<std::string>> keys;  // Of each object that has begun and not ended.
  const auto follow = [&keys](int depth, Event event, Json& parsed) {
    if ((event == Event::object_start || event == Event::array_start) && depth >= nesting_limit)
      throw SceneError(fmt::format("is nested deeper than {} levels", nesting_limit));
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    if (event == Event::key && !keys.back().insert(parsed.get<std::string>()).second)
      throw SceneError(
          fmt::format("key `{}` is given twice in the same object; remove one", parsed.get<std::string>()));
    return true;
  };
  return Json::parse(text, follow, true, comments);
}

/// The position of the byte at `offset`, as "line 3, column 7".
std::string position(const std::string& text, std::size_t offset) {
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(offset, text.size()));
  const auto line = std::count(text.begin(), end, '\n') + 1;
  const auto start = std::find(std::make_reverse_iterator(end), text.rend(), '\n').base();
  return fmt::format("line {}, column {}", line, end - start + 1);
}

/// The parser's text of an error, without its prefixes. Bytes that are not ASCII become '?'.
std::string reason(const std::string& what) {
  const std::size_t column = what.find("column ");
  const std::size_t colon = what.find(": ", column == std::string::npos ? 0 : column);
  const std::size_t bracket = what.find("] ");
  std::string text = column != std::string::npos && colon != std::string::npos ? what.substr(colon + 2)
                     : bracket != std::string::npos                            ? what.substr(bracket + 2)
                                                                               : what;
  if (text.size() > 200) text = text.substr(0, 200) + "...";
  for (char& c : text)
    if (static_cast<unsigned char>(c) >= 0x80) c = '?';
  const bool closing =
      text.find("unexpected '}'") != std::string::npos || text.find("unexpected ']'") != std::string::npos;
  return closing ? text + " (is there an extra comma before it?)" : text;
}

}  // namespace

Json read_json_object(const std::filesystem::path& path) {
  const SceneSource source{path};
  const std::string text = read_text(source);
  if (text.find_first_not_of(" \t\r\n\v\f") == std::string::npos)
    source.fail("is empty; a scene is a JSON object with `field` and `integrator`");
  Json json;
  try {
    json = parse(text, true);
  } catch (const SceneError& error) {
    source.fail(error.what());
  } catch (const Json::parse_error& error) {
    const std::size_t read = error.byte;  // Number of bytes that the parser has read; the last byte is wrong.
    source.fail(fmt::format("{}: {}", position(text, read > 0 ? read - 1 : 0), reason(error.what())));
  } catch (const Json::exception& error) {
    source.fail(reason(error.what()));
  }
  if (!json.is_object()) source.fail("must be a JSON object: { \"field\": ..., \"integrator\": ... }");
  return json;
}

Json parse_value(const std::string& text) { return parse(text, false); }

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
