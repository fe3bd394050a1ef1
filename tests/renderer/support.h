#pragma once
/// Bytes of files and the headers of .ply files, for the tests of the renderer and of pictures.

#include "tests/files.h"

namespace tensorray {

inline std::string read_bytes(const std::filesystem::path& path) { return bytes_of(path); }

/// The header of a .ply file of vertices and polygons.
inline std::string ply_header(const std::string& format, int vertices, int faces) {
  return "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(vertices) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(faces) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

}  // namespace tensorray
