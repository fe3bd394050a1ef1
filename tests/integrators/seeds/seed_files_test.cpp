#include <gtest/gtest.h>

#include "integrators/seeds/seeds.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

SeedList read_text(const std::string& text) {
  const Temporary file("seeds.txt", text);
  return read_seeds(file.path());
}

TEST(SeedFiles, HoldPointsInText) {
  const SeedList seeds = read_text("# a comment\n\n1 2.5 -3e-1\n\t+4,5;6 # and another\r\n7, 8, 9");
  EXPECT_EQ(seeds.positions, (std::vector<Vector3d>{{1, 2.5, -0.3}, {4, 5, 6}, {7, 8, 9}}));
  EXPECT_TRUE(seeds.directions.empty());
}

TEST(SeedFiles, MayHaveDirectionsAndAHeader) {
  const SeedList seeds = read_text("\xef\xbb\xbfx,y,z,dx,dy,dz\n1,2,3,0,0,-2\n4,5,6,3e200,4e200,0\n");
  EXPECT_EQ(seeds.positions, (std::vector<Vector3d>{{1, 2, 3}, {4, 5, 6}}));
  ASSERT_EQ(seeds.directions.size(), 2u);
  EXPECT_EQ(seeds.directions[0], Vector3d(0, 0, -1));
  EXPECT_LT((seeds.directions[1] - Vector3d(0.6, 0.8, 0)).norm(), 1e-15);
}

TEST(SeedFiles, LinesEndAsOnAnySystem) {
  for (const std::string end : {"\n", "\r", "\r\n"}) {
    const SeedList seeds = read_text("# text" + end + "1 2 3" + end + end + "4 5 6" + end);
    EXPECT_EQ(seeds.positions, (std::vector<Vector3d>{{1, 2, 3}, {4, 5, 6}})) << seeds.positions.size();
    const std::string said = message([&] { read_text("1 2 3" + end + end + "4 five 6" + end); });
    EXPECT_NE(said.find("line 3: "), std::string::npos) << said;
  }
}

TEST(SeedFiles, ErrorsAreShortLines) {
  for (const std::string& word : {std::string(5000000, 'x'), std::string("a\0b\x1b[31m", 8)}) {
    const std::string said = message([&] { read_text("1 2 3\n1 2 " + word + "\n"); });
    EXPECT_LT(said.size(), 300u);
    EXPECT_EQ(said.find('\0'), std::string::npos);
    EXPECT_EQ(said.find('\x1b'), std::string::npos);
  }
}

TEST(SeedFiles, SayWhichLineIsWrong) {
  const auto complaint = [](const std::string& text) { return message([&] { read_text(text); }); };
  const auto expect = [&](const std::string& text, const std::string& words) {
    const std::string said = complaint(text);
    EXPECT_NE(said.find("seeds.txt: "), std::string::npos) << said;
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  expect("1 2 3\n4 5\n", "line 2: a seed is three numbers (x y z), or six (x y z and a direction), not 2");
  expect("1 2 3\n1 2 3 0 0 1\n", "line 2: all lines must have the same number of values: the lines above have 3");
  expect("1 2 3\n4 five 6\n", "line 2: \"five\" is not a finite number");
  expect("1 2 nan\n", "line 1: \"nan\" is not a finite number");
  expect("1 2 3 0 0 0\n", "line 1: the direction has length zero");
  expect("x y z\na b c\n", "line 2: \"a\" is not a finite number");
  expect("x,y,z\n", "contains no seeds");
  expect("# nothing\n", "contains no seeds");
  EXPECT_NE(message([] { read_seeds("/nowhere/seeds.csv"); }).find("/nowhere/seeds.csv"), std::string::npos);
}

}  // namespace
}  // namespace tensorray
