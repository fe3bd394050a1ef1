#include "volumes/points/poly_data.h"

#include <gtest/gtest.h>

#include "tests/volumes/file_support.h"

namespace tensorray {
namespace {

PolyLines some_lines() {
  PolyLines lines;
  lines.points.numbers = {0, 1, 2, 3, 4, 5, 6, 7, 1e300};
  lines.line_ends = {2, 3};
  lines.point_data = {{"force", {3, std::vector<double>(9, 1.5)}}, {"in field", {1, {0, 1, 255}}}};
  lines.line_data = {{"end", {1, {-1, 7}}}};
  return lines;
}

void expect_same(const Named<PolyLines::Values>& a, const Named<PolyLines::Values>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].first, b[i].first);
    EXPECT_EQ(a[i].second.components, b[i].second.components);
    EXPECT_EQ(a[i].second.numbers, b[i].second.numbers);
  }
}

TEST(PolyLinesFile, IsReadAsItWasWrittenAndFailsWhereItIsCutOff) {
  const Temporary path("a.poly");
  const PolyLines lines = some_lines();
  write_poly_lines(path, lines);
  const PolyLines read = read_poly_lines(path);
  EXPECT_EQ(read.points.numbers, lines.points.numbers);
  EXPECT_EQ(read.line_ends, lines.line_ends);
  expect_same(read.point_data, lines.point_data);
  expect_same(read.line_data, lines.line_data);
  const std::string bytes = bytes_of(path);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    write_bytes(path, bytes.substr(0, size));
    EXPECT_THROW(read_poly_lines(path), std::runtime_error) << size;
  }
}

}  // namespace
}  // namespace tensorray
