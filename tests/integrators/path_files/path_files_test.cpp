#include "integrators/path_files/path_files.h"

#include <cstring>
#include <limits>
#include <stdexcept>

#include "tests/renderer/support.h"
#include "tests/tracing/path_support.h"

namespace tensorray {
namespace {

/// Reads a file of these bytes. Nothing may be written to the terminal meanwhile.
/// @return the error's message; empty if it was read.
std::string error_of(const std::string& name, const std::string& bytes) {
  const Temporary file(name, bytes);
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  std::string text;
  try {
    read_paths(file.path());
  } catch (const std::runtime_error& error) {
    text = error.what();
    EXPECT_THAT(text, AllOf(StartsWith("cannot read "), HasSubstr(file.path().string() + ": ")));
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  }
  EXPECT_EQ(::testing::internal::GetCapturedStdout() + ::testing::internal::GetCapturedStderr(), "");
  return text;
}

std::string written(const std::string& name, const std::vector<Path>& paths) {
  const Temporary file(name);
  write_paths(file.path(), paths);
  return read_bytes(file.path());
}

TEST(TckPathsTest, ReadBack) {
  const std::vector<Path> paths = some_paths(12);
  const Temporary file("a.tck");
  write_paths(file.path(), paths);
  const std::vector<Path> read = read_paths(file.path());
  ASSERT_EQ(read.size(), 12u);
  for (std::size_t i = 0; i < read.size(); ++i) {
    ASSERT_EQ(read[i].points.size(), paths[i + 1].points.size());
    for (std::size_t j = 0; j < read[i].points.size(); ++j)
      EXPECT_EQ(read[i].points[j].position.cast<float>(), paths[i + 1].points[j].position.cast<float>());
  }
  write_paths(file.path(), read);
  expect_same(read_paths(file.path()), read);
}

/// A number as bytes, in the given order.
template <class Number>
std::string bytes_of(Number number, bool little_endian) {
  std::string bytes(sizeof number, ' ');
  std::memcpy(&bytes[0], &number, sizeof number);
  return little_endian ? bytes : std::string(bytes.rbegin(), bytes.rend());
}

template <class Number>
void expect_read(const std::string& type, bool little_endian) {
  // The header's fields in another order, one that is unknown, room before the data, and a track of a single point.
  std::string bytes = "mrtrix tracks    \r\nfile: . 100\nroi: seed a.mif\ndatatype: " + type + "\nEND\n";
  bytes.resize(100, ' ');
  const Vector3d between = Vector3d::Constant(NAN), end = Vector3d::Constant(INFINITY);
  for (const Vector3d& point : {Vector3d(0, 0, 0), between, Vector3d(1, 2, 3), Vector3d(1, 2, 3), Vector3d(1, 2, 4.5),
                                between, Vector3d(0, 0, 1), Vector3d(0, 0, 3), end})
    for (const double number : point) bytes += bytes_of(static_cast<Number>(number), little_endian);
  const Temporary file("a.tck", bytes);
  const std::vector<Path> paths = read_paths(file.path());
  ASSERT_EQ(paths.size(), 2u) << type;
  ASSERT_EQ(paths[0].points.size(), 2u);
  EXPECT_EQ(paths[0].points[1].position, Vector3d(1, 2, 4.5));
  EXPECT_EQ(paths[0].points[1].direction, Vector3d(0, 0, 1));
  EXPECT_EQ(paths[1].points[1].length, 2);
}

TEST(TckPathsTest, AllNumberTypes) {
  expect_read<float>("Float32LE", true);
  expect_read<float>("Float32BE", false);
  expect_read<double>("Float64LE", true);
  expect_read<double>("Float64BE", false);
}

TEST(TckPathsTest, CutFilesFail) {
  const std::string bytes = written("a.tck", some_paths(6));
  for (std::size_t size = 0; size < bytes.size(); size += 10)
    EXPECT_NE(error_of("cut.tck", bytes.substr(0, size)), "") << size;
}

TEST(TckPathsTest, ErrorsNameTheMend) {
  const std::string bytes = written("a.tck", some_paths(3));
  const auto error = [](const std::string& content) { return error_of("a.tck", content); };
  EXPECT_THAT(error(replaced(bytes, "mrtrix", "matrix")), HasSubstr("not a file of MRtrix tracks"));
  EXPECT_THAT(error(replaced(bytes, "count: 3", "count: 4")), AllOf(HasSubstr("gives 4"), HasSubstr("holds 3")));
  EXPECT_THAT(error(replaced(bytes, "count: 3", "count: x")), HasSubstr("\"count\""));
  EXPECT_THAT(error(replaced(bytes, "Float32LE", "Int32LE")), HasSubstr("datatype"));
  EXPECT_THAT(error(replaced(bytes, "datatype", "number")), HasSubstr("no datatype"));
  EXPECT_THAT(error(replaced(bytes, "file: . ", "file: a ")), HasSubstr("another file"));
  EXPECT_THAT(error(replaced(bytes, "file: . ", "file: . 9")), HasSubstr("offset"));
  EXPECT_THAT(error(replaced(bytes, "file: . ", "none: . ")), HasSubstr("offset"));
  std::string not_finite = bytes;
  not_finite.replace(bytes.find("END\n") + 8, 4, bytes_of(std::numeric_limits<float>::quiet_NaN(), true));
  EXPECT_THAT(error(not_finite), HasSubstr("track 0 is not finite"));
  std::string far = bytes;
  far.replace(bytes.find("END\n") + 4, 4, bytes_of(3e38f, true));
  EXPECT_THAT(error(far), HasSubstr("beyond 1e18"));
  EXPECT_THAT(error(written("b.tck", {})), HasSubstr("no path"));
}

TEST(PathFilesTest, EndingsAndFolders) {
  const std::vector<Path> paths = some_paths(100);
  EXPECT_THAT(message([&] { write_paths("a.csv", paths); }), HasSubstr(".vtp or .tck"));
  EXPECT_THAT(message([&] { read_paths("a.csv"); }), HasSubstr(".vtp or .tck"));
  EXPECT_THAT(message([&] { read_paths("/no/such/a.vtp"); }), HasSubstr("no such file"));
  EXPECT_THAT(message([&] { read_paths(::testing::TempDir()); }), HasSubstr(".vtp or .tck"));
  const std::filesystem::path missing = "/no/such/folder/a.tck";
  EXPECT_THAT(message([&] { write_paths(missing, paths); }), HasSubstr(missing.string() + ": cannot be written"));
  if (!std::filesystem::exists("/dev/full")) return;
  const Temporary link("full_a.tck");  // Removing a link leaves the device.
  std::filesystem::create_symlink("/dev/full", link.path());
  EXPECT_THAT(message([&] { write_paths(link.path(), paths); }), HasSubstr("cannot be written"));
}

TEST(PathFilesTest, BareWayOfACircle) {
  // Unevenly spaced points on a circle of radius 2: tangents and curvature are of second and first order in spacing.
  std::vector<Vector3d> positions;
  const auto angle = [](int i) { return 0.01 * i + 0.002 * std::sin(i); };
  for (int i = 0; i < 100; ++i) positions.push_back(2 * Vector3d(std::cos(angle(i)), std::sin(angle(i)), 0));
  const PathPoints points = bare_way(positions);
  ASSERT_EQ(points.size(), 100u);
  for (int i = 0; i < 100; ++i) {
    const PathPoint& point = points[static_cast<std::size_t>(i)];
    const Vector3d tangent(-std::sin(angle(i)), std::cos(angle(i)), 0);
    EXPECT_LE((point.direction - tangent).norm(), 1e-4) << i;
    EXPECT_LE((point.change + point.position / 4).norm(), 5e-3) << i;
    EXPECT_NEAR(point.length, 2 * (angle(i) - angle(0)), 1e-4);
  }
  EXPECT_TRUE(bare_way({}).empty());
  EXPECT_TRUE(bare_way({positions[0], positions[0]}).empty());
  for (const PathPoint& point : bare_way({positions[0], positions[9], positions[0]}))  // There and back.
    EXPECT_NEAR(point.direction.norm(), 1, 1e-12);
}

}  // namespace
}  // namespace tensorray
