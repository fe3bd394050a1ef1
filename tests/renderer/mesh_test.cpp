#include "renderer/surfaces/mesh.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/renderer/support.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

double volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles)
    sum += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
  return sum;
}

double surface_area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vector3d& a = mesh.vertices[t[0]];
    sum += (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm() / 2;
  }
  return sum;
}

TriangleMesh unit_box() { return box_mesh({Vector3d::Zero(), Vector3d::Ones()}, Eigen::Affine3d::Identity()); }

std::string ply_header(const std::string& format, int vertices, int faces) {
  return "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(vertices) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(faces) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

/// A tetrahedron of volume 1/6 whose triangles face outwards.
const std::string tetrahedron_ply =
    ply_header("ascii", 4, 4) + "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

TEST(BoxMeshTest, LooksOutwards) {
  const AlignedBox3d box(Vector3d(-1, 2, 0.5), Vector3d(1, 3, 4));
  TriangleMesh mesh = box_mesh(box, Eigen::Affine3d::Identity());
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_DOUBLE_EQ(volume(mesh), box.volume());
  EXPECT_DOUBLE_EQ(surface_area(mesh), 2 * (2 * 1 + 1 * 3.5 + 2 * 3.5));
  EXPECT_EQ(mesh.bounds().min(), box.min());
  EXPECT_EQ(mesh.bounds().max(), box.max());
  EXPECT_NO_THROW(require_closed(mesh));
}

TEST(BoxMeshTest, FollowsTheTransform) {
  Eigen::Affine3d transform = Eigen::Translation3d(5, 6, 7) * Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()) *
                              Eigen::Scaling(2.0, 3.0, 0.5);
  EXPECT_NEAR(volume(box_mesh({Vector3d::Zero(), Vector3d::Ones()}, transform)), 3, 1e-12);
  transform.linear().col(0) *= -1;  // A reflection reverses the order of the corners.
  EXPECT_NEAR(volume(box_mesh({Vector3d::Zero(), Vector3d::Ones()}, transform)), 3, 1e-12);
}

TEST(RequireClosedTest, TurnsMeshesOutwards) {
  TriangleMesh mesh = unit_box();
  for (Vector3d& vertex : mesh.vertices) vertex += Vector3d(1000, -2000, 500);
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  require_closed(mesh);
  EXPECT_NEAR(volume(mesh), 1, 1e-6);
  const auto before = mesh.triangles;
  require_closed(mesh);
  EXPECT_EQ(mesh.triangles, before);
}

TEST(RequireClosedTest, CountsOpenEdges) {
  TriangleMesh hole = unit_box();
  hole.triangles.pop_back();
  EXPECT_THAT(message([&] { require_closed(hole); }), HasSubstr("3 open edges"));
  EXPECT_THROW(require_closed(hole), std::invalid_argument);
  TriangleMesh flipped = unit_box();
  std::swap(flipped.triangles[4][0], flipped.triangles[4][1]);
  EXPECT_THAT(message([&] { require_closed(flipped); }), HasSubstr("6 open edges"));
  TriangleMesh twice = unit_box();
  twice.triangles.push_back(twice.triangles[0]);
  EXPECT_THROW(require_closed(twice), std::invalid_argument);
}

TEST(RequireClosedTest, AcceptsBoxesThatTouchAlongAnEdge) {
  TriangleMesh mesh = unit_box();
  const TriangleMesh other = box_mesh({Vector3d(1, 1, 0), Vector3d(2, 2, 1)}, Eigen::Affine3d::Identity());
  for (auto t : other.triangles) {
    for (std::uint32_t& index : t) {
      const Vector3d& vertex = other.vertices[index];
      const auto found = std::find(mesh.vertices.begin(), mesh.vertices.end(), vertex);
      index = static_cast<std::uint32_t>(found - mesh.vertices.begin());
      if (found == mesh.vertices.end()) mesh.vertices.push_back(vertex);
    }
    mesh.triangles.push_back(t);
  }
  EXPECT_EQ(mesh.vertices.size(), 14u);
  EXPECT_NO_THROW(require_closed(mesh));
}

TEST(RequireClosedTest, RefusesWhatEnclosesNothing) {
  TriangleMesh leaf;
  leaf.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  leaf.triangles = {{0, 1, 2}, {0, 2, 1}};
  EXPECT_THAT(message([&] { require_closed(leaf); }), HasSubstr("no volume"));
  TriangleMesh nothing;
  EXPECT_THAT(message([&] { require_closed(nothing); }), HasSubstr("no volume"));
}

TEST(ReadMeshTest, AsciiPly) {
  const Temporary file("tetrahedron.ply", tetrahedron_ply);
  TriangleMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_NEAR(volume(mesh), 1 / 6.0, 1e-7);
  EXPECT_NO_THROW(require_closed(mesh));
}

/// The tetrahedron in binary, with properties and elements that are not needed. It is moved so that the first byte of
/// its data is that of a line end.
std::string binary_tetrahedron(bool big_endian, const std::string& line_end) {
  std::string content;
  for (const char c : ply_header(big_endian ? "binary_big_endian" : "binary_little_endian", 4, 4))
    content += c == '\n' ? line_end : std::string(1, c);
  content.insert(content.find("element face"), "property uchar red" + line_end + "element junk 2" + line_end +
                                                   "property list ushort double values" + line_end);
  const auto append = [&](const auto& value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof(value));
    if (big_endian) std::reverse(bytes.begin(), bytes.end());
    content += bytes;
  };
  const float odd = 1.0000012f;  // Its bits are 0x3f80000a; the lowest byte is a line feed.
  const float vertices[4][3] = {{odd, 0, 0}, {odd + 1, 0, 0}, {odd, 1, 0}, {odd, 0, 1}};
  for (const auto& vertex : vertices) {
    for (const float coordinate : vertex) append(coordinate);
    append(static_cast<unsigned char>(200));
  }
  for (const std::uint16_t count : {std::uint16_t{0}, std::uint16_t{2}}) {
    append(count);
    for (int i = 0; i < count; ++i) append(0.5 * i);
  }
  const int corners[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  for (const auto& triangle : corners) {
    append(static_cast<unsigned char>(3));
    for (const int index : triangle) append(index);
  }
  return content;
}

TEST(ReadMeshTest, BinaryPly) {
  for (const bool big_endian : {false, true})
    for (const std::string line_end : {"\n", "\r\n"}) {
      const Temporary file("binary.ply", binary_tetrahedron(big_endian, line_end));
      TriangleMesh mesh = read_mesh(file.path());
      ASSERT_EQ(mesh.vertices.size(), 4u);
      EXPECT_EQ(mesh.vertices[0], Vector3d(1.0000012f, 0, 0));
      EXPECT_NEAR(volume(mesh), 1 / 6.0, 1e-6);
      EXPECT_NO_THROW(require_closed(mesh));
    }
}

TEST(ReadMeshTest, PlyKeepsDoublePrecisionAndFansPolygons) {
  const Temporary file("quadrilateral.PLY",
                       "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty double z\n"
                       "property double x\nproperty double y\nelement face 1\nproperty list uchar uint vertex_index\n"
                       "property float quality\nend_header\n"
                       "0.1 0 0\n0.1 1 0\n0.1 1 +1\n0.1 0 1\n4 0 1 2 3 0.5\n");
  const TriangleMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.vertices[0], Vector3d(0, 0, 0.1));
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_DOUBLE_EQ(surface_area(mesh), 1);
}

TEST(ReadMeshTest, ObjWithPolygonsAndSeveralObjects) {
  // A unit cube of quadrilaterals, and a separate tetrahedron as second object. Both have normals, which differ at the
  // corners that faces share.
  const Temporary file("objects.obj",
                       "o cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                       "vn 0 0 -1\nvn 0 0 1\nvn 0 -1 0\nvn 0 1 0\nvn -1 0 0\nvn 1 0 0\n"
                       "f 1//1 4//1 3//1 2//1\nf 5//2 6//2 7//2 8//2\nf 1//3 2//3 6//3 5//3\n"
                       "f 4//4 8//4 7//4 3//4\nf 1//5 5//5 8//5 4//5\nf 2//6 3//6 7//6 6//6\n"
                       "o tetrahedron\nv 5 0 0\nv 6 0 0\nv 5 1 0\nv 5 0 1\n"
                       "f 9 11 10\nf 9 10 12\nf 9 12 11\nf 10 11 12\n");
  TriangleMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.vertices.size(), 12u);
  EXPECT_EQ(mesh.triangles.size(), 16u);
  EXPECT_NO_THROW(require_closed(mesh));
  EXPECT_NEAR(volume(mesh), 1 + 1 / 6.0, 1e-6);
}

TEST(ReadMeshTest, JoinsEqualPositionsAndDropsDegenerateTriangles) {
  // The tetrahedron with separate vertices for each corner (one coordinate is -0), and two degenerate triangles: a line
  // and a point.
  std::string content = ply_header("ascii", 18, 6);
  const std::string corners[4] = {"0 0 0\n", "1 0 0\n", "0 1 0\n", "-0 0 1\n"};
  for (const int corner : {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}) content += corners[corner];
  content += "0 0 0\n1 0 0\n3 0 0\n2 2 2\n2 2 2\n7 8 9\n";
  for (int i = 0; i < 18; i += 3)
    content += "3 " + std::to_string(i) + " " + std::to_string(i + 1) + " " + std::to_string(i + 2) + "\n";
  const Temporary file("soup.ply", content);
  TriangleMesh mesh = read_mesh(file.path());
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_NO_THROW(require_closed(mesh));
}

TEST(ReadMeshTest, PlyFilesThatWereCutOffAreRefused) {
  for (const std::string& whole : {tetrahedron_ply.substr(0, tetrahedron_ply.size() - 2),  // Without "3\n".
                                   binary_tetrahedron(false, "\n")})
    for (std::size_t size = 1; size < whole.size(); ++size) {
      const Temporary file("cut.ply", whole.substr(0, size));
      const std::string text = message([&] { read_mesh(file.path()); });
      EXPECT_TRUE(text.find("cut off") != std::string::npos || text.find("not a PLY") != std::string::npos)
          << size << ": " << text;
    }
}

TEST(ReadMeshTest, BadFilesAreOneClearLine) {
  const auto error = [](const std::string& name, const std::string& content) {
    const Temporary file(name, content);
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    const std::string text = message([&] { read_mesh(file.path()); });
    EXPECT_EQ(::testing::internal::GetCapturedStdout() + ::testing::internal::GetCapturedStderr(), "") << name;
    EXPECT_THAT(text, HasSubstr(file.path().string() + ": "));
    return text;
  };
  EXPECT_THAT(error("empty.ply", ""), HasSubstr("empty"));
  for (const std::string name : {"garbage.ply", "garbage.obj", "garbage.stl", "garbage.unknown"})
    EXPECT_THAT(error(name, "no mesh at all\n\x01\x02\x03 v f\n"), HasSubstr("cannot read the mesh"));
  EXPECT_THAT(error("points.ply", ply_header("ascii", 2, 0) + "0 0 0\n1 1 1\n"), HasSubstr("no triangles"));
  EXPECT_THAT(error("lines.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"), HasSubstr("no triangles"));
  EXPECT_THAT(error("flat.ply", ply_header("ascii", 3, 1) + "0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n"),
              HasSubstr("no triangles"));
  EXPECT_THAT(error("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), HasSubstr("index"));
  EXPECT_THAT(error("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), HasSubstr("not finite"));
  std::string beyond = tetrahedron_ply;
  beyond.replace(beyond.find("3 1 2 3"), 7, "3 1 2 4");
  EXPECT_THAT(error("index.ply", beyond), HasSubstr("not there"));
  beyond.replace(beyond.find("3 1 2 4"), 7, "3 1 2 -1");
  EXPECT_THAT(error("negative.ply", beyond), HasSubstr("not there"));
  EXPECT_THAT(error("word.ply", ply_header("ascii", 1, 0) + "0 zero 0\n"), HasSubstr("\"zero\" is not a number"));
  EXPECT_THAT(error("type.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty complex x\nend_header\n1\n"),
              HasSubstr("\"complex\""));
  EXPECT_THAT(error("count.ply", "ply\nformat ascii 1.0\nelement vertex\nend_header\n"), HasSubstr("no count"));
  EXPECT_THAT(error("huge.ply", ply_header("binary_little_endian", 2000000000, 3) + "abc"), HasSubstr("cut off"));
  std::string not_finite = tetrahedron_ply;
  not_finite.replace(not_finite.find("1 0 0"), 5, "nan 0 0");
  EXPECT_THAT(error("nan.ply", not_finite), HasSubstr("not finite"));
  not_finite.replace(not_finite.find("nan 0 0"), 7, "1e39 0 0");
  EXPECT_THAT(error("far.ply", not_finite), HasSubstr("vertex 1 is not finite in single precision"));
  EXPECT_EQ(message([] { read_mesh("/no/such.ply"); }), "cannot read /no/such.ply: no such file");
  EXPECT_THAT(message([] { read_mesh(::testing::TempDir()); }), HasSubstr("folder"));
}

}  // namespace
}  // namespace tensorray
