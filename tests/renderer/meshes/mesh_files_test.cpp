#include <cstdio>

#include <nlohmann/json.hpp>

#include "renderer/meshes/mesh.h"
#include "tests/renderer/shapes.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

/// A closed mesh and its attributes.
struct Sample {
  explicit Sample(int rings) {
    const ShadedSurface surface = sphere(rings);
    mesh = std::get<TriangleMesh>(surface.shape);
    normals = surface.normals;
    for (std::size_t i = 0; i < normals.size(); ++i) {
      colors.push_back({static_cast<std::uint8_t>(i % 256), static_cast<std::uint8_t>(255 - i % 256), 10});
      values.push_back(0.1f * static_cast<float>(i));
    }
  }

  TriangleMesh mesh;
  std::vector<Vector3f> normals;
  std::vector<std::array<std::uint8_t, 3>> colors;
  std::vector<float> values;

  VertexAttributes attributes() const { return {&normals, &colors, &values, "force"}; }
};

/// The corners of all triangles, in the precision of files.
std::vector<Vector3f> all_corners(const TriangleMesh& mesh) {
  std::vector<Vector3f> corners;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) corners.push_back(mesh.vertices[vertex].cast<float>());
  return corners;
}

TEST(MeshFilesTest, ReadBack) {
  const Sample sample(170);  // Larger than the pieces that are written.
  for (const std::string name : {"a.ply", "a.obj", "a.PLY"}) {
    const Temporary file(name);  // The second file is shorter than the first, and takes its place.
    for (const bool with_attributes : {true, false}) {
      write_mesh(file, sample.mesh, with_attributes ? sample.attributes() : VertexAttributes());
      EXPECT_GT(std::filesystem::file_size(file), 2u << 20);
      const TriangleMesh read = read_mesh(file);
      EXPECT_LE(read.vertices.size(), sample.mesh.vertices.size());
      EXPECT_TRUE(all_corners(read) == all_corners(sample.mesh)) << name << with_attributes;
    }
  }
}

TEST(MeshFilesTest, PlyHoldsAttributes) {
  const Sample sample(2);
  const Temporary file("a.ply");
  write_mesh(file, sample.mesh, sample.attributes());
  std::string expected =
      "ply\nformat binary_little_endian 1.0\nelement vertex 12\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\nproperty float force\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nelement face 8\nproperty list uchar uint vertex_indices\n"
      "end_header\n";
  const auto append = [&](const auto* numbers, std::size_t count) {
    expected.append(reinterpret_cast<const char*>(numbers), count * sizeof *numbers);
  };
  for (std::size_t i = 0; i < sample.values.size(); ++i) {
    append(Vector3f(sample.mesh.vertices[i].cast<float>()).data(), 3);
    append(sample.normals[i].data(), 3);
    append(&sample.values[i], 1);
    append(sample.colors[i].data(), 3);
  }
  for (const auto& triangle : sample.mesh.triangles) {
    expected += '\3';
    append(triangle.data(), 3);
  }
  EXPECT_EQ(read_bytes(file), expected);
}

TEST(MeshFilesTest, ObjHoldsColorsAndNormals) {
  Sample sample(11);  // More than 256 vertices: all values of a channel.
  for (Vector3d& position : sample.mesh.vertices) position = (8 * position).array().round();
  const Temporary file("a.obj");
  write_mesh(file, sample.mesh, sample.attributes());
  std::string expected;
  char text[200];
  for (std::size_t i = 0; i < sample.values.size(); ++i) {
    const Vector3d &P = sample.mesh.vertices[i], N = sample.normals[i].cast<double>();
    const auto& [r, g, b] = sample.colors[i];
    std::snprintf(text, sizeof text, "v %g %g %g %.3f %.3f %.3f\nvn %.4f %.4f %.4f\n", P.x(), P.y(), P.z(), r / 255.0,
                  g / 255.0, b / 255.0, N.x(), N.y(), N.z());
    expected += text;
  }
  for (const auto& [a, b, c] : sample.mesh.triangles) {
    std::snprintf(text, sizeof text, "f %u//%u %u//%u %u//%u\n", a + 1, a + 1, b + 1, b + 1, c + 1, c + 1);
    expected += text;
  }
  EXPECT_EQ(read_bytes(file), expected);
}

TEST(MeshFilesTest, ErrorsNameTheMend) {
  Sample sample(2);
  const auto error = [&](const std::filesystem::path& path) {
    return message([&] { write_mesh(path, sample.mesh, sample.attributes()); });
  };
  EXPECT_THAT(error("a.stl"), HasSubstr(".ply or .obj"));
  EXPECT_THAT(error("/no/such/folder/a.ply"), HasSubstr("/no/such/folder/a.ply: cannot be written"));
  if (std::filesystem::exists("/dev/full")) {
    const Temporary link("full.obj");  // Removing the link does not remove the device.
    std::filesystem::create_symlink("/dev/full", link);
    EXPECT_THAT(error(link), HasSubstr("cannot be written"));
  }
  const Temporary file("a.ply");
  const VertexAttributes two_words{nullptr, nullptr, &sample.values, "a b"};
  EXPECT_THAT(message([&] { write_mesh(file, sample.mesh, two_words); }), HasSubstr("one word"));
  sample.mesh.vertices[7].x() = 1e39;
  EXPECT_THAT(error(file), HasSubstr("vertex 7"));
  sample.values.pop_back();
  EXPECT_THAT(error(file), HasSubstr("11 values"));
  EXPECT_FALSE(std::filesystem::exists(file));
}

std::string base64(const std::string& bytes) {
  const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += 6) {
    int digit = 0;
    for (std::size_t i = bit; i < bit + 6; ++i)
      digit = 2 * digit + (i / 8 < bytes.size() ? bytes[i / 8] >> (7 - i % 8) & 1 : 0);
    text += digits[digit];
  }
  return text + std::string((4 - text.size() % 4) % 4, '=');
}

/// The bytes of numbers in their order.
template <class Number>
std::string binary(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

std::string data_uri(const std::string& bytes, const std::string& type = "") {
  return "data:" + type + ";base64," + base64(bytes);
}

const std::string right_triangle = binary<float>({0, 0, 0, 0, 1, 0, 0, 0, 1});

/// The file of a triangle with the positions of `right_triangle`, and its places in pictures, which follow.
nlohmann::json triangle_gltf(const std::string& bytes) {
  auto json = nlohmann::json::parse(R"({
      "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "buffers": [{}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}],
      "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36}],
      "accessors": [{"bufferView": 0, "count": 3, "type": "VEC3", "componentType": 5126, "min": [0, 0, 0],
                     "max": [0, 1, 1]}, {"bufferView": 1, "count": 3, "type": "VEC2", "componentType": 5126}]})");
  json["buffers"][0] = {{"uri", data_uri(bytes)}, {"byteLength", bytes.size()}};
  json["bufferViews"][1]["byteLength"] = bytes.size() - 36;
  return json;
}

struct Quantized {
  int type;
  std::size_t bytes;
  double greatest;
};

/// A triangle (1, 0, 0), (0, 2, 0), (0, 0, -3), in integers, with a further attribute of other integers.
std::string triangle_numbers(const Quantized& kind) {
  std::string bytes(8, '\x55');  // Of another view.
  for (const int corner : {0, 1, 2}) {
    std::string vertex(4 * kind.bytes, '\0');
    const int value = corner < 2 ? corner + 1 : kind.type % 2 == 0 ? -3 : 3;
    for (std::size_t i = 0; i < kind.bytes; ++i)
      vertex[static_cast<std::size_t>(corner) * kind.bytes + i] = static_cast<char>(value >> 8 * i);
    bytes += vertex;
  }
  return bytes;
}

nlohmann::json quantized_gltf(const Quantized& kind, bool is_normalized) {
  const std::string numbers = triangle_numbers(kind);
  const double scale = is_normalized ? kind.greatest : 1;
  nlohmann::json json = triangle_gltf(numbers);
  json["extensionsRequired"] = {"KHR_mesh_quantization", "KHR_materials_unlit"};
  json["nodes"][0].update({{"translation", {10, 0, 0}}, {"scale", {scale, scale, scale}}});
  json["bufferViews"].erase(1);
  json["bufferViews"][0].update(
      {{"byteOffset", 4}, {"byteLength", numbers.size() - 4}, {"byteStride", 4 * kind.bytes}});
  json["accessors"][0].update({{"byteOffset", 4}, {"componentType", kind.type}, {"normalized", is_normalized}});
  json["accessors"][0].update({{"min", {0, 0, -3}}, {"max", {1, 2, 3}}});
  json["accessors"][1].update({{"bufferView", 0}, {"componentType", 5120}, {"normalized", true}});
  return json;
}

TEST(Gltf, QuantizedPositionsAreDecodedInAllForms) {
  for (const Quantized& kind : {Quantized{5120, 1, 127}, {5121, 1, 255}, {5122, 2, 32767}, {5123, 2, 65535}})
    for (const bool is_normalized : {false, true}) {
      const std::string numbers = triangle_numbers(kind);
      const Temporary beside("numbers.bin", numbers);
      nlohmann::json json = quantized_gltf(kind, is_normalized);
      const auto text_with = [&](const std::string& uri) {
        json["buffers"][0]["uri"] = uri;
        return json.dump();
      };
      const std::string with_file = text_with(beside.filename());
      const std::string with_data = text_with(data_uri(numbers, "application/octet-stream"));
      json["buffers"][0].erase("uri");
      const auto chunk = [](const std::string& type, const std::string& content) {
        return binary<std::uint32_t>({static_cast<std::uint32_t>(content.size())}) + type + content;
      };
      const std::string text = json.dump() + std::string(3 - (json.dump().size() + 3) % 4, ' ');
      const std::string chunks = chunk("JSON", text) + chunk(std::string("BIN\0", 4), numbers);
      const std::string glb =
          "glTF" + binary<std::uint32_t>({2, static_cast<std::uint32_t>(12 + chunks.size())}) + chunks;
      for (const auto& [name, content] : {std::pair("a.gltf", with_file), {"b.gltf", with_data}, {"a.glb", glb}}) {
        const Temporary file(name, content);
        const TriangleMesh mesh = read_mesh(file);
        ASSERT_EQ(mesh.vertices.size(), 3u) << name;
        const double last = kind.type % 2 == 0 ? -3 : 3;
        const std::vector<Vector3d> expected{{11, 0, 0}, {10, 0, 2}, {10, -last, 0}};  // +y is up in the file.
        for (std::size_t i = 0; i < 3; ++i)
          EXPECT_LT((mesh.vertices[i] - expected[i]).norm(), 1e-5) << name << kind.type << is_normalized << " " << i;
      }
    }
}

using Places = std::vector<Eigen::Vector2f>;

TEST(Gltf, TextureCoordinatesMayBeIntegers) {
  for (const auto& [type, places] :  // (0, 1), (1, 0), (0, 0) from the upper left corner.
       {std::pair(5121, std::string("\0\xff\0\0\xff\0\0\0\0\0\0\0", 12)),
        {5123, std::string("\0\0\xff\xff\xff\xff\0\0\0\0\0\0", 12)}}) {
    nlohmann::json json = triangle_gltf(right_triangle + places);
    json["bufferViews"][1]["byteStride"] = 4;
    json["accessors"][1].update({{"componentType", type}, {"normalized", true}});
    const Temporary file("a.gltf", json.dump());
    EXPECT_EQ(read_mesh_with_normals(file, {}).places, (Places{{0, 0}, {1, 1}, {0, 1}})) << type;
  }
}

// The extension's own example: the lower left quarter of the picture, turned by a quarter. Corners in the format's
// axes, v down: (0, 0), (1, 0), (0, 1) become (0, 1), (0, 0.5), (0.5, 1).
TEST(Gltf, PicturesOfTheBaseColourMove) {
  const std::string transform = R"({"index": 0, "extensions": {"KHR_texture_transform": {
      "offset": [0, 1], "scale": [0.5, 0.5], "rotation": 1.57079632679, "texCoord": 1}}})";
  for (const auto& [texture, expected] : {std::pair(transform, Places{{0, 0}, {0, 0.5F}, {0.5F, 0}}),
                                          {R"({"index": 0, "texCoord": 1})", Places{{0, 1}, {1, 1}, {0, 0}}},
                                          {R"({"index": 0, "texCoord": 0})", Places{{0, 1}, {0, 1}, {0, 1}}}}) {
    const std::string of_another_picture(24, '\0');
    nlohmann::json json = triangle_gltf(right_triangle + of_another_picture + binary<float>({0, 0, 1, 0, 0, 1}));
    json.update(nlohmann::json::parse(R"({"extensionsRequired": ["KHR_texture_transform"], "textures": [{"source": 0}],
        "images": [{"uri": "a.png"}], "materials": [{"pbrMetallicRoughness": {}}]})"));
    json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = nlohmann::json::parse(texture);
    json["accessors"].push_back(json["accessors"][1]);
    json["accessors"][2]["byteOffset"] = 24;
    nlohmann::json& primitive = json["meshes"][0]["primitives"][0];
    primitive["material"] = 0;
    primitive["attributes"]["TEXCOORD_1"] = 2;
    const Temporary file("a.gltf", json.dump());
    const Places places = read_mesh_with_normals(file, {}).places;
    ASSERT_EQ(places.size(), 3u) << texture;
    for (std::size_t i = 0; i < 3; ++i) EXPECT_LT((places[i] - expected[i]).norm(), 1e-6) << texture << i;
  }
}

// Blender writes s and t, others u and v, of vertices; MeshLab texcoord, of the corners of faces.
TEST(Ply, TextureCoordinatesOfVerticesAndOfCorners) {
  const auto read = [](const std::string& of_vertex, const std::string& of_face, const std::string& rows) {
    const Temporary file("a.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n" +
                                      of_vertex + "property float z\nelement face 2\nproperty list uchar int " +
                                      "vertex_indices\n" + of_face + "end_header\n" + rows);
    return read_mesh_with_normals(file, {});
  };
  for (const std::string names : {"uv", "st"})
    for (const char* prefix : {"", "texture_"}) {
      std::string properties;
      for (const char name : names) properties += std::string("property float ") + prefix + name + "\n";
      EXPECT_EQ(read(properties, "", "0 0 0 0 0\n1 0 1 .5 0\n1 1 1 1 0\n0 1 0 1 0\n3 0 1 2\n3 0 2 3\n").places,
                (Places{{0, 0}, {1, 0.5F}, {1, 1}, {0, 1}}))
          << prefix << names;
    }
  const MeshWithNormals seam = read("", "property list uchar float texcoord\n",
                                    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0 0 .5 .5 0 1\n");
  EXPECT_EQ(seam.places, (Places{{0, 0}, {1, 0}, {1, 1}, {0.5F, 0.5F}, {0, 1}}));  // Vertex 2 has two.
  EXPECT_EQ(seam.mesh.triangles.size(), 2u);
  EXPECT_TRUE(read("", "", "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n").places.empty());
}

TEST(Gltf, ExtensionsThatChangeTheShapeAreRefusedByName) {
  const auto error = [&](const std::string& extension) {
    nlohmann::json json = quantized_gltf({5122, 2, 32767}, false);
    json["extensionsRequired"] = nlohmann::json::array({extension});
    const Temporary file("a.gltf", json.dump());
    return message([&] { read_mesh(file); });
  };
  EXPECT_THAT(error("EXT_meshopt_compression"), HasSubstr("extension EXT_meshopt_compression, which is not read"));
  EXPECT_THAT(error("EXT_meshopt_compression"), HasSubstr("gltfpack without -c"));
  for (const char* each : {"EXT_mesh_gpu_instancing", "MY_shape"}) EXPECT_THAT(error(each), HasSubstr(each));
  for (const char* each : {"KHR_materials_unlit", "KHR_texture_transform", "EXT_texture_webp", "KHR_lights_punctual"})
    EXPECT_EQ(error(each), "nothing was thrown") << each;
}

/// A tetrahedron with corners at 1, 2 and 3 along the axes of its file.
std::string collada(const std::string& asset) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>)" +
         asset + R"(</asset><library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="pa" count="12">0 0 0 1 0 0 0 2 0 0 0 3</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node id="n">
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

std::string fbx(int up, int front, int front_sign, double unit) {
  const auto number = [](const std::string& name, int value) {
    return "P: \"" + name + "\", \"int\", \"Integer\", \"\"," + std::to_string(value) + "\n";
  };
  return "; FBX 7.4.0 project file\nFBXHeaderExtension:  {\nFBXHeaderVersion: 1003\nFBXVersion: 7400\n}\n"
         "GlobalSettings:  {\nVersion: 1000\nProperties70:  {\n" +
         number("UpAxis", up) + number("UpAxisSign", 1) + number("FrontAxis", front) +
         number("FrontAxisSign", front_sign) + number("CoordAxis", 0) + number("CoordAxisSign", 1) +
         "P: \"UnitScaleFactor\", \"double\", \"Number\", \"\"," + std::to_string(unit) +
         "\n}\n}\nObjects:  {\nGeometry: 1000, \"Geometry::g\", \"Mesh\" {\nVertices: *12 {\n"
         "a: 0,0,0,1,0,0,0,2,0,0,0,3\n}\nPolygonVertexIndex: *12 {\na: 0,2,-2,0,1,-4,0,3,-3,1,2,-4\n}\n"
         "GeometryVersion: 124\n}\nModel: 2000, \"Model::m\", \"Mesh\" {\nVersion: 232\n}\n}\n"
         "Connections:  {\nC: \"OO\",2000,0\nC: \"OO\",1000,2000\n}\n";
}

TEST(ReadMeshTest, FormatsWithUnitAndAxesAreInMetresWithZUp) {
  struct Case {
    std::string name, content;
    Vector3d x, y, z;  ///< Where the corners on the file's axes are.
  };
  const Vector3d X(1, 0, 0), Y(0, 1, 0), Z(0, 0, 1);
  const std::string positions = binary<float>({1, 0, 0, 0, 2, 0, 0, 0, 3});
  for (const Case& each :
       std::vector<Case>{{"a.dae", collada("<up_axis>Z_UP</up_axis>"), X, 2 * Y, 3 * Z},
                         {"b.dae", collada("<unit name=\"cm\" meter=\"0.01\"/><up_axis>Z_UP</up_axis>"), 0.01 * X,
                          0.02 * Y, 0.03 * Z},
                         {"c.dae", collada("<up_axis>Y_UP</up_axis>"), X, 2 * Z, -3 * Y},
                         {"d.dae", collada(""), X, 2 * Z, -3 * Y},
                         {"e.dae", collada("<up_axis>X_UP</up_axis>"), Z, -2 * X, -3 * Y},
                         {"a.gltf", triangle_gltf(positions + std::string(24, '\0')).dump(), X, 2 * Z, -3 * Y},
                         {"a.fbx", fbx(1, 2, 1, 1), 0.01 * X, 0.02 * Z, -0.03 * Y},
                         {"b.fbx", fbx(2, 1, -1, 1), 0.01 * X, 0.02 * Y, 0.03 * Z},
                         {"c.fbx", fbx(2, 1, -1, 100), X, 2 * Y, 3 * Z}}) {
    const Temporary file(each.name, each.content);
    const TriangleMesh mesh = read_mesh(file);
    for (const Vector3d& expected : {each.x, each.y, each.z}) {
      const auto is_there = [&](const Vector3d& vertex) { return (vertex - expected).norm() < 1e-6; };
      EXPECT_THAT(mesh.vertices, Contains(testing::Truly(is_there))) << each.name << " " << expected.transpose();
    }
    EXPECT_GE(volume(mesh), 0) << each.name;  // Not mirrored.
  }
}

}  // namespace
}  // namespace tensorray
