#include "renderer/meshes/mesh.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

#include <assimp/Importer.hpp>
#include <assimp/scene.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "renderer/coverage/polygon.h"
#include "renderer/meshes/obj.h"
#include "renderer/meshes/ply.h"
#include "renderer/meshes/smooth_normals.h"

namespace tensorray {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
/// What tells vertices apart: a position, and a normal, or zero.
using VertexKey = std::array<double, 6>;

struct VertexHash {
  std::size_t operator()(const VertexKey& key) const {
    std::size_t hash = 0;
    for (const double coordinate : key) hash = hash * 0x9e3779b97f4a7c15u + std::hash<double>()(coordinate);
    return hash;
  }
};

VertexKey key_of(const MeshWithNormals& mesh, std::uint32_t vertex) {
  const Eigen::Vector3d& P = mesh.mesh.vertices[vertex];
  if (mesh.normals.empty()) return {P.x(), P.y(), P.z(), 0, 0, 0};
  const Eigen::Vector3f& N = mesh.normals[vertex];
  return {P.x(), P.y(), P.z(), N.x(), N.y(), N.z()};
}

/// Joins equal vertices, which files often repeat (for normals, or for each mesh). Drops triangles of zero area and
/// vertices that no triangle uses.
MeshWithNormals without_repeats(const MeshWithNormals& given) {
  MeshWithNormals result;
  std::unordered_map<VertexKey, std::uint32_t, VertexHash> indices;
  const auto vertex = [&](std::uint32_t index) {
    const auto [entry, is_new] =
        indices.try_emplace(key_of(given, index), static_cast<std::uint32_t>(result.mesh.vertices.size()));
    if (!is_new) return entry->second;
    result.mesh.vertices.push_back(given.mesh.vertices[index]);
    if (!given.normals.empty()) result.normals.push_back(given.normals[index]);
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

void check_face(const aiMesh& part, const aiFace& face) {
  if (face.mNumIndices == 0) throw std::runtime_error("a face has no vertices");
  if (*std::max_element(face.mIndices, face.mIndices + face.mNumIndices) >= part.mNumVertices)
    throw std::runtime_error("a face names a vertex that is not there");
}

void add_face(const TriangleMesh& mesh, const aiFace& face, std::uint32_t offset, bool mirrored,
              std::vector<Triangle>& triangles) {
  std::vector<Eigen::Vector3d> corners;
  for (unsigned i = 0; i < face.mNumIndices; ++i) corners.push_back(mesh.vertices[offset + face.mIndices[i]]);
  for (Triangle t : triangulate(corners)) {
    if (mirrored) std::swap(t[1], t[2]);
    triangles.push_back({offset + face.mIndices[t[0]], offset + face.mIndices[t[1]], offset + face.mIndices[t[2]]});
  }
}

Eigen::Affine3d affine_of(const aiMatrix4x4& matrix) {
  Eigen::Affine3d result;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) result.matrix()(row, column) = double(matrix[row][column]);
  return result;
}

void add_mesh(const aiMesh& part, const Eigen::Affine3d& to_world, MeshWithNormals& result) {
  TriangleMesh& mesh = result.mesh;
  const auto offset = static_cast<std::uint32_t>(mesh.vertices.size());
  const Eigen::Matrix3d& linear = to_world.linear();
  const bool mirrored = linear.determinant() < 0;
  // Normals follow the cofactors, which exist where the inverse does not: parts are hidden by a scale of 0.
  Eigen::Matrix3d turn;
  turn << linear.col(1).cross(linear.col(2)), linear.col(2).cross(linear.col(0)), linear.col(0).cross(linear.col(1));
  if (mirrored) turn = -turn;
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& v = part.mVertices[i];
    mesh.vertices.push_back(to_world * Eigen::Vector3d(v.x, v.y, v.z));
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    if (part.HasNormals()) normal = Eigen::Vector3d(part.mNormals[i].x, part.mNormals[i].y, part.mNormals[i].z);
    result.normals.push_back((turn * normal).stableNormalized().cast<float>());
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    check_face(part, part.mFaces[i]);
    if (part.mFaces[i].mNumIndices < 3) continue;  // Points and lines have no surface.
    add_face(mesh, part.mFaces[i], offset, mirrored, mesh.triangles);
  }
}

void add_node(const aiScene& scene, const aiNode& node, const Eigen::Affine3d& to_world, MeshWithNormals& mesh) {
  const Eigen::Affine3d here = to_world * affine_of(node.mTransformation);
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    if (node.mMeshes[i] >= scene.mNumMeshes) throw std::runtime_error("a node names a mesh that is not there");
    add_mesh(*scene.mMeshes[node.mMeshes[i]], here, mesh);
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i) add_node(scene, *node.mChildren[i], here, mesh);
}

int metadata(const aiScene& scene, const char* key, int otherwise) {
  std::int32_t value = otherwise;
  if (scene.mMetaData) scene.mMetaData->Get(key, value);
  return value;
}

/// FBX says which of its axes are right, up and front, and its unit in centimetres. assimp 5.2 passes on both.
Eigen::Affine3d fbx_to_world(const aiScene& scene) {
  const auto axis = [&](const char* key, int otherwise) {
    const int number = metadata(scene, key, otherwise);
    if (number < 0 || number > 2) throw std::runtime_error("its axes are not right, up and front");
    return Eigen::Vector3d(metadata(scene, (std::string(key) + "Sign").c_str(), 1) * Eigen::Vector3d::Unit(number));
  };
  Eigen::Matrix3d turn;                            // Rows: where x, y and z come from.
  turn.row(0) = axis("CoordAxis", 0).transpose();  // Not by <<, which must not be left by an exception.
  turn.row(1) = -axis("FrontAxis", 2).transpose();
  turn.row(2) = axis("UpAxis", 1).transpose();
  if (std::abs(turn.determinant()) != 1) throw std::runtime_error("its axes are not right, up and front");
  float unit = 1;
  if (scene.mMetaData) scene.mMetaData->Get("UnitScaleFactor", unit);
  return Eigen::Affine3d(0.01 * double(unit) * turn);
}

/// From assimp's coordinates to metres with +z up, for the formats that say what theirs are. assimp has already brought
/// COLLADA's to metres with +y up, which are those of glTF.
Eigen::Affine3d to_world(const aiScene& scene, const std::string& ending) {
  if (ending == ".fbx") return fbx_to_world(scene);
  if (ending != ".dae" && ending != ".gltf" && ending != ".glb") return Eigen::Affine3d::Identity();
  Eigen::Matrix3d turn;
  turn << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return Eigen::Affine3d(turn);
}

/// Uses none of assimp's processing steps, since they abort the program on unexpected input.
MeshWithNormals import(const std::filesystem::path& path, const std::string& ending) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path.string(), 0);
  if (!scene) throw std::runtime_error(one_line(importer.GetErrorString()));
  MeshWithNormals mesh;
  if (scene->mRootNode) add_node(*scene, *scene->mRootNode, to_world(*scene, ending), mesh);
  return mesh;
}

MeshWithNormals read_any(const std::filesystem::path& path) {
  const std::string ending = lower_case_ending(path);
  if (ending == ".ply") return read_ply(path);
  if (ending == ".obj") return read_obj(path);
  const std::vector<std::string> others{".stl", ".off", ".gltf", ".glb", ".dae", ".fbx"};
  if (std::find(others.begin(), others.end(), ending) == others.end())
    throw std::runtime_error("a mesh is a .ply, .obj, " + joined(others) +
                             " file; convert other formats to one of these, for example with Blender");
  MeshWithNormals mesh = import(path, ending);
  if (ending == ".stl") mesh.normals.clear();  // They are those of the triangles.
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

MeshWithNormals read_joined(const std::filesystem::path& path, bool normals) {
  MeshWithNormals raw = read_any(path);
  check_finite(raw);
  if (!normals) raw.normals.clear();
  MeshWithNormals mesh = without_repeats(raw);
  if (mesh.mesh.triangles.empty()) throw std::runtime_error("it holds no triangles");
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
  return naming(path, [&] { return read_joined(path, false).mesh; });
}

MeshWithNormals read_mesh_with_normals(const std::filesystem::path& path, std::optional<double> smooth_angle) {
  return naming(path, [&] {
    if (smooth_angle) return with_smooth_normals(read_joined(path, false).mesh, *smooth_angle);
    return read_joined(path, true);
  });
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
