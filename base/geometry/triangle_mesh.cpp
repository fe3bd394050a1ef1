#include "base/geometry/triangle_mesh.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "base/files/output_file.h"
#include "base/text/byte_order.h"

namespace tensorray {
namespace {

std::string header(const TriangleMesh& mesh, const std::string& position_type, const VertexAttributes& attributes) {
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.vertices.size());
  for (const char* const axis : {"x", "y", "z"}) text += "\nproperty " + position_type + " " + axis;
  if (attributes.normals) text += "\nproperty float nx\nproperty float ny\nproperty float nz";
  if (attributes.values) text += "\nproperty float " + attributes.value_name;
  if (attributes.colors) text += "\nproperty uchar red\nproperty uchar green\nproperty uchar blue";
  return text + "\nelement face " + std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar uint vertex_indices\nend_header\n";
}

}  // namespace

std::size_t open_edges(const TriangleMesh& mesh) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<Edge> forwards, backwards;  // From the lower to the higher vertex index, and the reverse.
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = t[i], to = t[(i + 1) % 3];
      (from < to ? forwards : backwards).push_back(std::minmax(from, to));
    }
  std::sort(forwards.begin(), forwards.end());
  std::sort(backwards.begin(), backwards.end());
  std::vector<Edge> open;
  std::set_symmetric_difference(forwards.begin(), forwards.end(), backwards.begin(), backwards.end(),
                                std::back_inserter(open));
  return open.size();
}

void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh, PlyPositions precision,
               const VertexAttributes& attributes) {
  const bool is_double = precision == PlyPositions::double_precision;
  FileInPieces file(path);
  std::string& bytes = file.bytes();
  const auto append = [&bytes](auto number) { append_number(number, ByteOrder::little, bytes); };
  bytes += header(mesh, is_double ? "double" : "float", attributes);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (const double x : mesh.vertices[i]) is_double ? append(x) : append(static_cast<float>(x));
    if (attributes.normals)
      for (const float x : (*attributes.normals)[i]) append(x);
    if (attributes.values) append((*attributes.values)[i]);
    if (attributes.colors)
      for (const std::uint8_t channel : (*attributes.colors)[i]) append(channel);
    file.end_of_row();
  }
  for (const auto& triangle : mesh.triangles) {
    append(std::uint8_t{3});
    for (const std::uint32_t corner : triangle) append(corner);
    file.end_of_row();
  }
  file.close();
}

}  // namespace tensorray
