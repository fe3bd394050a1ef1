#include "renderer/meshes/mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

#include "base/errors.h"
#include "base/text/text.h"
#include "renderer/meshes/mesh_readers.h"

namespace tensorray {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
/// What tells vertices apart: a position; a normal and a place, or zero.
using VertexKey = std::array<double, 8>;

struct VertexHash {
  std::size_t operator()(const VertexKey& key) const {
    std::size_t hash = 0;
    for (const double coordinate : key) hash = hash * 0x9e3779b97f4a7c15u + std::hash<double>()(coordinate);
    return hash;
  }
};

VertexKey key_of(const MeshWithNormals& mesh, std::uint32_t vertex) {
  const Eigen::Vector3d& P = mesh.mesh.vertices[vertex];
  const Eigen::Vector3f N = mesh.normals.empty() ? Eigen::Vector3f::Zero() : mesh.normals[vertex];
  const Eigen::Vector2f place = mesh.places.empty() ? Eigen::Vector2f::Zero() : mesh.places[vertex];
  return {P.x(), P.y(), P.z(), N.x(), N.y(), N.z(), place.x(), place.y()};
}

/// Joins equal vertices, which files often repeat. Drops triangles of zero area and vertices that no triangle uses.
MeshWithNormals without_repeats(const MeshWithNormals& given) {
  MeshWithNormals result;
  std::unordered_map<VertexKey, std::uint32_t, VertexHash> indices;
  const auto vertex = [&](std::uint32_t index) {
    const auto [entry, is_new] =
        indices.try_emplace(key_of(given, index), static_cast<std::uint32_t>(result.mesh.vertices.size()));
    if (!is_new) return entry->second;
    result.mesh.vertices.push_back(given.mesh.vertices[index]);
    if (!given.normals.empty()) result.normals.push_back(given.normals[index]);
    if (!given.places.empty()) result.places.push_back(given.places[index]);
    return entry->second;
  };
  for (const Triangle& t : given.mesh.triangles) {
    const auto& P = given.mesh.vertices;
    if ((P[t[1]] - P[t[0]]).cross(P[t[2]] - P[t[0]]).isZero(0)) continue;
    const std::uint32_t first = vertex(t[0]), second = vertex(t[1]), third = vertex(t[2]);
    result.mesh.triangles.push_back({first, second, third});
  }
  return result;
}

MeshWithNormals read_axisless(const std::filesystem::path& path, const std::string& ending) {
  if (ending == ".ply") return read_ply(path);
  if (ending == ".obj") return read_obj(path);
  MeshWithNormals mesh = read_assimp_mesh(path);
  if (ending == ".stl") mesh.normals.clear();  // They are those of the triangles.
  return mesh;
}

MeshWithNormals read_any(const std::filesystem::path& path, const Eigen::Matrix3d& turn) {
  const std::string ending = lower_case_ending(path);
  const std::vector<std::string> with_axes{".gltf", ".glb", ".dae", ".fbx"}, others{".ply", ".obj", ".stl", ".off"};
  if (std::find(with_axes.begin(), with_axes.end(), ending) != with_axes.end()) return read_assimp_mesh(path);
  if (std::find(others.begin(), others.end(), ending) == others.end())
    throw std::runtime_error("a mesh is a .ply, .obj, .stl, .off, " + joined(with_axes) +
                             " file; convert other formats to one of these, for example with Blender");
  MeshWithNormals mesh = read_axisless(path, ending);
  for (Eigen::Vector3d& vertex : mesh.mesh.vertices) vertex = turn * vertex;
  for (Eigen::Vector3f& normal : mesh.normals) normal = turn.cast<float>() * normal;
  return mesh;
}

void check_finite(const MeshWithNormals& mesh) {
  for (std::size_t i = 0; i < mesh.mesh.vertices.size(); ++i)
    if (!mesh.mesh.vertices[i].cast<float>().allFinite())
      throw std::runtime_error("vertex " + std::to_string(i) + " is not finite in single precision");
  for (std::size_t i = 0; i < mesh.normals.size(); ++i)
    if (!mesh.normals[i].allFinite())
      throw std::runtime_error("the normal of vertex " + std::to_string(i) + " is not finite");
}

/// Calls make() with an error that names the file.
template <class Make>
auto naming(const std::filesystem::path& path, const Make& make) {
  require_readable(path);
  try {
    return make();
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read the mesh " + path.string() + ": " + error.what());
  }
}

MeshWithNormals read_finite(const std::filesystem::path& path, const Eigen::Matrix3d& turn) {
  MeshWithNormals raw = read_any(path, turn);
  check_finite(raw);
  return raw;
}

/// @param attributes  Whether vertices have normals and places.
MeshWithNormals joined_vertices(MeshWithNormals raw, bool attributes) {
  if (!attributes) raw.normals.clear();
  if (!attributes) raw.places.clear();
  MeshWithNormals mesh = without_repeats(raw);
  if (mesh.mesh.triangles.empty()) throw std::runtime_error("it holds no triangles");
  return mesh;
}

/// Smooth normals of a mesh with the places of its file, whose triangles are the same.
MeshWithNormals with_smooth_normals(const MeshWithNormals& file, double angle) {
  MeshWithNormals smooth = with_smooth_normals(joined_vertices(file, false).mesh, angle);
  if (file.places.empty()) return smooth;
  const MeshWithNormals placed = joined_vertices(file, true);
  MeshWithNormals corners;
  for (std::size_t t = 0; t < smooth.mesh.triangles.size(); ++t) {
    Triangle triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      triangle[k] = static_cast<std::uint32_t>(corners.mesh.vertices.size());
      corners.mesh.vertices.push_back(smooth.mesh.vertices[smooth.mesh.triangles[t][k]]);
      corners.normals.push_back(smooth.normals[smooth.mesh.triangles[t][k]]);
      corners.places.push_back(placed.places[placed.mesh.triangles[t][k]]);
    }
    corners.mesh.triangles.push_back(triangle);
  }
  return joined_vertices(corners, true);
}

void turn_round(TriangleMesh& mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

constexpr double angle_rounding = 1e-6;  // Of the cosine of an angle between triangles, so that 90° smooths a cube.

struct TriangleCorner {
  std::uint32_t triangle = 0;
  int number = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< The triangle's, unit.
  double angle = 0;
};

TriangleCorner triangle_corner(const TriangleMesh& mesh, std::uint32_t triangle, int number) {
  const auto& t = mesh.triangles[triangle];
  const Eigen::Vector3d& here = mesh.vertices[t[number]];
  const Eigen::Vector3d to_next = mesh.vertices[t[(number + 1) % 3]] - here,
                        to_last = mesh.vertices[t[(number + 2) % 3]] - here;
  const Eigen::Vector3d cross = to_next.cross(to_last);
  return {triangle, number, cross.stableNormalized(), std::atan2(cross.norm(), to_next.dot(to_last))};
}

std::vector<std::vector<TriangleCorner>> corners_by_vertex(const TriangleMesh& mesh) {
  std::vector<std::vector<TriangleCorner>> corners(mesh.vertices.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    for (int number = 0; number < 3; ++number)
      corners[mesh.triangles[i][number]].push_back(triangle_corner(mesh, i, number));
  return corners;
}

Eigen::Vector3f mean_normal(const TriangleCorner& corner, const std::vector<TriangleCorner>& around,
                            double min_cosine) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const TriangleCorner& other : around)
    if (corner.normal.dot(other.normal) >= min_cosine) sum += other.angle * other.normal;
  return sum.normalized().cast<float>();
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& path, const Eigen::Matrix3d& turn) {
  return naming(path, [&] { return joined_vertices(read_finite(path, turn), false).mesh; });
}

MeshWithNormals read_mesh_with_normals(const std::filesystem::path& path, std::optional<double> smooth_angle,
                                       const Eigen::Matrix3d& turn) {
  return naming(path, [&] {
    const MeshWithNormals raw = read_finite(path, turn);
    return smooth_angle ? with_smooth_normals(raw, *smooth_angle) : joined_vertices(raw, true);
  });
}

MeshWithNormals with_smooth_normals(const TriangleMesh& mesh, double angle) {
  const double min_cosine = std::cos(angle) - angle_rounding;
  MeshWithNormals result;
  result.mesh.triangles.resize(mesh.triangles.size());
  const auto corners = corners_by_vertex(mesh);
  for (std::size_t vertex = 0; vertex < mesh.vertices.size(); ++vertex) {
    std::map<std::array<float, 3>, std::uint32_t> made;  // The normals of this vertex.
    for (const TriangleCorner& corner : corners[vertex]) {
      const Eigen::Vector3f normal = mean_normal(corner, corners[vertex], min_cosine);
      const auto [entry, is_new] =
          made.try_emplace({normal.x(), normal.y(), normal.z()}, static_cast<std::uint32_t>(result.normals.size()));
      result.mesh.triangles[corner.triangle][corner.number] = entry->second;
      if (!is_new) continue;
      result.mesh.vertices.push_back(mesh.vertices[vertex]);
      result.normals.push_back(normal);
    }
  }
  return result;
}

TriangleMesh box_mesh(const Eigen::AlignedBox3d& box, const Eigen::Affine3d& transform) {
  TriangleMesh mesh;
  mesh.vertices = corners_of(box, transform);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  if (transform.linear().determinant() < 0) turn_round(mesh);
  return mesh;
}

void require_closed(TriangleMesh& mesh) {
  if (const std::size_t open = open_edges(mesh))
    throw std::invalid_argument("the mesh is not closed: it has " + std::to_string(open) +
                                " open edges, or triangles that look to different sides");
  const double volume = 6 * mesh.volume();
  if (!(std::abs(volume) > 1e-12 * std::pow(mesh.bounds().diagonal().norm(), 3)))
    throw std::invalid_argument("the mesh encloses no volume");
  if (volume < 0) turn_round(mesh);
}

}  // namespace tensorray
