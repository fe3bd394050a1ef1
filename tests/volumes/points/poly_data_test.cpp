#include <gtest/gtest.h>

#include "tests/volumes/file_support.h"
#include "volumes/points/vtk_files.h"

namespace tensorray {
namespace {

using Arrays = std::map<std::string, DataArray>;

PolylineData some_lines() {
  PolylineData lines;
  lines.points = {{0, 1, 2}, {3, 4, 5}, {6, 7, 1e300}};
  lines.line_ends = {2, 3};
  lines.point_data = {{"force", {3, std::vector<double>(9, 1.5)}}, {"in field", {1, std::vector<double>{0, 1, 255}}}};
  lines.line_data = {{"end", {1, std::vector<double>{-1, 7}}}};
  return lines;
}

void expect_same(const Arrays& a, const Arrays& b) {
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [name, array] : a) {
    EXPECT_EQ(b.at(name).components, array.components);
    EXPECT_EQ(b.at(name).values, array.values);
  }
}

TEST(PolyLinesFile, IsReadAsItWasWrittenAndFailsWhereItIsCutOff) {
  const Temporary path("a.poly");
  const PolylineData lines = some_lines();
  write_poly_lines(path, lines);
  const PolylineData read = read_poly_lines(path);
  EXPECT_EQ(read.points, lines.points);
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
