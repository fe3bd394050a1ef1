#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>

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

struct IntegerType {
  std::size_t bytes;
  float (*read)(const char* bytes, bool is_normalized);
};

const std::map<int, IntegerType> integer_types{{5120, {1, float_of<std::int8_t>}},
                                               {5121, {1, float_of<std::uint8_t>}},
                                               {5122, {2, float_of<std::int16_t>}},
                                               {5123, {2, float_of<std::uint16_t>}}};

/// Makes an accessor of two or three integers one of as many floats.
void make_floats(const fs::path& path, Json& json, std::size_t index, Files& files) {
  Json& accessor = json.at("accessors").at(index);
  const auto type = integer_types.find(accessor.at("componentType").get<int>());
  if (type == integer_types.end() || !accessor.contains("bufferView")) return;
  const std::string name = "its accessor " + std::to_string(index);
  const std::string kind = accessor.value("type", "");
  if (accessor.contains("sparse") || (kind != "VEC2" && kind != "VEC3"))
    throw std::runtime_error(name + " has sparse integers, or not two or three; write it again without quantization");
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
  for (std::size_t i = 0; i < parts * count; ++i) {
    const char* const at = &bytes[first + i / parts * stride + i % parts * type->second.bytes];
    append_number(type->second.read(at, accessor.value("normalized", false)), ByteOrder::little, floats);
  }
  accessor["bufferView"] = json["bufferViews"].size() - 1;
  accessor["componentType"] = 5126;
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

/// The accessors of positions, normals and texture coordinates. Removes all other attributes but those of skins, which
/// have no geometry.
std::set<std::size_t> geometry_of(Json& json) {
  std::set<std::size_t> accessors;
  for (Json& mesh : json.at("meshes"))
    for (Json& primitive : mesh.at("primitives")) {
      primitive.erase("targets");
      Json kept = Json::object();
      for (const auto& [name, accessor] : primitive.at("attributes").items()) {
        const bool is_geometry = name == "POSITION" || name == "NORMAL" || name == "TEXCOORD_0";
        if (is_geometry) accessors.insert(accessor.get<std::size_t>());
        if (is_geometry || starts_with(name, "JOINTS_") || starts_with(name, "WEIGHTS_")) kept[name] = accessor;
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
    for (const std::size_t accessor : geometry_of(json)) make_floats(path, json, accessor, files);
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
