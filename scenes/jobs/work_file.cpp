#include "scenes/jobs/work_file.h"

#include <cstdint>
#include <fstream>
#include <iterator>
#include <utility>

#include "base/errors.h"
#include "base/files/replace_file.h"
#include "base/text/content_hash.h"
#include "base/text/copy_bytes.h"
#include "base/text/path_text.h"
#include "scenes/jobs/origin.h"

// The file: the mark; the length of the header; the header, as JSON; for each unit, twice the length of its state, plus
// 1 if it is done (with "before": also for what is made before all units, behind them); the states; the hash of all
// this. Numbers have 64 bits.

namespace tensorray {
namespace {

const std::string mark = "tensorray work 1\n";

std::string bytes_of(std::uint64_t number) {
  std::string bytes(sizeof number, 0);
  copy_bytes(bytes.data(), &number, sizeof number);
  return bytes;
}

/// Takes a file apart from its front.
class Reader {
 public:
  Reader(const std::filesystem::path& path, std::string_view bytes) : path_(path), rest_(bytes) {}

  std::string_view take(std::uint64_t size) {
    if (size > rest_.size()) fail(path_, "is cut off; remove it and render it again");
    const std::string_view bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return bytes;
  }

  std::uint64_t number() {
    std::uint64_t number = 0;
    copy_bytes(&number, take(sizeof number).data(), sizeof number);
    return number;
  }

  std::size_t left() const { return rest_.size(); }

 private:
  const std::filesystem::path& path_;
  std::string_view rest_;
};

std::string read_bytes(const std::filesystem::path& path) {
  require_readable(path);
  std::ifstream stream(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (stream.bad()) fail(path, "cannot be read");
  return bytes;
}

}  // namespace

void write_work(const std::filesystem::path& path, const WorkFile& work) {
  const Json header = {{"origin", work.origin},
                       {"scene_file", text_of_path(work.scene_file)},
                       {"part", {work.part.index, work.part.count}},
                       {"units", work.units.size()},
                       {"before", work.before.state != nullptr}};
  const std::string text = header.dump();
  std::string begin = mark + bytes_of(text.size()) + text;
  std::vector<std::string_view> pieces{{}};
  std::vector<WorkUnit> units = work.units;
  if (work.before.state) units.push_back(work.before);
  for (const WorkUnit& unit : units) {
    begin += bytes_of(2 * (unit.state ? unit.state->size() : 0) + (unit.done ? 1 : 0));
    if (unit.state && !unit.state->empty()) pieces.push_back(*unit.state);
  }
  pieces.front() = begin;
  std::uint64_t hash = 0;
  for (const std::string_view piece : pieces) hash = content_hash(piece, hash);
  const std::string end = bytes_of(hash);
  pieces.push_back(end);
  replace_file(path, pieces);
}

WorkFile read_work(const std::filesystem::path& path) {
  const std::string bytes = read_bytes(path);
  if (bytes.compare(0, mark.size(), mark) != 0) fail(path, "is no checkpoint or shard of this version of tensorray");
  Reader reader(path, bytes);
  reader.take(mark.size());
  WorkFile work;
  std::vector<std::uint64_t> sizes;
  bool has_before = false;
  try {
    const Json header = parse_value(std::string(reader.take(reader.number())));
    work.origin = header.at("origin");
    work.scene_file = path_of_text(header.at("scene_file").get<std::string>());
    work.part = {header.at("part").at(0).get<std::size_t>(), header.at("part").at(1).get<std::size_t>()};
    if (!is_origin(work.origin) || work.part.index >= work.part.count || work.part.count > most_parts)
      throw SceneError("it belongs to no render");
    has_before = header.value("before", false);
    const std::uint64_t units = header.at("units").get<std::uint32_t>() + std::uint64_t{has_before};
    const std::string_view table = reader.take(sizeof(std::uint64_t) * units);
    sizes.resize(table.size() / sizeof(std::uint64_t));
    copy_bytes(sizes.data(), table.data(), table.size());
  } catch (const Json::exception&) {
    fail(path, "is damaged; remove it and render it again");
  } catch (const SceneError&) {
    fail(path, "is damaged; remove it and render it again");
  }
  const std::size_t begun = bytes.size() - reader.left();
  std::uint64_t hash = content_hash(std::string_view(bytes).substr(0, begun));
  for (const std::uint64_t size : sizes) {
    WorkUnit unit;
    unit.done = size % 2 == 1;
    if (size > 1) {
      unit.state = std::make_shared<const std::string>(reader.take(size / 2));
      hash = content_hash(*unit.state, hash);
    }
    work.units.push_back(std::move(unit));
  }
  if (reader.number() != hash || reader.left() > 0) fail(path, "is damaged; remove it and render it again");
  if (has_before) {
    work.before = std::move(work.units.back());
    work.units.pop_back();
  }
  return work;
}

}  // namespace tensorray
