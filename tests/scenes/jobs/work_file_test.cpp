// Checkpoints and shards whose hash is right, but which are of no render.

#include "scenes/jobs/work_file.h"

#include <fstream>

#include "base/files/temporary_folder.h"
#include "tests/files.h"

namespace tensorray {
namespace {

WorkFile right_work() {
  WorkFile work;
  work.origin = {{"version", "1"}, {"method", "lens"},        {"scene", Json::object()},
                 {"scale", 1},     {"direction", {0, 0, -1}}, {"files", Json::object()}};
  work.part = {1, 3};
  work.results["tile 1"] = std::make_shared<const std::string>("all of it");
  return work;
}

TEST(WorkFileTest, WhatBelongsToNoRenderIsRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "a.shard";
  write_work(file, right_work());
  const WorkFile read = read_work(file);
  EXPECT_EQ(read.results.size(), 1u);
  EXPECT_EQ(*read.results.at("tile 1"), "all of it");
  EXPECT_EQ(read.origin, right_work().origin);

  WorkFile wrong = right_work();
  const auto expect_refused = [&] {
    write_work(file, wrong);
    EXPECT_THAT(message([&] { read_work(file); }), HasSubstr("a.shard: is damaged"))
        << wrong.part.index << " of " << wrong.part.count << ", " << wrong.origin;
    wrong = right_work();
  };
  for (const WorkPart part : {WorkPart{0, 0}, {3, 3}, {0, max_shards + 1}, {0, ~std::size_t{0}}}) {
    wrong.part = part;
    expect_refused();
  }
  for (const char* const key : {"version", "method", "scene", "scale", "direction", "files"}) {
    wrong.origin.erase(key);
    expect_refused();
    wrong.origin[key] = nullptr;
    expect_refused();
  }
  for (const Json& origin : {Json(), Json("text"), Json::array()}) {
    wrong.origin = origin;
    expect_refused();
  }
  Json deep = 1;
  for (int i = 0; i < 1000; ++i) deep = Json::array({std::move(deep)});
  wrong.origin["scene"]["key"] = deep;
  expect_refused();
}

/// By their hashes where both have one, else by size and time.
TEST(WorkFileTest, FilesAreTheSameBySizeTimeAndHash) {
  const auto with = [](const Json& file) {
    Json origin = right_work().origin;
    origin["files"]["`/field/file`"] = file;
    return origin;
  };
  const Json whole{{"size", 3}, {"time", 5}, {"hash", "a"}}, copy{{"size", 3}, {"time", 6}, {"hash", "a"}};
  const Json changed{{"size", 3}, {"time", 5}, {"hash", "b"}}, large{{"size", 3}, {"time", 5}};
  const Json later{{"size", 3}, {"time", 6}}, longer{{"size", 4}, {"time", 5}};
  for (const auto& [there, here] : {std::pair(whole, copy), {large, large}, {large, whole}, {whole, large}})
    EXPECT_EQ(difference(with(there), with(here)), "") << there << here;
  for (const auto& [there, here] : {std::pair(whole, changed), {large, later}, {large, longer}, {large, copy}})
    EXPECT_EQ(difference(with(there), with(here)), "the file `/field/file` has other contents") << there << here;
  EXPECT_NE(difference(right_work().origin, with(large)), "");
}

TEST(WorkFileTest, WhatIsDamagedIsRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "a.shard";
  write_work(file, right_work());
  const std::string right = bytes_of(file);
  const auto expect_refused = [&](const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
    EXPECT_THROW(read_work(file), std::runtime_error);
  };
  for (std::size_t size = 0; size < right.size(); ++size) expect_refused(right.substr(0, size));
  expect_refused(right + "x");
  for (std::size_t i = 0; i < right.size(); ++i) {
    std::string changed = right;
    changed[i] = static_cast<char>(changed[i] ^ 0x41);
    expect_refused(changed);
  }
}

}  // namespace
}  // namespace tensorray
