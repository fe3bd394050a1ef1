// The channels of pictures: their tables, and that docs/scenes.md lists those of each method in the same words.

#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integrators/methods/methods.h"
#include "scenes/outputs/channel_table.h"
#include "tests/data_folder.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using ::testing::ElementsAre;

/// The line of the documents: "| `texture.s`, `.t` | The place in the image. |"
std::string line_of(const ChannelText& channels) {
  const std::string& first = channels.names.front();
  const std::string layer = first.substr(0, first.rfind('.') + 1);
  std::string line = "| `" + first + "`";
  for (std::size_t i = 1; i < channels.names.size(); ++i)
    line += ", `" + channels.names[i].substr(layer.empty() ? 0 : layer.size() - 1) + "`";
  return line + " | " + channels.meaning + " |";
}

/// The lines of the tables of channels in the documents' section about a method.
std::vector<std::string> documented_lines(const std::string& method) {
  std::ifstream file(test::source_folder() / "docs" / "scenes.md");
  std::vector<std::string> lines;
  bool is_in_section = false, is_in_table = false;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("## ", 0) == 0 || line.rfind("### ", 0) == 0) is_in_section = line == "### " + method;
    if (line.rfind('|', 0) != 0) is_in_table = false;
    if (is_in_table && line != "| --- | --- |") lines.push_back(line);
    if (is_in_section && line == "| channel | meaning |") is_in_table = true;
  }
  return lines;
}

TEST(Channels, DocumentsListThoseOfEachMethod) {
  for (const auto& method : default_scene().integrator.methods) {
    std::vector<std::string> lines;
    for (const ChannelText& channels : method->channels()) lines.push_back(line_of(channels));
    EXPECT_FALSE(lines.empty()) << method->name();
    EXPECT_EQ(documented_lines(method->name()), lines) << method->name();
  }
}

TEST(Channels, RowsThatAreNotThereTakeNoPlace) {
  const ChannelTable<double> table{{{"a"}, "", [](double pixel) { return pixel; }},
                                   {{"b.x", "b.y"}, "", [](double pixel) { return Vector2d(pixel, pixel); }, false},
                                   {{"c.x", "c.y"}, "", [](double pixel) { return Vector2d(2 * pixel, 3 * pixel); }}};
  EXPECT_THAT(channel_names(table), ElementsAre("a", "c.x", "c.y"));
  std::vector<float> values(4, -1);
  write_channels(table, 1.0, values.data());
  EXPECT_THAT(values, ElementsAre(1, 2, 3, -1));
  EXPECT_EQ(channel_texts(table).size(), 3u);
}

}  // namespace
}  // namespace tensorray
