// glTF with integers for positions, and its extensions.

#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "renderer/meshes/mesh.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

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
