#include "renderer/meshes/mesh.h"

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <utility>

#include "base/constants.h"
#include "base/text/byte_order.h"
#include "tests/renderer/shapes.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

/// Twice the area of a triangle, along its normal.
Vector3d cross_product(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const Vector3d& a = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

double surface_area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& triangle : mesh.triangles) sum += cross_product(mesh, triangle).norm() / 2;
  return sum;
}

TriangleMesh mesh_of(const std::string& name, const std::string& content) {
  const Temporary file(name, content);
  return read_mesh(file);
}

void expect_closed(TriangleMesh mesh, std::size_t triangles, double expected_volume, double tolerance) {
  EXPECT_EQ(mesh.triangles.size(), triangles);
  EXPECT_NEAR(volume(mesh), expected_volume, tolerance);
  EXPECT_NO_THROW(require_closed(mesh));
}

TriangleMesh unit_box() { return box_mesh({Vector3d::Zero(), Vector3d::Ones()}, Affine3d::Identity()); }

/// A tetrahedron of volume 1/6 whose triangles face outwards.
const std::string tetrahedron_ply =
    ply_header("ascii", 4, 4) + "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

TEST(BoxMeshTest, FollowsTheTransform) {
  Affine3d transform = Eigen::Translation3d(5, 6, 7) * Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()) *
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
  EXPECT_THAT([&] { require_closed(hole); }, ThrowsMessage<std::invalid_argument>(HasSubstr("3 open edges")));
  TriangleMesh flipped = unit_box();
  std::swap(flipped.triangles[4][0], flipped.triangles[4][1]);
  EXPECT_THAT(message([&] { require_closed(flipped); }), HasSubstr("6 open edges"));
  TriangleMesh twice = unit_box();
  twice.triangles.push_back(twice.triangles[0]);
  EXPECT_THROW(require_closed(twice), std::invalid_argument);
}

TEST(RequireClosedTest, AcceptsBoxesThatTouchAlongAnEdge) {
  TriangleMesh mesh = unit_box();
  const TriangleMesh other = box_mesh({Vector3d(1, 1, 0), Vector3d(2, 2, 1)}, Affine3d::Identity());
  for (auto t : other.triangles) {
    for (std::uint32_t& corner : t) corner += corner % 4 == 0 ? 3 : 8;  // At (1, 1, z): that of the first box.
    mesh.triangles.push_back(t);
  }
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  expect_closed(mesh, 24, 2, 1e-12);
}

TEST(RequireClosedTest, RefusesWhatEnclosesNothing) {
  const TriangleMesh leaf{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}}, nothing;
  for (TriangleMesh mesh : {leaf, nothing})
    EXPECT_THAT(message([&] { require_closed(mesh); }), HasSubstr("no volume")) << mesh.triangles.size();
}

/// The tetrahedron in binary, with properties and elements that are not needed. It is moved so that the first byte of
/// its data is that of a line end.
std::string binary_tetrahedron(bool big_endian, const std::string& line_end) {
  std::string content;
  for (const char c : ply_header(big_endian ? "binary_big_endian" : "binary_little_endian", 4, 4))
    content += c == '\n' ? line_end : std::string(1, c);
  content.insert(content.find("element face"), "property uchar red" + line_end + "element junk 2" + line_end +
                                                   "property list ushort double values" + line_end);
  const auto append = [&](auto value) {
    append_number(value, big_endian ? ByteOrder::big : ByteOrder::little, content);
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
      const TriangleMesh mesh = mesh_of("binary.ply", binary_tetrahedron(big_endian, line_end));
      ASSERT_EQ(mesh.vertices.size(), 4u);
      EXPECT_EQ(mesh.vertices[0], Vector3d(1.0000012f, 0, 0));
      expect_closed(mesh, 4, 1 / 6.0, 1e-6);
    }
}

TEST(ReadMeshTest, PlyKeepsDoublePrecisionAndDividesPolygons) {
  const TriangleMesh mesh = mesh_of(
      "quadrilateral.PLY",
      "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty double z\nproperty double x\n"
      "property double y\nelement face 1\nproperty list uchar uint vertex_index\nproperty float quality\nend_header\n"
      "0.1 0 0\n0.1 1 0\n0.1 1 +1\n0.1 0 1\n4 0 1 2 3 0.5\n");
  EXPECT_EQ(mesh.vertices[0], Vector3d(0, 0, 0.1));
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_DOUBLE_EQ(surface_area(mesh), 1);
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
  const TriangleMesh mesh = mesh_of("soup.ply", content);
  EXPECT_EQ(mesh.vertices.size(), 4u);
  expect_closed(mesh, 4, 1 / 6.0, 1e-12);
}

/// The concave arrowhead of area 1/2 that a fan would draw with twice its area, and other polygons, with their areas.
struct Polygon {
  std::vector<Vector3d> corners;
  double area = 0;
};

const std::vector<Polygon> polygons{
    {{{0, -1, 0}, {-0.5, 0, 0}, {0, 1, 0}, {-1, 0, 0}}, 0.5},
    {{{-0.5, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}}, 0.5},
    {{{0, 0, 7}, {3, 0, 7}, {3, 3, 7}, {2, 3, 7}, {2, 1, 7}, {1, 1, 7}, {1, 3, 7}, {0, 3, 7}}, 7},  // A U.
    {{{0, 0, 0}, {0, 1, 0}, {0, 2, 0}, {0, 2, 2}, {0, 0, 2}}, 4},                                   // In a line.
    // A square with a square hole, whose outline is joined to the other by an edge that is there twice.
    {{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 0}, {1, 1, 0}, {1, 3, 0}, {3, 3, 0}, {3, 1, 0}, {1, 1, 0}},
     12},
};

/// @param name  Ends with .ply or .obj.
std::string file_of(const Polygon& polygon, const std::string& name) {
  const bool is_ply = name.find(".ply") != std::string::npos;
  const std::size_t count = polygon.corners.size();
  std::string vertices, face;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3d& P = polygon.corners[i];
    vertices += std::string(is_ply ? "" : "v ") + std::to_string(P.x()) + " " + std::to_string(P.y()) + " " +
                std::to_string(P.z()) + "\n";
    face += " " + std::to_string(is_ply ? i : i + 1);
  }
  if (is_ply) return ply_header("ascii", static_cast<int>(count), 1) + vertices + std::to_string(count) + face + "\n";
  return vertices + "f" + face + "\n";
}

TEST(ReadMeshTest, PolygonsHaveTheirArea) {
  for (const std::string name : {"a.ply", "a.obj"})
    for (std::size_t i = 0; i < polygons.size(); ++i) {
      const TriangleMesh mesh = mesh_of(name, file_of(polygons[i], name));
      EXPECT_EQ(mesh.triangles.size(), polygons[i].corners.size() - 2) << name << " " << i;
      EXPECT_NEAR(surface_area(mesh), polygons[i].area, 1e-6) << name << " " << i;
    }
}

TEST(ReadMeshTest, PolygonsThatCrossThemselvesAreDivided) {
  Polygon star;  // Its corners are on a circle, in an order that has no ear.
  constexpr int count = 5999, step = 2999;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * pi * static_cast<double>(i * static_cast<long>(step) % count) / count;
    star.corners.emplace_back(std::cos(angle) + 1e-3 * (i % 7), std::sin(angle), 0);
  }
  const TriangleMesh mesh = mesh_of("star.obj", file_of(star, ".obj"));
  EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), count - 2, 10);
}

/// Most of its corners are no ear, and each ear that is cut makes only its neighbours one.
TEST(ReadMeshTest, PolygonsWithManyConcaveCornersAreDivided) {
  Polygon crescent;
  constexpr int count = 2999;
  const auto add = [&](double radius, double centre, double angle) {
    crescent.corners.emplace_back(centre + radius * std::cos(angle), radius * std::sin(angle), 0);
  };
  for (int i = 0; i <= count; ++i) add(1, 0, -pi / 2 + pi * i / count);
  for (int i = count - 1; i > 0; --i) add(1.25, -0.75, std::asin(1 / 1.25) * (2.0 * i / count - 1));
  const double segment = 1.25 * 1.25 * (std::asin(0.8) - 0.5 * std::sin(2 * std::asin(0.8)));
  EXPECT_NEAR(surface_area(mesh_of("crescent.obj", file_of(crescent, ".obj"))), pi / 2 - segment, 1e-4);
}

TEST(ReadMeshTest, CornersInALineKeepNeighboursJoined) {
  // A tetrahedron of which one face is a quadrilateral: it has a corner in the middle of an edge, where the triangles
  // of the other face at this edge meet.
  const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n0.5 0 0\n";
  const std::string faces = "4 0 2 1 4\n3 0 4 3\n3 4 1 3\n3 0 3 2\n3 1 2 3\n";
  expect_closed(mesh_of("line.ply", ply_header("ascii", 5, 5) + vertices + faces), 6, 1 / 6.0, 1e-7);
}

TEST(ReadMeshTest, TriangleStripsOfPly) {
  // A cube as one strip of 12 triangles, and the same as two strips with the mark of a new one between them.
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "1 0 0\n0 0 0\n1 1 0\n0 1 0\n1 0 1\n0 0 1\n1 1 1\n0 1 1\n";
  for (const std::string strips : {"14 6 7 4 5 1 7 3 6 2 4 0 1 2 3\n", "18 6 7 4 5 1 7 3 6 -1 3 6 2 4 0 1 2 3 -1\n"})
    expect_closed(mesh_of("strips.ply", header + strips), 12, 1, 1e-12);
}

TEST(ReadMeshTest, EveryWayToWriteAnObjFace) {
  const std::string vertices = "v 0 0 0\nv 2 0 0\nv 0 2 0\n", normals = "vn 0 0 1\n", texture = "vt 0 0\nvt 1 0\n";
  for (const std::string& content :
       {vertices + "f 1 2 3\n", vertices + "f -3 -2 -1", vertices + normals + "f 1//1 2//1 3//1 # its only face\n",
        vertices + normals + "f 1/1/1 2/2/1 3/3/1\n", vertices + texture + "f 1/1 2/2 3/2# a comment\n",
        vertices + texture + normals + "f -3/-2/-1 -2/-1/-1 -1/-1/-1\r\n", "f 1 2 3\n" + vertices,
        "\xef\xbb\xbf# begins with a mark\no a\ng b c\ns 1\nusemtl d\n" + vertices + "l 1 2\np 1\n  f 1 \\\n 2 3\n",
        std::string("v 0 0 0 1 0 0\nv 2 0 0 0 1 0\nv 0 4 0 2\nf 1/ 2/ 3/\n")})
    EXPECT_DOUBLE_EQ(surface_area(mesh_of("face.obj", content)), 2) << content;
}

TEST(ReadMeshTest, PlyFilesThatWereCutOffAreRefused) {
  for (const std::string& whole : {tetrahedron_ply.substr(0, tetrahedron_ply.size() - 2),  // Without "3\n".
                                   binary_tetrahedron(false, "\n")})
    for (std::size_t size = 1; size < whole.size(); ++size) {
      const std::string text = message([&] { mesh_of("cut.ply", whole.substr(0, size)); });
      EXPECT_THAT(text, testing::AnyOf(HasSubstr("cut off"), HasSubstr("not a PLY"))) << size;
    }
}

/// `text`, with one part of it replaced.
std::string replaced(std::string text, const std::string& part, const std::string& by) {
  return text.replace(text.find(part), part.size(), by);
}

TEST(ReadMeshTest, BadFilesAreOneClearLine) {
  const std::string garbage = "no mesh at all\n\x01\x02\x03 v f\n", three = "v 0 0 0\nv 2 0 0\nv 0 2 0\n";
  const std::string strip =
      "ply\nformat binary_little_endian 1.0\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n";
  for (const auto& [name, content, error] : std::vector<std::array<std::string, 3>>{
           {"empty.ply", "", "empty"},
           {"garbage.ply", garbage, "cannot read the mesh"},
           {"garbage.obj", garbage, "cannot read the mesh"},
           {"garbage.stl", garbage, "cannot read the mesh"},
           {"garbage.unknown", garbage, "cannot read the mesh"},
           {"points.ply", ply_header("ascii", 2, 0) + "0 0 0\n1 1 1\n", "no triangles"},
           {"lines.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n", "no triangles"},
           {"flat.ply", ply_header("ascii", 3, 1) + "0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n", "no triangles"},
           {"bad.obj", three + "f 1 2 0\n", "line 4: the face names vertex 0"},
           {"bad.obj", three + "f 1 2 3\nf 1 2 -4\n", "line 5: the face names vertex -4"},
           {"bad.obj", three + "f 1//1 2//1 3//1\n", "line 4: the face names normal 1 of 0"},
           {"bad.obj", three + "f 1 2 x\n", "line 4: the face has \"x\""},
           {"bad.obj", three + "f 1 2 3x\n", "line 4: the face has \"3x\""},
           {"bad.obj", three + "f 1 2\n", "line 4: a face needs at least three"},
           {"bad.obj", three + "v 1 2\n", "line 4: \"v\" needs three numbers"},
           {"bad.obj", three + "v 1 2 three\n", "line 4: \"three\" is not a number"},
           {"bad.obj", three + "v 1e400 0 0\nf 1 2 4\n", "vertex 2 is not finite"},
           {"bad.obj", three + "surf 0 1 0 1 1 2\n", "line 4: \"surf\" is not read"},
           {"bad.obj", three + "F 1 2 3\n", "line 4: \"F\" is not read"},
           {"bad.obj", three + "v 0 0 0 0\n", "line 4: the vertex has the weight 0"},
           {"two.ply", ply_header("ascii", 3, 1) + "0 0 0\n1 0 0\n0 1 0\n2 0 1\n", "face 0 has 2 corners"},
           {"index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "line 4: the face names vertex 9 of 3"},
           {"nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"},
           {"index.ply", replaced(tetrahedron_ply, "3 1 2 3", "3 1 2 4"), "not there"},
           {"negative.ply", replaced(tetrahedron_ply, "3 1 2 3", "3 1 2 -1"), "not there"},
           {"word.ply", ply_header("ascii", 1, 0) + "0 zero 0\n", "\"zero\" is not a number"},
           {"type.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty complex x\nend_header\n1\n", "\"complex\""},
           {"count.ply", "ply\nformat ascii 1.0\nelement vertex\nend_header\n", "no count"},
           {"strip.ply", strip + std::string("\xff\xc9\x9a\x3b", 4), "cut off"},
           {"huge.ply", ply_header("binary_little_endian", 2000000000, 3) + "abc", "cut off"},
           {"nan.ply", replaced(tetrahedron_ply, "1 0 0", "nan 0 0"), "not finite"},
           {"far.ply", replaced(tetrahedron_ply, "1 0 0", "1e39 0 0"), "vertex 1 is not finite in single precision"}}) {
    const Temporary file(name, content);
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    const std::string text = message([&] { read_mesh(file); });
    EXPECT_EQ(::testing::internal::GetCapturedStdout() + ::testing::internal::GetCapturedStderr(), "") << name;
    EXPECT_THAT(text, AllOf(HasSubstr(file.string() + ": "), HasSubstr(error)));
  }
  EXPECT_EQ(message([] { read_mesh("/no/such.ply"); }), "cannot read /no/such.ply: no such file");
  EXPECT_THAT(message([] { read_mesh(::testing::TempDir()); }), HasSubstr("folder"));
}

/// A sphere of radius 2 about the origin, open at its ends.
std::string sphere_ply(bool normals) {
  constexpr int rows = 24, columns = 48;
  std::string header = ply_header("ascii", rows * columns, (rows - 1) * columns), content, faces;
  if (normals) header.insert(header.find("element face"), "property float nx\nproperty float ny\nproperty float nz\n");
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const double theta = pi * (i + 0.5) / rows, phi = 2 * pi * j / columns;
      for (int repeat = 0; repeat < (normals ? 2 : 1); ++repeat)
        for (const double x : {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)})
          content += std::to_string((repeat == 0 ? 2 : 1) * x) + " ";
      content += "\n";
      const int next = (j + 1) % columns;
      if (i + 1 < rows)
        faces += "4 " + std::to_string(i * columns + j) + " " + std::to_string((i + 1) * columns + j) + " " +
                 std::to_string((i + 1) * columns + next) + " " + std::to_string(i * columns + next) + "\n";
    }
  return header + content + faces;
}

TEST(MeshNormalsTest, AreThoseOfTheFileOrMadeByAngle) {
  for (const bool in_file : {true, false}) {
    const Temporary file("sphere.ply", sphere_ply(in_file));
    const std::optional<double> angle = in_file ? std::nullopt : std::optional(0.5);
    const MeshWithNormals sphere = read_mesh_with_normals(file, angle);
    ASSERT_EQ(sphere.normals.size(), 24u * 48u);
    for (std::size_t i = 0; i < sphere.normals.size(); ++i) {
      const Vector3d P = sphere.mesh.vertices[i];
      if (std::abs(P.z()) > 1.98) continue;  // The rims of the open ends.
      EXPECT_LT((sphere.normals[i].cast<double>() - P / 2).norm(), in_file ? 1e-5 : 0.01) << P.transpose();
    }
  }
  const Temporary flat("flat.ply", sphere_ply(false));
  EXPECT_TRUE(read_mesh_with_normals(flat, std::nullopt).normals.empty());
}

TEST(MeshNormalsTest, OfACubeDependOnTheAngle) {
  const Temporary file("cube.obj",
                       "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
                       "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n");
  const MeshWithNormals sharp = read_mesh_with_normals(file, 89 * pi / 180);
  EXPECT_EQ(sharp.mesh.vertices.size(), 24u);
  for (const auto& triangle : sharp.mesh.triangles) {
    const Vector3d flat = cross_product(sharp.mesh, triangle).normalized();
    for (const std::uint32_t corner : triangle) EXPECT_LT((sharp.normals[corner].cast<double>() - flat).norm(), 1e-6);
  }
  // Weights by angle: three faces meet alike at each corner, however they are divided.
  const MeshWithNormals round = read_mesh_with_normals(file, pi / 2);
  EXPECT_EQ(round.mesh.vertices.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_LT((round.normals[i].cast<double>() - round.mesh.vertices[i].normalized()).norm(), 1e-6);
}

TEST(MeshNormalsTest, OfObjBelongToCorners) {
  // Two triangles share an edge with different normals; the second has a corner without one.
  const Temporary file("corners.obj",
                       "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 2//2 4 3//2\n");
  const MeshWithNormals mesh = read_mesh_with_normals(file, std::nullopt);
  ASSERT_EQ(mesh.mesh.vertices.size(), 6u);
  const auto normal = [&](int triangle, int corner) { return mesh.normals[mesh.mesh.triangles[triangle][corner]]; };
  for (int corner = 0; corner < 3; ++corner) EXPECT_EQ(normal(0, corner), Vector3f(0, 0, 1));
  EXPECT_EQ(normal(1, 0), Vector3f(0, 1, 0));
  EXPECT_EQ(normal(1, 1), Vector3f(0, 0, 0));
  EXPECT_EQ(read_mesh(file).vertices.size(), 4u);
}

TEST(MeshNormalsTest, OfPlyMayBeMissing) {
  // Vertices with and without normals, and numbers that are too small for double precision.
  const std::string position = "property float x\nproperty float y\nproperty float z\n";
  const std::string with = "element vertex 1\n" + position + "property float nz\n";
  const std::string without = "element vertex 2\n" + position;
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const std::string& content :
       {with + without + face + "0 0 1e-400 1\n+1 0 0\n0 1 0\n", without + with + face + "1 0 0\n0 1 0\n0 0 0 1\n"}) {
    const Temporary file("mixed.ply", "ply\nformat ascii 1.0\n" + content + "3 0 1 2\n");
    const MeshWithNormals mesh = read_mesh_with_normals(file, std::nullopt);
    ASSERT_EQ(mesh.normals.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(mesh.normals[i].z(), mesh.mesh.vertices[i].isZero() ? 1 : 0) << i;
  }
}

}  // namespace
}  // namespace tensorray
