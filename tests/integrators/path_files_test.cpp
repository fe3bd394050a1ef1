#include "integrators/paths/path_files.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integrators/paths/cross_section.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Paths of 2, 3, ... points with numbers that no shorter type holds, after one that is empty.
std::vector<Path> some_paths(std::size_t count) {
  std::mt19937 engine(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Path> paths(1);
  for (std::size_t i = 0; i < count; ++i) {
    Path path;
    for (std::size_t j = 0; j < i + 2; ++j) {
      PathPoint point;
      const auto random = [&](Eigen::Index, Eigen::Index) { return uniform(engine); };
      point.position = Eigen::Vector3d(1e4, 0, 0) + Eigen::Vector3d::NullaryExpr(3, 1, random);
      point.direction = Eigen::Vector3d::NullaryExpr(3, 1, random).eval().normalized();
      point.length = path.points.empty() ? 0 : path.points.back().length + 1 + uniform(engine);
      point.in_field = j > 0;
      if (point.in_field) point.tensor = Eigen::Matrix3d::NullaryExpr(3, 3, random);
      if (point.in_field) point.change = Eigen::Vector3d::NullaryExpr(3, 1, random);
      path.points.push_back(point);
    }
    path.flexibility = uniform(engine);
    path.wavelength = 500 + 100 * uniform(engine);
    path.end = static_cast<RayEnd>(i % ray_end_count);
    if (i % 2) path.backward_end = static_cast<RayEnd>((i + 1) % ray_end_count);
    paths.push_back(path);
  }
  return paths;
}

void expect_same(const PathPoints& a, const PathPoints& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].position, b[i].position);
    EXPECT_EQ(a[i].direction, b[i].direction);
    EXPECT_EQ(a[i].length, b[i].length);
    EXPECT_EQ(a[i].tensor, b[i].tensor);
    EXPECT_EQ(a[i].change, b[i].change);
    EXPECT_EQ(a[i].in_field, b[i].in_field);
  }
}

void expect_same(const std::vector<Path>& a, const std::vector<Path>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    expect_same(a[i].points, b[i].points);
    EXPECT_EQ(a[i].flexibility, b[i].flexibility);
    EXPECT_EQ(a[i].wavelength, b[i].wavelength);
    EXPECT_EQ(a[i].end, b[i].end);
    EXPECT_EQ(a[i].backward_end, b[i].backward_end);
  }
}

std::vector<Path> without_empty(std::vector<Path> paths) {
  paths.erase(paths.begin());
  return paths;
}

/// Reads a file of these bytes, and what is written to the terminal meanwhile must be nothing.
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

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

/// A file as other programs write it: two lines that share a point, a vertex and a triangle besides.
std::string foreign_vtp(const std::string& connectivity = "0 1 2 2 3") {
  const auto cells = [](const std::string& corners, const std::string& offsets) {
    return "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">" + corners +
           "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">" + offsets + "</DataArray>\n";
  };
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<PolyData>"
         "<Piece NumberOfPoints=\"4\" NumberOfVerts=\"1\" NumberOfLines=\"2\" NumberOfStrips=\"0\" "
         "NumberOfPolys=\"1\">\n<CellData><DataArray type=\"Float32\" Name=\"wavelength\" format=\"ascii\">1 450 650 2"
         "</DataArray></CellData>\n<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">"
         "0 0 0  1 0 0  2 0 0  2 3 0</DataArray></Points>\n<Verts>" +
         cells("3", "1") + "</Verts><Lines>" + cells(connectivity, "3 5") + "</Lines><Polys>" + cells("0 1 3", "3") +
         "</Polys></Piece></PolyData></VTKFile>\n";
}

TEST(VtpPathsTest, ReadBackExactly) {
  const std::vector<Path> paths = some_paths(12);
  const Temporary file("a.vtp");
  write_paths(file.path(), paths);
  expect_same(read_paths(file.path()), without_empty(paths));
}

TEST(VtpPathsTest, CutFilesNeverCrash) {
  const std::vector<Path> paths = some_paths(3);
  const std::string bytes = written("a.vtp", paths);
  for (std::size_t size = 0; size < bytes.size(); size += 10) {
    const Temporary cut("cut.vtp", bytes.substr(0, size));
    if (size < bytes.size() - 1)
      EXPECT_NE(error_of("a.vtp", bytes.substr(0, size)), "") << size;
    else
      expect_same(read_paths(cut.path()), without_empty(paths));
  }
}

TEST(VtpPathsTest, DamagedFilesNeverCrash) {
  const std::string bytes = written("a.vtp", some_paths(3));
  std::mt19937 engine(7);
  for (int i = 0; i < 300; ++i) {
    std::string changed = i % 2 ? bytes : foreign_vtp();
    for (int j = 0; j < 1 + i % 3; ++j) changed[engine() % changed.size()] = static_cast<char>(engine());
    error_of("damaged.vtp", changed);
  }
}

TEST(VtpPathsTest, LinesOfOtherPrograms) {
  const Temporary file("a.vtp", foreign_vtp());
  const std::vector<Path> paths = read_paths(file.path());
  ASSERT_EQ(paths.size(), 2u);
  EXPECT_EQ(paths[0].wavelength, 450);
  EXPECT_EQ(paths[1].wavelength, 650);
  EXPECT_EQ(paths[0].backward_end, std::nullopt);
  ASSERT_EQ(paths[0].points.size(), 3u);
  ASSERT_EQ(paths[1].points.size(), 2u);
  EXPECT_EQ(paths[1].points[1].position, Eigen::Vector3d(2, 3, 0));
  EXPECT_EQ(paths[1].points[1].length, 3);
  for (const PathPoint& point : paths[0].points) {
    EXPECT_EQ(point.direction, Eigen::Vector3d::UnitX());
    EXPECT_TRUE(point.tensor.isZero(0) && point.change.isZero(0));
  }
}

TEST(VtpPathsTest, ErrorsNameTheMend) {
  const std::string bytes = written("a.vtp", some_paths(3)), foreign = foreign_vtp();
  const auto error = [](const std::string& content) { return error_of("a.vtp", content); };
  EXPECT_THAT(error("solid nothing of the kind\n"), HasSubstr("not VTK polydata"));
  EXPECT_THAT(error(replaced(foreign, "type=\"PolyData\"", "type=\"ImageData\"")), HasSubstr("not VTK polydata"));
  EXPECT_THAT(error(foreign_vtp("0 1 2 2 4")), HasSubstr("not there"));
  EXPECT_THAT(error(foreign_vtp("0 1 2 2 -1")), HasSubstr("not there"));
  EXPECT_THAT(error(foreign_vtp("0 1 2 2")), HasSubstr("damaged"));
  EXPECT_THAT(error(replaced(foreign, "3 5<", "3 9000000000000000000<")), HasSubstr("damaged"));
  EXPECT_THAT(error(replaced(foreign, "3 5<", "3 2000000000<")), HasSubstr("damaged"));
  EXPECT_THAT(error(replaced(foreign, "3 5<", "5 3<")), testing::Not(""));
  EXPECT_THAT(error(replaced(foreign, "1 0 0", "1 nan 0")), testing::Not(""));
  EXPECT_THAT(error(replaced(foreign, "NumberOfPoints=\"4\"", "NumberOfPoints=\"4000000000\"")),
              HasSubstr("NumberOfPoints is more"));
  EXPECT_THAT(error(replaced(foreign, "NumberOfLines=\"2\"", "NumberOfLines=\"99999999999999999999999\"")),
              HasSubstr("NumberOfLines is more"));
  std::string moved = bytes;
  moved.insert(bytes.find("offset=\"", bytes.find("Name=\"tensor\"")) + 8, "9");
  EXPECT_THAT(error(moved), HasSubstr("damaged"));
  moved.insert(bytes.find("offset=\"", bytes.find("Name=\"tensor\"")) + 8, "9999999999999");
  EXPECT_THAT(error(moved), HasSubstr("offset is more"));
  EXPECT_THAT(error(replaced(foreign, "version=\"0.1\"", "compressor=\"vtkZLibDataCompressor\"")),
              AllOf(HasSubstr("compressed"), HasSubstr("None")));
  EXPECT_THAT(error(replaced(foreign, "LittleEndian", "BigEndian")), HasSubstr("big-endian"));
  EXPECT_THAT(error(replaced(foreign, "NumberOfLines=\"2\"", "NumberOfLines=\"0\"")), HasSubstr("no path"));

  std::vector<Path> paths = some_paths(3);
  paths[2].points[1].position.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error(written("b.vtp", paths)), HasSubstr("point 3 of its lines is not finite"));
  paths = some_paths(3);
  paths[2].points[1].tensor(0, 1) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(error(written("b.vtp", paths)), HasSubstr("\"tensor\" has a value that is not finite"));
  paths = some_paths(3);
  paths[2].points[1].length = 0;
  EXPECT_THAT(error(written("b.vtp", paths)), HasSubstr("\"length\" does not grow"));
}

/// What python3 prints for a program that reads the file with VTK; empty where it has no VTK.
std::string printed_by_vtk(const std::filesystem::path& file, const std::string& program) {
  const Temporary script("read.py",
                         "import sys\ntry:\n  import vtk\nexcept ImportError:\n  sys.exit()\n"
                         "reader = vtk.vtkXMLPolyDataReader()\nreader.SetFileName(sys.argv[1])\nreader.Update()\n"
                         "data = reader.GetOutput()\npoints, lines = data.GetPointData(), data.GetCellData()\n" +
                             program);
  std::string text;
  for (const std::string python : {"python3", "/usr/bin/python3"}) {
    FILE* pipe = popen((python + " '" + script.path().string() + "' '" + file.string() + "' 2>&1").c_str(), "r");
    std::array<char, 256> piece;
    text.clear();
    while (pipe && std::fgets(piece.data(), piece.size(), pipe)) text += piece.data();
    const int status = pipe ? pclose(pipe) : 1;
    if (status == 0 && !text.empty()) return text;
  }
  return text.find("not found") == std::string::npos ? text : "";
}

TEST(VtpPathsTest, VtkReadsThem) {
  const std::vector<Path> paths = some_paths(4);
  const Temporary file("a.vtp");
  write_paths(file.path(), paths);
  const std::string text = printed_by_vtk(
      file.path(),
      "print(data.GetNumberOfPoints(), data.GetNumberOfLines(), data.GetNumberOfCells())\n"
      "for a in (points, lines):\n"
      "  print(' '.join(sorted(a.GetArrayName(i) for i in range(a.GetNumberOfArrays()))))\n"
      "names = data.GetFieldData().GetAbstractArray('end_names')\n"
      "print(names.GetValue(int(lines.GetArray('end').GetTuple1(2))), lines.GetArray('backward_end').GetTuple1(2))\n"
      "print(data.GetCell(1).GetPointId(2), repr(data.GetPoint(4)[0]), "
      "repr(points.GetArray('tensor').GetTuple9(4)[1]))\n"
      "print('%.6f' % points.GetArray('force').GetTuple3(4)[0], '%.6f' % points.GetArray('axis_major').GetTuple3(4)[2],"
      " '%.6f' % points.GetArray('curvature').GetTuple1(4), points.GetArray('axis_minor').GetTuple3(2))\n");
  if (text.empty()) GTEST_SKIP() << "python3 has no VTK (python3-vtk9)";

  const PathPoint& point = paths[2].points[2];  // The last one of the second polyline: point 4 of the file.
  char expected[1000];
  const auto section = cross_sections(paths[2].points, {1, 1e-300, 1e300})[2];
  std::snprintf(
      expected, sizeof expected,
      "14 4 4\naxis_major axis_minor change curvature direction force in_field length tensor\n"
      "backward_end end flexibility wavelength\nobstacle -1.0\n4 %.17g %.17g\n%.6f %.6f %.6f (0.0, 0.0, 0.0)\n",
      point.position.x(), point.tensor(0, 1), point.force().x(), section.major.z(), point.change.norm());
  // Python prints the fewest digits that keep a number; compare numbers as numbers.
  std::istringstream have(text), want(expected);
  for (std::string a, b; want >> b;) {
    ASSERT_TRUE(have >> a) << text;
    char* end = nullptr;
    const double value = std::strtod(b.c_str(), &end);
    if (*end == 0 && b.find('.') != std::string::npos && b.size() < 12)
      EXPECT_NEAR(std::strtod(a.c_str(), nullptr), value, 2e-6) << text;
    else if (*end == 0)
      EXPECT_EQ(std::strtod(a.c_str(), nullptr), value) << text;
    else
      EXPECT_EQ(a, b) << text;
  }
}

TEST(VtpPathsTest, EveryEncodingOfVtk) {
  const std::vector<Path> paths = some_paths(4);
  const Temporary file("a.vtp"), copy("b.vtp");
  write_paths(file.path(), paths);
  for (const std::string mode : {"SetDataModeToAscii()", "SetDataModeToBinary()", "SetEncodeAppendedData(1)",
                                 "SetEncodeAppendedData(0)", "SetCompressorTypeToZLib()"})
    for (const std::string header : {"32", "64"}) {
      const std::string text =
          printed_by_vtk(file.path(),
                         "writer = vtk.vtkXMLPolyDataWriter()\nwriter.SetInputData(data)"
                         "\nwriter.SetCompressorTypeToNone()\nwriter." +
                             mode + "\nwriter.SetHeaderTypeToUInt" + header + "()\nwriter.SetFileName('" +
                             copy.path().string() + "')\nprint(writer.Write())\n");
      if (text.empty()) GTEST_SKIP() << "python3 has no VTK (python3-vtk9)";
      ASSERT_EQ(text, "1\n");
      if (mode == "SetCompressorTypeToZLib()")
        EXPECT_THAT(message([&] { read_paths(copy.path()); }), HasSubstr("compressed"));
      else if (mode != "SetDataModeToAscii()")
        expect_same(read_paths(copy.path()), without_empty(paths));
      else  // Of fewer digits.
        EXPECT_NEAR(read_paths(copy.path())[3].points[4].tensor(2, 0), paths[4].points[4].tensor(2, 0), 1e-6);
    }
}

TEST(TckPathsTest, HeaderAndTriplets) {
  std::vector<Path> paths = some_paths(2);
  const std::string bytes = written("a.tck", paths);
  EXPECT_THAT(bytes, StartsWith("mrtrix tracks\ndatatype: Float32LE\ncount: 2\nfile: . "));
  const std::size_t offset = std::stoul(bytes.substr(bytes.find("file: . ") + 8));
  EXPECT_EQ(offset, bytes.find("END\n") + 4);
  ASSERT_EQ(bytes.size(), offset + 12 * (2 + 1 + 3 + 1 + 1));
  const auto number = [&](std::size_t i) {
    float value;
    std::memcpy(&value, bytes.data() + offset + 4 * i, sizeof value);
    return value;
  };
  EXPECT_EQ(number(3 * 3 + 1), static_cast<float>(paths[2].points[0].position.y()));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_TRUE(std::isnan(number(3 * 2 + axis)) && std::isnan(number(3 * 6 + axis)));
    EXPECT_TRUE(std::isinf(number(3 * 7 + axis)));
  }
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

/// A number as bytes in the order that is named.
template <class Number>
std::string bytes_of(Number number, bool little_endian) {
  std::string bytes(sizeof number, ' ');
  std::memcpy(&bytes[0], &number, sizeof number);
  return little_endian ? bytes : std::string(bytes.rbegin(), bytes.rend());
}

template <class Number>
std::string triplets(const std::vector<std::array<Number, 3>>& values, bool little_endian) {
  std::string bytes;
  for (const auto& triplet : values)
    for (const Number number : triplet) bytes += bytes_of(number, little_endian);
  return bytes;
}

template <class Number>
void expect_read(const std::string& type, bool little_endian) {
  const Number nan = std::numeric_limits<Number>::quiet_NaN(), inf = std::numeric_limits<Number>::infinity();
  // The header's fields in another order, one that is unknown, room before the data, and a track of a single point.
  const std::string header = "mrtrix tracks    \r\nfile: . 100\nroi: seed a.mif\ndatatype: " + type + "\nEND\n";
  const Temporary file("a.tck", header + std::string(100 - header.size(), ' ') +
                                    triplets<Number>({{0, 0, 0},
                                                      {nan, nan, nan},
                                                      {1, 2, 3},
                                                      {1, 2, 3},
                                                      {1, 2, 4.5},
                                                      {nan, nan, nan},
                                                      {0, 0, 1},
                                                      {0, 0, 3},
                                                      {inf, inf, inf}},
                                                     little_endian));
  const std::vector<Path> paths = read_paths(file.path());
  ASSERT_EQ(paths.size(), 2u) << type;
  ASSERT_EQ(paths[0].points.size(), 2u);
  EXPECT_EQ(paths[0].points[1].position, Eigen::Vector3d(1, 2, 4.5));
  EXPECT_EQ(paths[0].points[1].direction, Eigen::Vector3d(0, 0, 1));
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

TEST(TckPathsTest, DamagedFilesNeverCrash) {
  const std::string bytes = written("a.tck", some_paths(3));
  std::mt19937 engine(7);
  for (int i = 0; i < 500; ++i) {
    std::string changed = bytes;
    for (int j = 0; j < 1 + i % 3; ++j) changed[engine() % (i % 2 ? bytes.size() : 70)] = static_cast<char>(engine());
    error_of("damaged.tck", changed);
  }
}

TEST(TckPathsTest, ErrorsNameTheMend) {
  const std::string bytes = written("a.tck", some_paths(3));
  const auto error = [](const std::string& content) { return error_of("a.tck", content); };
  EXPECT_THAT(error(replaced(bytes, "mrtrix", "matrix")), HasSubstr("not a file of MRtrix tracks"));
  EXPECT_THAT(error(replaced(bytes, "count: 3", "count: 4")), AllOf(HasSubstr("announces 4"), HasSubstr("holds 3")));
  EXPECT_THAT(error(replaced(bytes, "count: 3", "count: x")), HasSubstr("\"count\""));
  EXPECT_THAT(error(replaced(bytes, "Float32LE", "Int32LE")), HasSubstr("datatype"));
  EXPECT_THAT(error(replaced(bytes, "datatype", "number")), HasSubstr("no datatype"));
  EXPECT_THAT(error(replaced(bytes, "file: . ", "file: a ")), HasSubstr("another file"));
  EXPECT_THAT(error(replaced(bytes, "file: . ", "file: . 9")), HasSubstr("offset"));
  EXPECT_THAT(error(replaced(bytes, "file: . ", "none: . ")), HasSubstr("offset"));
  std::string not_finite = bytes;
  not_finite.replace(bytes.find("END\n") + 8, 4, bytes_of(std::numeric_limits<float>::quiet_NaN(), true));
  EXPECT_THAT(error(not_finite), HasSubstr("track 0 is not finite"));
  EXPECT_THAT(error(written("b.tck", {})), HasSubstr("no path"));
}

TEST(PathFilesTest, EndingsAndFolders) {
  const std::vector<Path> paths = some_paths(100);
  EXPECT_THAT(message([&] { write_paths("a.csv", paths); }), HasSubstr(".vtp or .tck"));
  EXPECT_THAT(message([&] { read_paths("a.csv"); }), HasSubstr(".vtp or .tck"));
  EXPECT_THAT(message([&] { read_paths("/no/such/a.vtp"); }), HasSubstr("no such file"));
  EXPECT_THAT(message([&] { read_paths(::testing::TempDir()); }), HasSubstr(".vtp or .tck"));
  for (const std::string name : {"a.vtp", "a.tck"}) {
    const std::filesystem::path missing = "/no/such/folder/" + name;
    EXPECT_THAT(message([&] { write_paths(missing, paths); }), HasSubstr(missing.string() + ": cannot be written"));
    if (!std::filesystem::exists("/dev/full")) continue;
    const Temporary link("full_" + name);  // Removing a link leaves the device.
    std::filesystem::create_symlink("/dev/full", link.path());
    EXPECT_THAT(message([&] { write_paths(link.path(), paths); }), HasSubstr("cannot be written"));
  }
}

TEST(PathFilesTest, BareWayOfACircle) {
  // Unevenly spaced points on a circle of radius 2: tangents and curvature are of second and first order in spacing.
  std::vector<Eigen::Vector3d> positions;
  const auto angle = [](int i) { return 0.01 * i + 0.002 * std::sin(i); };
  for (int i = 0; i < 100; ++i) positions.push_back(2 * Eigen::Vector3d(std::cos(angle(i)), std::sin(angle(i)), 0));
  const PathPoints points = bare_way(positions);
  ASSERT_EQ(points.size(), 100u);
  for (int i = 0; i < 100; ++i) {
    const PathPoint& point = points[static_cast<std::size_t>(i)];
    const Eigen::Vector3d tangent(-std::sin(angle(i)), std::cos(angle(i)), 0);
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
