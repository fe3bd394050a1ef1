#include "scenes/jobs/work_file.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/files/output_file.h"
#include "base/text/content_hash.h"
#include "base/text/path_text.h"
#include "base/text/text.h"
#include "scenes/description/check_scene.h"
#include "scenes/keys/values.h"

// The file: the mark; an archive of the header, as JSON, and the name and size of each result; these; the hash of all.

namespace tensorray {
namespace {

const std::string mark = "tensorray work 7\n";
constexpr std::uintmax_t quickly_hashed = 1u << 24;
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

/// Adds the results of a shard to those of the others.
void unite(const std::string& file, const WorkFile& shard, WorkFile& all) {
  const auto fail = [&](const std::string& what) { throw std::invalid_argument(printable(file + ": " + what)); };
  const std::string other = difference(shard.origin, all.origin);
  if (!other.empty()) fail("is of another render than the first shard: " + other);
  if (shard.part.count != all.part.count)
    fail(fmt::format("is one of {} shards, the first one of {}", shard.part.count, all.part.count));
  if (!shard.is_complete)
    fail(fmt::format("is not complete; continue it with --shard {}/{} --resume", shard.part.index + 1,
                     shard.part.count));
  all.results.insert(shard.results.begin(), shard.results.end());
}

Json identity_of(const std::filesystem::path& file, bool hashes_all) {
  const std::uintmax_t size = std::filesystem::file_size(file);
  Json identity{{"size", size}, {"time", std::filesystem::last_write_time(file).time_since_epoch().count()}};
  if (hashes_all || size <= quickly_hashed) identity["hash"] = fmt::format("{:016x}", file_hash(file));
  return identity;
}

bool is_same_file(const Json& there, const Json& here) {
  if (!there.is_object()) return false;
  const bool has_hashes = there.contains("hash") && here.contains("hash");
  return has_hashes ? there["hash"] == here["hash"]
                    : there.value("size", Json()) == here["size"] && there.value("time", Json()) == here["time"];
}

Json files_of(const SceneDescription& description, bool hashes_all) {
  Json files = Json::object();
  for (const NamedFile& file : input_files(description))
    if (!file.path.empty() && file.path != description.path) files[file.name] = identity_of(file.path, hashes_all);
  return files;
}

std::string shown(const Json& value) { return value.is_null() ? "not given" : excerpt(value); }

/// The pointer of the first value that differs, and both values, whatever the order of keys.
std::string scene_difference(const Json& there, const Json& here, const std::string& pointer) {
  if (there.is_object() && here.is_object()) {
    std::set<std::string> keys;
    for (const Json* each : {&there, &here})
      for (const auto& item : each->items()) keys.insert(item.key());
    for (const std::string& key : keys) {
      const std::string found =
          scene_difference(there.value(key, Json()), here.value(key, Json()), pointer + "/" + key);
      if (!found.empty()) return found;
    }
    return "";
  }
  return there == here ? "" : fmt::format("`{}` is {} there, {} here", pointer, shown(there), shown(here));
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

WorkFile read_shards(const std::vector<std::string>& files) {
  WorkFile all;
  std::map<std::size_t, std::string> names;
  for (const std::string& file : files) {
    const WorkFile shard = read_work(file);
    if (names.empty()) all = shard;
    const std::size_t index = shard.part.index;
    unite(file, shard, all);
    const auto [before, is_new] = names.emplace(index, file);
    if (!is_new)
      throw std::invalid_argument(printable(fmt::format("{} and {} are both shard {}/{}; name one of them",
                                                        before->second, file, index + 1, all.part.count)));
  }
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < all.part.count; ++i)
    if (names.count(i) == 0) missing.push_back(fmt::format("{}/{}", i + 1, all.part.count));
  if (!missing.empty())
    throw std::invalid_argument(fmt::format("missing {} {}: render with --shard, and name all files",
                                            missing.size() > 1 ? "shards" : "shard", joined(missing)));
  all.part.index = 0;
  return all;
}

Json origin_of(const Scene& scene, bool hashes_all) {
  const SceneDescription& description = scene.description;
  Json json = parse_value(description.text);
  json.erase("output");
  if (description.output.fluence_bands) json["output"]["fluence_bands"] = true;  // It is no file, but a setting.
  const Eigen::Vector3d direction = *description.light.direction;
  return {{"version", TENSORRAY_VERSION},
          {"method", description.integrator.method().name()},
          {"scene", json},
          {"scale", scene.scale.scale},
          {"direction", {direction.x(), direction.y(), direction.z()}},
          {"files", files_of(description, hashes_all)}};
}

bool is_origin(const Json& json) {
  const auto has = [&](const char* key, bool (Json::*is_right)() const) {
    return json.is_object() && json.contains(key) && (json.at(key).*is_right)();
  };
  const auto is_number = [](const Json& each) { return each.is_number(); };
  return has("version", &Json::is_string) && has("method", &Json::is_string) && has("scene", &Json::is_object) &&
         has("scale", &Json::is_number) && has("files", &Json::is_object) && has("direction", &Json::is_array) &&
         json.at("direction").size() == 3 &&
         std::all_of(json.at("direction").begin(), json.at("direction").end(), is_number);
}

std::string difference(const Json& there, const Json& here) {
  for (const char* key : {"version", "method"})
    if (there.value(key, Json()) != here.at(key))
      return fmt::format("its {} is {}, not {}", key, shown(there.value(key, Json())), shown(here.at(key)));
  const std::string scene = scene_difference(there.value("scene", Json()), here.at("scene"), "");
  if (!scene.empty()) return scene;
  const Json files = there.value("files", Json::object());
  for (const auto& [name, file] : here.at("files").items())
    if (!is_same_file(files.value(name, Json()), file)) return fmt::format("the file {} has other contents", name);
  for (const char* key : {"scale", "direction"})
    if (there.value(key, Json()) != here.at(key))
      return fmt::format("its {} is {}, not {}", key, shown(there.value(key, Json())), shown(here.at(key)));
  return "";
}

void set_chosen(const Json& origin, SceneDescription& description) {
  if (!description.field.scale) description.field.scale = origin.at("scale").get<double>();
  if (description.light.direction) return;
  const Json& direction = origin.at("direction");
  description.light.direction =
      Eigen::Vector3d(direction.at(0).get<double>(), direction.at(1).get<double>(), direction.at(2).get<double>());
}

}  // namespace tensorray
