#include "volumes/points/point_files.h"

#include <openvdb/openvdb.h>
#include <openvdb/points/AttributeArray.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointCount.h>
#include <openvdb/points/PointDataGrid.h>

#include "tests/volumes/file_support.h"
#include "tests/volumes/point_support.h"
#include "volumes/points/vtk_files.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;
using Arrays = std::map<std::string, DataArray>;

openvdb::points::PointDataGrid::Ptr read_points(const fs::path& path) {
  return stock_grid_of<openvdb::points::PointDataGrid>(path, "points");
}

std::vector<Record> records_of(const openvdb::points::PointDataGrid& grid) {
  using namespace openvdb::points;
  std::vector<Record> records;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    const AttributeHandle<openvdb::Vec3f> position(leaf->constAttributeArray("P"));
    const AttributeHandle<openvdb::Vec3f> direction(leaf->constAttributeArray("direction"));
    const AttributeHandle<float> power(leaf->constAttributeArray("power"));
    const AttributeHandle<float> wavelength(leaf->constAttributeArray("wavelength"));
    for (auto index = leaf->beginIndexOn(); index; ++index) {
      const openvdb::Vec3d inside = openvdb::Vec3d(position.get(*index)) + index.getCoord().asVec3d();
      records.emplace_back(power.get(*index), to_eigen(grid.indexToWorld(inside)).cast<float>(), wavelength.get(*index),
                           to_eigen(direction.get(*index)));
    }
  }
  return records;
}

TEST(VdbPoints, OfAnyUnitOfLength) {
  for (const double unit : {1e-12, 1e-7, 1.0, 1e26}) {
    PointCloud cloud = cloud_of(2000, 0.5f);
    for (Vector3f& position : cloud.positions) position = (unit * position.cast<double>()).cast<float>();
    const Temporary path("a.vdb");
    write_points(path, cloud);
    const auto grid = read_points(path);
    const auto stored = grid->getMetadata<openvdb::StringMetadata>("tensorray:length_unit");
    EXPECT_EQ(stored != nullptr, unit < 1e-6);
    const double length = stored ? std::stod(stored->value()) : 1;
    PointCloud expected = cloud;
    for (Vector3f& position : expected.positions) position = (position.cast<double>() / length).cast<float>();
    expect_records(records_of(*grid), expected, static_cast<float>(1e-5 * std::max(1.0, unit)));
  }
}

TEST(VdbPoints, HoldEveryPointAndAttributeInTheSameBytesEachTime) {
  for (const float thickness : {0.0f, 0.5f}) {
    const PointCloud cloud = cloud_of(20000, thickness);
    const Temporary path("a.vdb"), again("b.vdb");
    write_points(path, cloud);
    write_points(again, cloud);
    EXPECT_TRUE(bytes_of(path) == bytes_of(again));
    const auto grid = read_points(path);
    expect_records(records_of(*grid), cloud, 1e-5f);  // Single precision at 100.
    const double voxels = static_cast<double>(grid->tree().activeVoxelCount());
    const double per_voxel = static_cast<double>(cloud.positions.size()) / voxels;
    EXPECT_GT(per_voxel, 4) << thickness;
    EXPECT_LT(per_voxel, 12) << thickness;
    openvdb::io::File file(path.string());
    file.open();
    EXPECT_EQ(file.getMetadata()->metaValue<std::string>("seed"), "7");
  }
}

TEST(VdbPoints, FewOrEqualPoints) {
  const Temporary path("a.vdb");
  write_points(path, {});
  EXPECT_EQ(openvdb::points::pointCount(read_points(path)->tree()), 0u);
  PointCloud cloud = cloud_of(100, 0);
  std::fill(cloud.positions.begin(), cloud.positions.end(), Vector3f(0, 0, 0));
  write_points(path, cloud);
  expect_records(records_of(*read_points(path)), cloud, 0);
  for (std::size_t i = 0; i < cloud.positions.size(); ++i) cloud.positions[i].x() = static_cast<float>(i);  // A line.
  write_points(path, cloud);
  expect_records(records_of(*read_points(path)), cloud, 1e-5f);
}

TEST(PointFiles, FullDiskIsNoticed) { expect_full_disk_is_noticed("a.vdb"); }

TEST(PointFiles, RefuseOtherEndingsAndMissingValues) {
  PointCloud cloud = cloud_of(3, 0);
  EXPECT_THAT([&] { write_points("a.csv", cloud); },
              ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("a.csv"), HasSubstr(".vtp"))));
  cloud.scalars["power"].pop_back();
  EXPECT_THAT([&] { write_points(Temporary("a.vdb"), cloud); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("power")));
}

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
