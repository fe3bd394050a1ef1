#include <cstring>
#include <sstream>

#include "base/constants.h"
#include "renderer/meshes/mesh.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

/// A closed mesh whose vertices are all different, and its attributes.
struct Sample {
  TriangleMesh mesh;
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::array<std::uint8_t, 3>> colors;
  std::vector<float> values;

  VertexAttributes attributes() const { return {&normals, &colors, &values, "force"}; }
};

/// A torus of rows times columns vertices. Single precision represents the positions exactly.
Sample torus(std::uint32_t rows, std::uint32_t columns) {
  Sample sample;
  for (std::uint32_t i = 0; i < rows * columns; ++i) {
    const double u = 2 * pi * (i / columns) / rows, v = 2 * pi * (i % columns) / columns;
    const Eigen::Vector3d normal(std::cos(v) * std::cos(u), std::cos(v) * std::sin(u), std::sin(v));
    Eigen::Vector3d position = Eigen::Vector3d(1000 + 3 * std::cos(u), 3 * std::sin(u), 0) + normal;
    for (double& coordinate : position) {
      // Without volatile GCC 12 omits the rounding in vectorised code.
      const volatile float rounded = static_cast<float>(coordinate);
      coordinate = static_cast<double>(rounded);
    }
    sample.mesh.vertices.push_back(position);
    sample.normals.push_back(normal.cast<float>());
    sample.colors.push_back({static_cast<std::uint8_t>(i % 256), static_cast<std::uint8_t>(255 - i % 256), 10});
    sample.values.push_back(0.1f * static_cast<float>(i));
  }
  const auto at = [&](std::uint32_t row, std::uint32_t column) { return row % rows * columns + column % columns; };
  for (std::uint32_t i = 0; i < rows; ++i)
    for (std::uint32_t j = 0; j < columns; ++j) {
      sample.mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      sample.mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return sample;
}

/// Compares with what read_mesh reads: equal for .ply; for .obj up to the last bits, which assimp rounds incorrectly.
void expect_same_surface(const std::filesystem::path& path, const TriangleMesh& mesh) {
  const double tolerance = path.extension() == ".obj" ? 4e-7 : 0;
  const TriangleMesh read = read_mesh(path);
  ASSERT_EQ(read.triangles.size(), mesh.triangles.size());
  EXPECT_EQ(read.vertices.size(), mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Eigen::Vector3d& expected = mesh.vertices[mesh.triangles[i][corner]];
      const Eigen::Vector3d error = read.vertices[read.triangles[i][corner]] - expected;
      ASSERT_LE(error.norm(), tolerance * expected.norm()) << path << " " << i;
    }
}

TEST(MeshFilesTest, ReadBack) {
  for (const std::string name : {"a.ply", "a.obj", "a.PLY"}) {
    const Sample sample = torus(300, 200);  // Larger than the pieces that are written.
    const Temporary file(name);
    write_mesh(file.path(), sample.mesh, sample.attributes());
    EXPECT_GT(std::filesystem::file_size(file.path()), 3u << 20);
    expect_same_surface(file.path(), sample.mesh);
    write_mesh(file.path(), sample.mesh, {});
    expect_same_surface(file.path(), sample.mesh);
  }
}

TEST(MeshFilesTest, PlyHoldsAttributes) {
  const Sample sample = torus(5, 4);
  const Temporary file("a.ply");
  write_mesh(file.path(), sample.mesh, sample.attributes());
  const std::string bytes = read_bytes(file.path());
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 20\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\nproperty float force\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nelement face 40\nproperty list uchar uint vertex_indices\n"
      "end_header\n";
  ASSERT_THAT(bytes, StartsWith(header));
  ASSERT_EQ(bytes.size(), header.size() + 20 * (7 * 4 + 3) + 40 * (1 + 3 * 4));
  for (std::size_t i = 0; i < 20; ++i) {
    const char* row = bytes.data() + header.size() + 31 * i;
    float numbers[7];
    std::memcpy(numbers, row, sizeof numbers);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(numbers[axis], sample.mesh.vertices[i][axis]);
      EXPECT_EQ(numbers[3 + axis], sample.normals[i][axis]);
      EXPECT_EQ(static_cast<std::uint8_t>(row[28 + axis]), sample.colors[i][static_cast<std::size_t>(axis)]);
    }
    EXPECT_EQ(numbers[6], sample.values[i]);
  }
}

TEST(MeshFilesTest, ObjHoldsColorsAndNormals) {
  const Sample sample = torus(16, 16);  // 256 colours: all values of a channel.
  const Temporary file("a.obj");
  write_mesh(file.path(), sample.mesh, sample.attributes());
  std::istringstream text(read_bytes(file.path()));
  std::size_t vertices = 0, normals = 0, faces = 0;
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string keyword;
    float x, y, z, r, g, b;
    words >> keyword;
    if (keyword == "v") {
      ASSERT_TRUE(words >> x >> y >> z >> r >> g >> b);
      EXPECT_EQ(Eigen::Vector3d(x, y, z), sample.mesh.vertices[vertices]);
      EXPECT_EQ(std::lround(255 * r), sample.colors[vertices][0]);
      EXPECT_EQ(std::lround(255 * g), sample.colors[vertices][1]);
      EXPECT_EQ(std::lround(255 * b), sample.colors[vertices][2]);
      ++vertices;
    } else if (keyword == "vn") {
      ASSERT_TRUE(words >> x >> y >> z);
      EXPECT_LE((Eigen::Vector3f(x, y, z) - sample.normals[normals]).norm(), 1e-4);
      ++normals;
    } else {
      EXPECT_EQ(keyword, "f");
      std::string corner;
      for (const std::uint32_t index : sample.mesh.triangles[faces]) {
        words >> corner;
        EXPECT_EQ(corner, std::to_string(index + 1) + "//" + std::to_string(index + 1));
      }
      ++faces;
    }
  }
  EXPECT_EQ(vertices, 256u);
  EXPECT_EQ(normals, 256u);
  EXPECT_EQ(faces, 512u);
}

TEST(MeshFilesTest, ErrorsNameTheMend) {
  Sample sample = torus(4, 4);
  const auto error = [&](const std::filesystem::path& path) {
    return message([&] { write_mesh(path, sample.mesh, sample.attributes()); });
  };
  EXPECT_THAT(error("a.stl"), HasSubstr(".ply or .obj"));
  EXPECT_THAT(error("/no/such/folder/a.ply"), HasSubstr("/no/such/folder/a.ply: cannot be written"));
  if (std::filesystem::exists("/dev/full")) {
    const Temporary link("full.obj");  // Removing the link does not remove the device.
    std::filesystem::create_symlink("/dev/full", link.path());
    EXPECT_THAT(error(link.path()), HasSubstr("cannot be written"));
  }
  const Temporary file("a.ply");
  sample.values.pop_back();
  EXPECT_THAT(error(file.path()), HasSubstr("15 values"));
  sample = torus(4, 4);
  sample.mesh.vertices[7].x() = 1e39;
  EXPECT_THAT(error(file.path()), HasSubstr("vertex 7"));
  sample = torus(4, 4);
  EXPECT_THAT(message([&] {
                write_mesh(file.path(), sample.mesh, {nullptr, nullptr, &sample.values, "a b"});
              }),
              HasSubstr("one word"));
  EXPECT_FALSE(std::filesystem::exists(file.path()));
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

std::string number(std::size_t value) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> 8 * i);
  return bytes;
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

std::string gltf_json(const Quantized& kind, bool is_normalized, const std::string& uri, std::size_t bytes,
                      const std::string& extensions = R"("KHR_mesh_quantization", "KHR_materials_unlit")") {
  const std::string scale = std::to_string(is_normalized ? kind.greatest : 1.0),
                    stride = std::to_string(4 * kind.bytes);
  return R"({"asset": {"version": "2.0"}, "extensionsRequired": [)" + extensions +
         R"(], "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "translation": [10, 0, 0], "scale": [)" +
         scale + "," + scale + "," + scale +
         R"(]}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}], "buffers": [{)" + uri +
         R"("byteLength": )" + std::to_string(bytes) + R"(}], "bufferViews": [{"buffer": 0, "byteOffset": 4,
         "byteLength": )" +
         std::to_string(bytes - 4) + R"(, "byteStride": )" + stride +
         R"(}], "accessors": [{"bufferView": 0, "byteOffset": 4, "count": 3, "type": "VEC3", "componentType": )" +
         std::to_string(kind.type) + R"(, "normalized": )" + (is_normalized ? "true" : "false") +
         R"(, "min": [0, 0, -3], "max": [1, 2, 3]}, {"bufferView": 0, "count": 3, "type": "VEC2", "componentType": 5120,
         "normalized": true}]})";
}

TEST(Gltf, QuantizedPositionsAreDecodedInAllForms) {
  for (const Quantized& kind : {Quantized{5120, 1, 127}, {5121, 1, 255}, {5122, 2, 32767}, {5123, 2, 65535}})
    for (const bool is_normalized : {false, true}) {
      const std::string numbers = triangle_numbers(kind);
      const Temporary beside("numbers.bin", numbers);
      const std::string name = beside.path().filename().string();
      const auto json = [&](const std::string& uri) { return gltf_json(kind, is_normalized, uri, numbers.size()); };
      std::string glb = json("");
      glb.resize((glb.size() + 3) / 4 * 4, ' ');
      glb = number(glb.size()) + "JSON" + glb + number(numbers.size()) + std::string("BIN\0", 4) + numbers;
      for (const auto& [file, content] :
           {std::pair<std::string, std::string>("a.gltf", json("\"uri\": \"" + name + "\", ")),
            {"b.gltf", json("\"uri\": \"data:application/octet-stream;base64," + base64(numbers) + "\", ")},
            {"a.glb", "glTF" + number(2) + number(12 + glb.size()) + glb}}) {
        const Temporary given(file, content);
        const TriangleMesh mesh = read_mesh(given.path());
        ASSERT_EQ(mesh.vertices.size(), 3u) << file;
        const double last = kind.type % 2 == 0 ? -3 : 3;
        const std::vector<Vector3d> expected{{11, 0, 0}, {10, 0, 2}, {10, -last, 0}};  // +y is up in the file.
        for (std::size_t i = 0; i < 3; ++i)
          EXPECT_LT((mesh.vertices[i] - expected[i]).norm(), 1e-5) << file << kind.type << is_normalized << " " << i;
      }
    }
}

TEST(Gltf, TextureCoordinatesMayBeIntegers) {
  std::string positions(36, '\0');
  for (const std::size_t corner : {1, 2}) positions.replace(16 * corner, 4, std::string("\0\0\x80\x3f", 4));
  for (const auto& [type, places] :  // (0, 1), (1, 0), (0, 0) from the upper left corner.
       {std::pair("5121", std::string("\0\xff\0\0\xff\0\0\0\0\0\0\0", 12)),
        {"5123", std::string("\0\0\xff\xff\xff\xff\0\0\0\0\0\0", 12)}}) {
    const Temporary file("a.gltf", R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [
      {"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}], "buffers": [{"uri":
      "data:;base64,)" + base64(positions + places) +
                                       R"(", "byteLength": 48}], "bufferViews": [
      {"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 12, "byteStride": 4}], "accessors":
      [{"bufferView": 0, "count": 3, "type": "VEC3", "componentType": 5126, "min": [0, 0, 0], "max": [0, 1, 1]},
      {"bufferView": 1, "count": 3, "type": "VEC2", "normalized": true, "componentType": )" +
                                       type + "}]}");
    EXPECT_EQ(read_mesh_with_normals(file.path(), {}).places, (std::vector<Eigen::Vector2f>{{0, 0}, {1, 1}, {0, 1}}))
        << type;
  }
}

// The extension's own example: the lower left quarter of the picture, turned by a quarter. Corners in the format's
// axes, v down: (0, 0), (1, 0), (0, 1) become (0, 1), (0, 0.5), (0.5, 1).
TEST(Gltf, PicturesOfTheBaseColourMove) {
  std::string numbers(36, '\0');
  for (const std::size_t corner : {1, 2}) numbers.replace(16 * corner, 4, std::string("\0\0\x80\x3f", 4));
  numbers += std::string(24, '\0');  // Places of another picture.
  for (const float place : {0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 1.0F})
    numbers.append(reinterpret_cast<const char*>(&place), sizeof place);
  const std::string transform = R"("extensions": {"KHR_texture_transform": {"offset": [0, 1], "scale": [0.5, 0.5],
      "rotation": 1.57079632679, "texCoord": 1}})";
  using Places = std::vector<Eigen::Vector2f>;
  for (const auto& [texture, expected] : {std::pair(transform, Places{{0, 0}, {0, 0.5F}, {0.5F, 0}}),
                                          {R"("texCoord": 1)", Places{{0, 1}, {1, 1}, {0, 0}}},
                                          {R"("texCoord": 0)", Places{{0, 1}, {0, 1}, {0, 1}}}}) {
    const Temporary file("a.gltf", R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [
      {"mesh": 0}], "extensionsRequired": ["KHR_texture_transform"], "images": [{"uri": "a.png"}], "textures": [
      {"source": 0}], "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, )" +
                                       texture + R"(}}}], "meshes": [{"primitives": [{"material": 0,
      "attributes": {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 2}}]}], "buffers": [{"uri": "data:;base64,)" +
                                       base64(numbers) + R"(", "byteLength": 84}], "bufferViews": [
      {"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 48}], "accessors":
      [{"bufferView": 0, "count": 3, "type": "VEC3", "componentType": 5126, "min": [0, 0, 0], "max": [0, 1, 1]},
      {"bufferView": 1, "count": 3, "type": "VEC2", "componentType": 5126},
      {"bufferView": 1, "byteOffset": 24, "count": 3, "type": "VEC2", "componentType": 5126}]})");
    const Places places = read_mesh_with_normals(file.path(), {}).places;
    ASSERT_EQ(places.size(), 3u) << texture;
    for (std::size_t i = 0; i < 3; ++i) EXPECT_LT((places[i] - expected[i]).norm(), 1e-6) << texture << i;
  }
}

// Blender writes s and t, others u and v, of vertices; MeshLab texcoord, of the corners of faces.
TEST(Ply, TextureCoordinatesOfVerticesAndOfCorners) {
  using Places = std::vector<Eigen::Vector2f>;
  const auto read = [](const std::string& of_vertex, const std::string& of_face, const std::string& rows) {
    const Temporary file("a.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n" +
                                      of_vertex + "property float z\nelement face 2\nproperty list uchar int " +
                                      "vertex_indices\n" + of_face + "end_header\n" + rows);
    return read_mesh_with_normals(file.path(), {});
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
  const Quantized kind{5122, 2, 32767};
  const std::string uri = "\"uri\": \"data:;base64," + base64(triangle_numbers(kind)) + "\", ";
  const auto error = [&](const std::string& extension, std::size_t bytes = 32) {
    const Temporary file("a.gltf", gltf_json(kind, false, uri, bytes, "\"" + extension + "\""));
    return message([&] { read_mesh(file.path()); });
  };
  EXPECT_THAT(error("EXT_meshopt_compression"), HasSubstr("extension EXT_meshopt_compression, which is not read"));
  EXPECT_THAT(error("EXT_meshopt_compression"), HasSubstr("gltfpack without -c"));
  for (const char* each : {"EXT_mesh_gpu_instancing", "MY_shape"}) EXPECT_THAT(error(each), HasSubstr(each));
  for (const char* each : {"KHR_materials_unlit", "KHR_texture_transform", "EXT_texture_webp", "KHR_lights_punctual"})
    EXPECT_EQ(error(each), "nothing was thrown") << each;
}

}  // namespace
}  // namespace tensorray
