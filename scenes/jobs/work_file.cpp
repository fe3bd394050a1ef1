#include "scenes/jobs/work_file.h"

#include <cstdint>
#include <fstream>
#include <iterator>
#include <utility>

#include "base/errors.h"
#include "base/files/output_file.h"
#include "base/text/content_hash.h"
#include "base/text/path_text.h"
#include "scenes/jobs/origin.h"

// The file: the mark; an archive of the header, as JSON, and of the name and the size of each result; the results; the
// hash of all this.

namespace tensorray {
namespace {

const std::string mark = "tensorray work 2\n";
constexpr const char* damaged = "is damaged; remove it and render it again";
constexpr const char* cut_off = "is cut off; remove it and render it again";

std::string read_bytes(const std::filesystem::path& path) {
  require_readable(path);
  std::ifstream stream(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (stream.bad()) fail(path, "cannot be read");
  return bytes;
}

/// @throw Json::exception, SceneError if it is that of no render.
WorkFile from_header(const std::string& text) {
  const Json header = parse_value(text);
  WorkFile work;
  work.origin = header.at("origin");
  work.scene_file = path_of_text(header.at("scene_file").get<std::string>());
  work.part = {header.at("part").at(0).get<std::size_t>(), header.at("part").at(1).get<std::size_t>()};
  work.is_complete = header.at("complete").get<bool>();
  if (!is_origin(work.origin) || work.part.index >= work.part.count || work.part.count > max_shards)
    throw SceneError("it belongs to no render");
  return work;
}

}  // namespace

void write_work(const std::filesystem::path& path, const WorkFile& work) {
  std::string header = Json({{"origin", work.origin},
                             {"scene_file", text_of_path(work.scene_file)},
                             {"part", {work.part.index, work.part.count}},
                             {"complete", work.is_complete}})
                           .dump();
  Archive table;
  std::uint64_t count = work.results.size();
  table.copy_list(header);
  table.copy(count);
  for (const auto& [name, result] : work.results) {
    std::string copy = name;
    std::uint64_t size = result->size();
    table.copy_list(copy);
    table.copy(size);
  }
  const std::string begin = mark + table.take();
  std::vector<std::string_view> pieces{begin};
  for (const auto& [name, result] : work.results)
    if (!result->empty()) pieces.push_back(*result);
  std::uint64_t hash = 0;
  for (const std::string_view piece : pieces) hash = content_hash(piece, hash);
  Archive end;
  end.copy(hash);
  const std::string last = end.take();
  pieces.push_back(last);
  replace_file(path, pieces);
}

WorkFile read_work(const std::filesystem::path& path) {
  const std::string bytes = read_bytes(path);
  if (bytes.compare(0, mark.size(), mark) != 0) fail(path, "is no checkpoint or shard of this version of tensorray");
  WorkFile work;
  std::uint64_t hash = 0, kept_hash = 0;
  try {
    Archive archive(std::string_view(bytes).substr(mark.size()));
    std::string header;
    archive.copy_list(header);
    work = from_header(header);
    std::vector<std::pair<std::string, std::uint64_t>> table;
    std::uint64_t count = 0;
    archive.copy(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      table.emplace_back();
      archive.copy_list(table.back().first);
      archive.copy(table.back().second);
    }
    hash = content_hash(std::string_view(bytes).substr(0, bytes.size() - archive.left()));
    for (const auto& [name, size] : table) {
      archive.require(size, 1);
      std::string result(size, 0);
      archive.copy(result.data(), size);
      if (size > 0) hash = content_hash(result, hash);
      work.results[name] = std::make_shared<const std::string>(std::move(result));
    }
    archive.copy(kept_hash);
    archive.finish();
  } catch (const DamagedArchive&) {
    fail(path, cut_off);
  } catch (const Json::exception&) {
    fail(path, damaged);
  } catch (const SceneError&) {
    fail(path, damaged);
  }
  if (kept_hash != hash) fail(path, damaged);
  return work;
}

}  // namespace tensorray
