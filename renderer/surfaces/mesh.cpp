#include "renderer/surfaces/mesh.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include "base/errors.h"
#include "base/text.h"
#include "renderer/surfaces/ply.h"

namespace tensorray {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Position = std::array<double, 3>;

struct PositionHash {
  std::size_t operator()(const Position& position) const {
    std::size_t hash = 0;
    for (const double coordinate : position) hash = hash * 0x9e3779b97f4a7c15u + std::hash<double>()(coordinate);
    return hash;
  }
};

/// Joins vertices at equal positions, which files often repeat (for normals, or for each mesh). Drops triangles of zero
/// area and vertices that no triangle uses.
TriangleMesh joined(const TriangleMesh& mesh) {
  TriangleMesh result;
  std::unordered_map<Position, std::uint32_t, PositionHash> indices;
  const auto vertex = [&](const Eigen::Vector3d& position) {
    const auto [entry, is_new] = indices.try_emplace({position.x(), position.y(), position.z()},
                                                     static_cast<std::uint32_t>(result.vertices.size()));
    if (is_new) result.vertices.push_back(position);
    return entry->second;
  };
  for (const Triangle& t : mesh.triangles) {
    const Eigen::Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    if ((b - a).cross(c - a).isZero(0)) continue;
    const std::uint32_t first = vertex(a), second = vertex(b), third = vertex(c);
    result.triangles.push_back({first, second, third});
  }
  return result;
}

/// Checks what assimp's own processing assumes.
/// @return whether a face has more than three corners.
bool check_faces(const aiScene& scene) {
  bool polygons = false;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices == 0) throw std::runtime_error("a face has no vertices");
      if (*std::max_element(face.mIndices, face.mIndices + face.mNumIndices) >= mesh.mNumVertices)
        throw std::runtime_error("a face names a vertex that is not there");
      polygons = polygons || face.mNumIndices > 3;
    }
  }
  return polygons;
}

void add_mesh(const aiMesh& part, const aiMatrix4x4& to_world, TriangleMesh& mesh) {
  const auto offset = static_cast<std::uint32_t>(mesh.vertices.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D v = to_world * part.mVertices[i];
    mesh.vertices.emplace_back(v.x, v.y, v.z);
  }
  const bool mirrored = to_world.Determinant() < 0;
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices != 3) continue;  // Points and lines have no surface.
    Triangle t{offset + face.mIndices[0], offset + face.mIndices[1], offset + face.mIndices[2]};
    if (mirrored) std::swap(t[1], t[2]);
    mesh.triangles.push_back(t);
  }
}

void add_node(const aiScene& scene, const aiNode& node, const aiMatrix4x4& to_world, TriangleMesh& mesh) {
  const aiMatrix4x4 here = to_world * node.mTransformation;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) add_mesh(*scene.mMeshes[node.mMeshes[i]], here, mesh);
  for (unsigned i = 0; i < node.mNumChildren; ++i) add_node(scene, *node.mChildren[i], here, mesh);
}

/// Uses as few of assimp's processing steps as possible, since they abort the program on unexpected input.
TriangleMesh import(const std::filesystem::path& path) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path.string(), 0);
  if (scene && check_faces(*scene)) scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (!scene) throw std::runtime_error(one_line(importer.GetErrorString()));
  TriangleMesh mesh;
  if (scene->mRootNode) add_node(*scene, *scene->mRootNode, aiMatrix4x4(), mesh);
  return mesh;
}

/// Number of edges where more triangles run one way than the other; each edge counts once for each missing triangle.
std::size_t open_edges(const TriangleMesh& mesh) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<Edge> forwards, backwards;  // From the lower to the higher vertex index, and the reverse.
  for (const Triangle& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
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

/// Six times the enclosed volume; positive if the triangles face outwards.
double signed_volume(const TriangleMesh& mesh) {
  const Eigen::Vector3d center = mesh.bounds().center();  // Coordinates relative to the centre avoid cancellation.
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]] - center, b = mesh.vertices[t[1]] - center;
    sum += a.dot(b.cross(mesh.vertices[t[2]] - center));
  }
  return sum;
}

void turn_round(TriangleMesh& mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& path) {
  require_readable(path);
  try {
    const TriangleMesh raw = lower_case_ending(path) == ".ply" ? read_ply(path) : import(path);
    for (std::size_t i = 0; i < raw.vertices.size(); ++i)
      if (!raw.vertices[i].cast<float>().allFinite())
        throw std::runtime_error("vertex " + std::to_string(i) + " is not finite in single precision");
    TriangleMesh mesh = joined(raw);
    if (mesh.triangles.empty()) throw std::runtime_error("it holds no triangles");
    return mesh;
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read the mesh " + path.string() + ": " + error.what());
  }
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
  const double volume = signed_volume(mesh);
  if (!(std::abs(volume) > 1e-12 * std::pow(mesh.bounds().diagonal().norm(), 3)))
    throw std::invalid_argument("the mesh encloses no volume");
  if (volume < 0) turn_round(mesh);
}

}  // namespace tensorray
