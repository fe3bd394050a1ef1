#include "volumes/points/poly_data.h"

#include <gtest/gtest.h>

#include "tests/volumes/file_support.h"

namespace tensorray {
namespace {

PolyData some_data() {
  PolyData data;
  data.points = {3, std::vector<double>{0, 1, 2, 3, 4, 5, 6, 7, 1e300}};
  data.has_lines = true;
  data.line_ends = {2, 3};
  data.point_data = {{"force", {3, std::vector<float>(9, 1.5f)}},
                     {"in field", {1, std::vector<std::uint8_t>{0, 1, 255}}}};
  data.line_data = {{"end", {1, std::vector<std::int32_t>{-1, 7}}}};
  data.texts = {{"names", {"a\nb", "", "c"}}, {"none", {}}};
  return data;
}

void expect_same(const Named<DataArray>& a, const Named<DataArray>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].first, b[i].first);
    EXPECT_EQ(a[i].second.components, b[i].second.components);
    EXPECT_EQ(a[i].second.values, b[i].second.values);
  }
}

TEST(PolyDataFile, IsReadAsItWasWritten) {
  const Temporary path("a.poly");
  const PolyData data = some_data();
  write_poly_data(path, view_of(data));
  const PolyData read = read_poly_data(path);
  EXPECT_EQ(read.points.values, data.points.values);
  EXPECT_EQ(read.has_lines, data.has_lines);
  EXPECT_EQ(read.line_ends, data.line_ends);
  EXPECT_EQ(read.texts, data.texts);
  expect_same(read.point_data, data.point_data);
  expect_same(read.line_data, data.line_data);
  write_poly_data(path, {});
  EXPECT_FALSE(read_poly_data(path).has_lines);
}

TEST(PolyDataFile, CutFilesFail) {
  const Temporary path("a.poly");
  const PolyData data = some_data();
  write_poly_data(path, view_of(data));
  const std::string bytes = bytes_of(path);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    write_bytes(path, bytes.substr(0, size));
    EXPECT_THROW(read_poly_data(path), std::runtime_error) << size;
  }
}

}  // namespace
}  // namespace tensorray
