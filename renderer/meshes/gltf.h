#pragma once
/// @file renderer/meshes/gltf.h
/// What of glTF 2.0 assimp does not read rightly, prepared for it.

#include <filesystem>
#include <map>
#include <string>

namespace tensorray {

constexpr const char* gltf_in_memory_name = "tensorray.gltf";

/// Files by their names, which stand beside a .gltf or .glb where positions and normals are integers there
/// (KHR_mesh_quantization): gltf_in_memory_name, which is to be read instead, has floats. Empty if there are none, or
/// the file is no glTF 2.0.
/// @throw std::runtime_error that names an extension which is required, and whose geometry would be lost; or if
/// integers are beyond their buffer.
std::map<std::string, std::string> gltf_in_memory(const std::filesystem::path& path);

}  // namespace tensorray
