#include "renderer/surfaces/mesh_files.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace tensorray {
namespace {

/// A file that is written in large pieces; numbers are appended as bytes or as text.
class Output {
 public:
  explicit Output(const std::filesystem::path& path) : path_(path), file_(path, std::ios::binary) {}

  void text(const char* text) { piece_ += text; }
  void text(const std::string& text) { piece_ += text; }

  /// The fewest digits that keep the number.
  template <class Number>
  void digits(Number number) {
    char digits[32];
    piece_.append(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
  }
  void decimals(float number, int count) {
    char digits[32];  // Enough for what is near one.
    piece_.append(digits, std::to_chars(digits, digits + sizeof digits, number, std::chars_format::fixed, count).ptr);
  }

  void bytes(std::uint32_t bits) {
    for (int i = 0; i < 4; ++i) piece_ += static_cast<char>(bits >> (8 * i) & 0xff);
  }
  void bytes(float number) {
    std::uint32_t bits;
    std::memcpy(&bits, &number, sizeof bits);
    bytes(bits);
  }
  void byte(std::uint8_t byte) { piece_ += static_cast<char>(byte); }

  void end_of_row() {
    constexpr std::size_t piece_size = 1 << 20;
    if (piece_.size() >= piece_size) flush();
  }

  void close() {
    flush();
    file_.close();
    if (!file_)
      throw std::runtime_error(path_.string() + ": cannot be written; check the path and the space on the disk");
  }

 private:
  void flush() {
    file_.write(piece_.data(), static_cast<std::streamsize>(piece_.size()));
    piece_.clear();
  }

  std::filesystem::path path_;
  std::ofstream file_;
  std::string piece_;
};

std::string ply_header(const TriangleMesh& mesh, const VertexAttributes& attributes) {
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\n";
  if (attributes.normals) text += "property float nx\nproperty float ny\nproperty float nz\n";
  if (attributes.values) text += "property float " + attributes.value_name + "\n";
  if (attributes.colors) text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  return text + "element face " + std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar uint vertex_indices\nend_header\n";
}

void write_ply(Output& output, const TriangleMesh& mesh, const VertexAttributes& attributes) {
  output.text(ply_header(mesh, attributes));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (const double x : mesh.vertices[i]) output.bytes(static_cast<float>(x));
    if (attributes.normals)
      for (const float x : (*attributes.normals)[i]) output.bytes(x);
    if (attributes.values) output.bytes((*attributes.values)[i]);
    if (attributes.colors)
      for (const std::uint8_t channel : (*attributes.colors)[i]) output.byte(channel);
    output.end_of_row();
  }
  for (const auto& triangle : mesh.triangles) {
    output.byte(3);
    for (const std::uint32_t corner : triangle) output.bytes(corner);
    output.end_of_row();
  }
}

void write_obj_vertex(Output& output, const TriangleMesh& mesh, const VertexAttributes& attributes, std::size_t i) {
  output.text("v");
  for (const double x : mesh.vertices[i]) {
    output.text(" ");
    output.digits(static_cast<float>(x));
  }
  if (attributes.colors)
    for (const std::uint8_t channel : (*attributes.colors)[i]) {
      output.text(" ");
      output.decimals(static_cast<float>(channel) / 255, 3);
    }
  output.text("\n");
}

void write_obj_normal(Output& output, const Eigen::Vector3f& normal) {
  output.text("vn");
  for (const float x : normal) {
    output.text(" ");
    output.decimals(x, 4);
  }
  output.text("\n");
}

void write_obj_face(Output& output, const std::array<std::uint32_t, 3>& triangle, bool normals) {
  output.text("f");
  for (const std::uint32_t corner : triangle) {
    const std::uint64_t number = std::uint64_t{corner} + 1;
    output.text(" ");
    output.digits(number);
    if (!normals) continue;
    output.text("//");
    output.digits(number);
  }
  output.text("\n");
}

void write_obj(Output& output, const TriangleMesh& mesh, const VertexAttributes& attributes) {
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    write_obj_vertex(output, mesh, attributes, i);
    if (attributes.normals) write_obj_normal(output, (*attributes.normals)[i]);
    output.end_of_row();
  }
  for (const auto& triangle : mesh.triangles) {
    write_obj_face(output, triangle, attributes.normals != nullptr);
    output.end_of_row();
  }
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
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending != ".ply" && ending != ".obj")
    throw std::invalid_argument(path.string() + ": the ending of a file of triangles must be .ply or .obj");
  check(mesh, attributes);
  Output output(path);
  if (ending == ".ply")
    write_ply(output, mesh, attributes);
  else
    write_obj(output, mesh, attributes);
  output.close();
}

}  // namespace tensorray
