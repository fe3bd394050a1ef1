// Checkpoints and shards whose hash is right, but which are of no render.

#include "scenes/jobs/work_file.h"

#include <gtest/gtest.h>

#include "base/files/temporary_folder.h"

namespace tensorray {
namespace {

WorkFile right_work() {
  WorkFile work;
  work.origin = {{"version", "1"}, {"method", "lens"},        {"scene", Json::object()},
                 {"scale", 1},     {"direction", {0, 0, -1}}, {"files", Json::object()}};
  work.part = {1, 3};
  work.units.resize(4);
  return work;
}

TEST(WorkFileTest, WhatBelongsToNoRenderIsRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "a.shard";
  write_work(file, right_work());
  EXPECT_EQ(read_work(file).units.size(), 4u);

  std::vector<WorkFile> wrong;
  for (const WorkPart part : {WorkPart{0, 0}, {3, 3}, {0, most_parts + 1}, {0, ~std::size_t{0}}}) {
    wrong.push_back(right_work());
    wrong.back().part = part;
  }
  for (const char* const key : {"version", "method", "scene", "scale", "direction", "files"}) {
    wrong.push_back(right_work());
    wrong.back().origin.erase(key);
    wrong.push_back(right_work());
    wrong.back().origin[key] = nullptr;
  }
  for (const Json& origin : {Json(), Json("text"), Json::array()}) {
    wrong.push_back(right_work());
    wrong.back().origin = origin;
  }
  Json deep = 1;
  for (int i = 0; i < 1000; ++i) deep = Json::array({std::move(deep)});
  wrong.push_back(right_work());
  wrong.back().origin["scene"]["key"] = deep;
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    write_work(file, wrong[i]);
    try {
      read_work(file);
      ADD_FAILURE() << i << " is read";
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("a.shard: is damaged"), std::string::npos) << i << error.what();
    }
  }
}

}  // namespace
}  // namespace tensorray
