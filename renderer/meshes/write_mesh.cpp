#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "base/errors.h"
#include "base/files/output_file.h"
#include "base/text/text.h"
#include "renderer/meshes/mesh.h"

namespace tensorray {
namespace {

/// Appends the fewest digits that reproduce the number exactly.
template <class Number>
void append_digits(Number number, std::string& text) {
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}

void append_decimals(float number, int count, std::string& text) {
  char digits[32];  // Enough for numbers near 1.
  text.append(digits, std::to_chars(digits, digits + sizeof digits, number, std::chars_format::fixed, count).ptr);
}

void append_vertex(const TriangleMesh& mesh, const VertexAttributes& attributes, std::size_t i, std::string& text) {
  text += "v";
  for (const double x : mesh.vertices[i]) {
    text += " ";
    append_digits(static_cast<float>(x), text);
  }
  if (attributes.colors)
    for (const std::uint8_t channel : (*attributes.colors)[i]) {
      text += " ";
      append_decimals(static_cast<float>(channel) / 255, 3, text);
    }
  text += "\n";
}

void append_normal(const Eigen::Vector3f& normal, std::string& text) {
  text += "vn";
  for (const float x : normal) {
    text += " ";
    append_decimals(x, 4, text);
  }
  text += "\n";
}

void append_face(const std::array<std::uint32_t, 3>& triangle, bool normals, std::string& text) {
  text += "f";
  for (const std::uint32_t corner : triangle) {
    const std::uint64_t number = std::uint64_t{corner} + 1;
    text += " ";
    append_digits(number, text);
    if (!normals) continue;
    text += "//";
    append_digits(number, text);
  }
  text += "\n";
}

void write_obj(const std::filesystem::path& path, const TriangleMesh& mesh, const VertexAttributes& attributes) {
  FileInPieces file(path);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    append_vertex(mesh, attributes, i, file.bytes());
    if (attributes.normals) append_normal((*attributes.normals)[i], file.bytes());
    file.end_of_row();
  }
  for (const auto& triangle : mesh.triangles) {
    append_face(triangle, attributes.normals != nullptr, file.bytes());
    file.end_of_row();
  }
  file.close();
}

template <class Value>
void check_size(const char* name, const std::vector<Value>* values, std::size_t vertices) {
  if (values && values->size() != vertices)
    throw std::invalid_argument("a mesh of " + std::to_string(vertices) + " vertices has " +
                                std::to_string(values->size()) + " " + name + "; one a vertex is needed");
}

void check(const TriangleMesh& mesh, const VertexAttributes& attributes) {
  check_size("normals", attributes.normals, mesh.vertices.size());
  check_size("colours", attributes.colors, mesh.vertices.size());
  check_size("values", attributes.values, mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!mesh.vertices[i].cast<float>().allFinite())
      throw std::invalid_argument("vertex " + std::to_string(i) + " of the mesh is not finite in single precision");
    if (attributes.normals && !((*attributes.normals)[i].squaredNorm() < 2))
      throw std::invalid_argument("the normal of vertex " + std::to_string(i) + " of the mesh is no unit vector");
  }
  const std::string& name = attributes.value_name;
  if (name.empty() || !std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isgraph(c) != 0; }))
    throw std::invalid_argument("\"" + name + "\" cannot name the values of a mesh; use one word");
}

}  // namespace

void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh, const VertexAttributes& attributes) {
  const std::string ending = lower_case_ending(path);
  require(ending == ".ply" || ending == ".obj",
          path.string() + ": the ending of a file of triangles must be .ply or .obj");
  check(mesh, attributes);
  if (ending == ".ply")
    write_ply(path, mesh, PlyPositions::single_precision, attributes);
  else
    write_obj(path, mesh, attributes);
}

}  // namespace tensorray
