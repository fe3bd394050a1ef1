#pragma once
/// Points that files must keep, for the tests of their formats.

#include <random>
#include <tuple>

#include "tests/files.h"
#include "volumes/points/point_files.h"

namespace tensorray {

/// Points on a plate, like photons, or in a box.
inline PointCloud cloud_of(std::size_t count, float thickness) {
  std::mt19937 engine(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  PointCloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    cloud.positions.emplace_back(uniform(engine), uniform(engine), 100 + thickness * uniform(engine));
    cloud.scalars["wavelength"].push_back(380 + 350 * uniform(engine));
    cloud.scalars["power"].push_back(static_cast<float>(i));
    cloud.vectors["direction"].emplace_back(uniform(engine), uniform(engine), uniform(engine));
  }
  cloud.metadata = {{"seed", "7"}, {"scene", "<a> & \"b\"\nc"}};
  return cloud;
}

/// Writes points to a disk that becomes full anywhere in the file.
inline void expect_full_disk_is_noticed(const std::string& name) {
  const PointCloud cloud = cloud_of(20000, 0.5f);
  const Temporary path(name);
  write_points(path, cloud);
  const auto size = file_size(path);
  for (const auto limit : {std::uintmax_t{0}, size / 50, size / 3, size / 2, size * 9 / 10, size - 1}) {
    remove(path);
    const FileSizeLimit limited(limit);
    testing::internal::CaptureStderr();
    EXPECT_NE(message([&] { write_points(path, cloud); }).find(path.string()), std::string::npos) << limit;
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  }
}

/// Power, position, wavelength and direction of a point. Powers increase with the index in the cloud.
using Record = std::tuple<float, Eigen::Vector3f, float, Eigen::Vector3f>;

inline void expect_records(std::vector<Record> records, const PointCloud& cloud, float tolerance) {
  ASSERT_EQ(records.size(), cloud.positions.size());
  std::sort(records.begin(), records.end(), [](auto& a, auto& b) { return std::get<0>(a) < std::get<0>(b); });
  for (std::size_t i = 0; i < records.size(); ++i) {
    const auto& [power, position, wavelength, direction] = records[i];
    ASSERT_EQ(power, cloud.scalars.at("power")[i]);
    ASSERT_EQ(wavelength, cloud.scalars.at("wavelength")[i]);
    ASSERT_EQ(direction, cloud.vectors.at("direction")[i]);
    ASSERT_LE((position - cloud.positions[i]).cwiseAbs().maxCoeff(), tolerance);
  }
}

}  // namespace tensorray
