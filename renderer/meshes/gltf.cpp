#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "base/text/byte_order.h"
#include "base/text/text.h"
#include "renderer/meshes/mesh_readers.h"

namespace tensorray {
namespace {

using Json = nlohmann::json;
using Files = std::map<std::string, std::string>;
namespace fs = std::filesystem;

const std::string binary_name = "tensorray-binary.bin", floats_name = "tensorray-floats.bin";

std::string contents_of(const fs::path& path) {
  std::error_code none;
  if (!fs::is_regular_file(path, none)) throw std::runtime_error("its file " + path.string() + " is missing");
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Also puts the buffer of a .glb, which has no name, among the files.
Json json_of(const fs::path& path, Files& files) {
  const std::string bytes = contents_of(path);
  if (!starts_with(bytes, "glTF")) return Json::parse(bytes, nullptr, false);
  const auto chunk = [&](std::size_t at) {
    return at + 8 > bytes.size() ? "" : bytes.substr(at + 8, read_number<std::uint32_t>(&bytes[at], ByteOrder::little));
  };
  const std::string json = chunk(12);
  files[binary_name] = chunk(20 + json.size());
  return Json::parse(json, nullptr, false);
}

std::string decoded_base64(const std::string& text) {
  static const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const std::size_t digit = digits.find(c);
    if (digit == std::string::npos) continue;
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count);
  }
  return bytes;
}

/// The bytes of a buffer, which are kept among the files.
const std::string& buffer_of(const fs::path& path, const Json& json, std::size_t index, Files& files) {
  const std::string uri = json.at("buffers").at(index).value("uri", binary_name);
  const auto [found, is_new] = files.try_emplace(uri);
  if (is_new)
    found->second = starts_with(uri, "data:") ? decoded_base64(uri.substr(uri.find(',') + 1))
                                              : contents_of(path.parent_path() / uri);
  return found->second;
}

/// The format's rule: a normalised integer is the number divided by its greatest, and not below −1.
template <class Integer>
float float_of(const char* bytes, bool is_normalized) {
  const auto number = static_cast<float>(read_number<Integer>(bytes, ByteOrder::little));
  return is_normalized ? std::max(-1.0F, number / static_cast<float>(std::numeric_limits<Integer>::max())) : number;
}

struct NumberOf {
  std::size_t bytes;
  float (*read)(const char* bytes, bool is_normalized);
};

constexpr int float_type = 5126;
const std::map<int, NumberOf> number_types{{5120, {1, float_of<std::int8_t>}},
                                           {5121, {1, float_of<std::uint8_t>}},
                                           {5122, {2, float_of<std::int16_t>}},
                                           {5123, {2, float_of<std::uint16_t>}},
                                           {float_type, {4, float_of<float>}}};

/// How texture coordinates move (KHR_texture_transform).
using Move = Eigen::Affine2f;

/// Makes an accessor of two or three integers, or of two numbers that move, one of as many floats.
void make_floats(const fs::path& path, Json& json, std::size_t index, const Move* move, Files& files) {
  Json& accessor = json.at("accessors").at(index);
  const int kind_of_number = accessor.at("componentType").get<int>();
  const auto type = number_types.find(kind_of_number);
  if (type == number_types.end() || !accessor.contains("bufferView") || (kind_of_number == float_type && !move)) return;
  const std::string name = "its accessor " + std::to_string(index);
  const std::string kind = accessor.value("type", "");
  if (accessor.contains("sparse") || (kind != "VEC2" && kind != "VEC3"))
    throw std::runtime_error(name + " has sparse numbers, or not two or three; write it again without quantization");
  const std::size_t parts = kind == "VEC2" ? 2 : 3;
  const Json view = json.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
  const std::string& bytes = buffer_of(path, json, view.at("buffer").get<std::size_t>(), files);
  const std::size_t count = accessor.at("count").get<std::size_t>(), size = parts * type->second.bytes;
  const std::size_t stride = view.value("byteStride", size);
  const std::size_t first = view.value("byteOffset", std::size_t{0}) + accessor.value("byteOffset", std::size_t{0});
  if (count == 0 || stride < size || first > bytes.size() || (bytes.size() - first + stride - size) / stride < count)
    throw std::runtime_error(name + " is beyond its buffer: the file is damaged or cut off");
  std::string& floats = files[floats_name];
  json["bufferViews"].push_back(
      {{"buffer", json.at("buffers").size()}, {"byteOffset", floats.size()}, {"byteLength", 4 * parts * count}});
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Vector3f numbers(0, 0, 0);
    for (std::size_t k = 0; k < parts; ++k)
      numbers[int(k)] =
          type->second.read(&bytes[first + i * stride + k * type->second.bytes], accessor.value("normalized", false));
    if (move) numbers.head<2>() = *move * Eigen::Vector2f(numbers.head<2>());
    for (std::size_t k = 0; k < parts; ++k) append_number(numbers[int(k)], ByteOrder::little, floats);
  }
  accessor["bufferView"] = json["bufferViews"].size() - 1;
  accessor["componentType"] = float_type;
  for (const char* gone : {"byteOffset", "normalized", "min", "max"}) accessor.erase(gone);
}

/// Extensions of materials, textures and lights have no geometry. assimp itself reads or refuses Draco's compression.
void check_extensions(const Json& json) {
  for (const Json& each : json.value("extensionsRequired", Json::array())) {
    const std::string extension = each.get<std::string>();
    const auto begins = [&](const char* kind) { return starts_with(extension, kind); };
    const std::array harmless{"KHR_materials_", "KHR_texture_",  "KHR_lights_",     "KHR_xmp",
                              "KHR_techniques", "KHR_animation", "EXT_texture_",    "EXT_lights_",
                              "MSFT_texture_",  "ADOBE_mat",     "KHR_mesh_quanti", "KHR_draco_mesh"};
    if (std::any_of(harmless.begin(), harmless.end(), begins)) continue;
    throw std::runtime_error("it requires the glTF extension " + escaped(extension) + ", which is not read; " +
                             (extension.find("meshopt") == std::string::npos
                                  ? "export it without this extension"
                                  : "write it again without compression: gltfpack without -c and -cc"));
  }
}

/// The texture of a primitive's base colour; empty: it has none.
Json picture_of(const Json& json, const Json& primitive) {
  if (!primitive.contains("material")) return Json::object();
  const Json& material = json.at("materials").at(primitive["material"].get<std::size_t>());
  return material.value("/pbrMetallicRoughness/baseColorTexture"_json_pointer, Json::object());
}

/// T R S. In the format's axes, v is down, and R turns as the extension's example says: its listing has the other turn.
Move move_of(const Json& given) {
  const auto offset = given.value("offset", std::array{0.0F, 0.0F}),
             scale = given.value("scale", std::array{1.0F, 1.0F});
  return Eigen::Translation2f(offset[0], offset[1]) * Eigen::Rotation2Df(-given.value("rotation", 0.0F)) *
         Eigen::Scaling(scale[0], scale[1]);
}

/// The accessors of positions, normals and texture coordinates; those of a picture of the base colour have copies that
/// move as it does. Removes all other attributes but those of skins, which have no geometry.
std::map<std::size_t, std::optional<Move>> geometry_of(Json& json) {
  std::map<std::size_t, std::optional<Move>> accessors;
  for (Json& mesh : json.at("meshes"))
    for (Json& primitive : mesh.at("primitives")) {
      primitive.erase("targets");
      const Json picture = picture_of(json, primitive);
      const Json move = picture.value("/extensions/KHR_texture_transform"_json_pointer, Json::object());
      const std::string places = "TEXCOORD_" + std::to_string(move.value("texCoord", picture.value("texCoord", 0)));
      Json kept = Json::object();
      for (const auto& [name, accessor] : primitive.at("attributes").items()) {
        auto index = accessor.get<std::size_t>();
        const bool is_picture = name == places;
        const bool is_geometry = name == "POSITION" || name == "NORMAL" || is_picture;
        if (is_picture && (!move.empty() || name != "TEXCOORD_0")) {
          const Json copy = json.at("accessors").at(index);
          index = json["accessors"].size();
          json["accessors"].push_back(copy);
          accessors[index] = move_of(move);
        } else if (is_geometry) {
          accessors.try_emplace(index);
        }
        if (is_geometry || starts_with(name, "JOINTS_") || starts_with(name, "WEIGHTS_"))
          kept[is_picture ? "TEXCOORD_0" : name] = index;
      }
      primitive["attributes"] = kept;
    }
  return accessors;
}

}  // namespace

std::map<std::string, std::string> gltf_in_memory(const fs::path& path) {
  Files files;
  Json json = json_of(path, files);
  if (!json.is_object()) return {};
  try {
    if (!starts_with(json.at("asset").at("version").get<std::string>(), "2")) return {};
    check_extensions(json);
    if (!json.contains("meshes")) return {};
    for (const auto& [accessor, move] : geometry_of(json))
      make_floats(path, json, accessor, move ? &*move : nullptr, files);
    if (files.count(floats_name) == 0) return {};
    for (Json& buffer : json.at("buffers"))
      if (!buffer.contains("uri")) buffer["uri"] = binary_name;
    json["buffers"].push_back({{"uri", floats_name}, {"byteLength", files[floats_name].size()}});
    files[gltf_in_memory_name] = json.dump();
    return files;
  } catch (const Json::exception&) {
    return {};  // assimp says what is wrong.
  }
}

}  // namespace tensorray
