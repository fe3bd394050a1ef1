#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <assimp/DefaultIOSystem.h>
#include <assimp/DefaultLogger.hpp>
#include <assimp/Importer.hpp>
#include <assimp/LogStream.hpp>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/scene.h>
#include <unistd.h>

#include "base/process/child_program.h"
#include "base/text/text.h"
#include "renderer/meshes/mesh_readers.h"

namespace tensorray {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

void check_face(const aiMesh& part, const aiFace& face) {
  if (face.mNumIndices == 0) throw std::runtime_error("a face has no vertices");
  if (*std::max_element(face.mIndices, face.mIndices + face.mNumIndices) >= part.mNumVertices)
    throw std::runtime_error("a face names a vertex that is not there");
}

void add_face(const aiFace& face, std::uint32_t offset, bool mirrored, TriangleMesh& mesh) {
  std::vector<std::uint32_t> corners;
  for (unsigned i = 0; i < face.mNumIndices; ++i) corners.push_back(offset + face.mIndices[i]);
  const std::size_t before = mesh.triangles.size();
  add_polygon(corners, mesh);
  for (std::size_t i = before; mirrored && i < mesh.triangles.size(); ++i)
    std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
}

Eigen::Affine3d affine_of(const aiMatrix4x4& matrix) {
  Eigen::Affine3d result;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) result.matrix()(row, column) = double(matrix[row][column]);
  return result;
}

void add_mesh(const aiMesh& part, const Eigen::Affine3d& to_world, MeshWithNormals& result) {
  TriangleMesh& mesh = result.mesh;
  if (mesh.vertices.size() + part.mNumVertices > std::numeric_limits<std::uint32_t>::max())
    throw std::runtime_error("it has more than 2^32 vertices");
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
    if (!part.HasTextureCoords(0)) continue;
    result.places.resize(result.normals.size() - 1, Eigen::Vector2f::Zero());  // Of parts that have none.
    result.places.emplace_back(part.mTextureCoords[0][i].x, part.mTextureCoords[0][i].y);
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    check_face(part, part.mFaces[i]);
    if (part.mFaces[i].mNumIndices < 3) continue;  // Points and lines have no surface.
    add_face(part.mFaces[i], offset, mirrored, mesh);
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

/// FBX says which of its axes are right, up and front, and its unit in centimetres. assimp passes on both.
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
  // The format's root has no transformation. assimp 5.4 and newer turn and scale it by the same axes and unit.
  return Eigen::Affine3d(0.01 * double(unit) * turn) * affine_of(scene.mRootNode->mTransformation).inverse();
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

/// Opens files only, so that no pipe or device that a file names is waited for; and files in memory, by their names.
class FilesOnly : public Assimp::DefaultIOSystem {
 public:
  explicit FilesOnly(std::map<std::string, std::string> in_memory) : in_memory_(std::move(in_memory)) {}

  Assimp::IOStream* Open(const char* name, const char* mode) override {
    if (const auto found = find(name); found != in_memory_.end())
      return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(found->second.data()),
                                        found->second.size());
    return Exists(name) ? Assimp::DefaultIOSystem::Open(name, mode) : nullptr;
  }
  bool Exists(const char* name) const override {
    std::error_code none;
    return find(name) != in_memory_.end() || std::filesystem::is_regular_file(name, none);
  }

 private:
  std::map<std::string, std::string>::const_iterator find(const std::filesystem::path& path) const {
    return in_memory_.find(path.filename().string());
  }

  std::map<std::string, std::string> in_memory_;
};

/// Where a face names a vertex that is not there, some readers take another one, and only log it.
class IndexErrors : public Assimp::LogStream {
 public:
  IndexErrors() {
    Assimp::DefaultLogger::create(nullptr, Assimp::Logger::NORMAL, 0);
    Assimp::DefaultLogger::get()->attachStream(this, Assimp::Logger::Err);
  }
  ~IndexErrors() override {
    Assimp::DefaultLogger::get()->detachStream(this, Assimp::Logger::Err);
    Assimp::DefaultLogger::kill();
  }
  IndexErrors(const IndexErrors&) = delete;
  IndexErrors& operator=(const IndexErrors&) = delete;

  void write(const char* message) override {
    if (std::string(message).find("out of range") != std::string::npos) found_ = true;
  }
  bool found() const { return found_; }

 private:
  bool found_ = false;
};

/// Uses none of assimp's processing steps, since they abort the program on unexpected input.
MeshWithNormals import(const std::filesystem::path& path) {
  const std::string ending = lower_case_ending(path);
  const auto in_memory =
      ending == ".gltf" || ending == ".glb" ? gltf_in_memory(path) : std::map<std::string, std::string>();
  Assimp::Importer importer;
  importer.SetIOHandler(new FilesOnly(in_memory));  // The importer deletes it.
  const aiScene* scene =
      importer.ReadFile((in_memory.empty() ? path : path.parent_path() / gltf_in_memory_name).string(), 0);
  const std::string error = importer.GetErrorString();
  if (error.find("bad_alloc") != std::string::npos) throw std::bad_alloc();
  if (!scene) throw std::runtime_error(one_line(error));
  MeshWithNormals mesh;
  if (scene->mRootNode) add_node(*scene, *scene->mRootNode, to_world(*scene, ending), mesh);
  if (!mesh.places.empty()) mesh.places.resize(mesh.mesh.vertices.size(), Eigen::Vector2f::Zero());
  return mesh;
}

template <class Value>
void write_values(std::ostream& file, const std::vector<Value>& values) {
  const std::uint64_t count = values.size();
  file.write(reinterpret_cast<const char*>(&count), sizeof count);
  file.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(count * sizeof(Value)));
}

template <class Value>
std::vector<Value> read_values(std::istream& file) {
  std::uint64_t count = 0;
  file.read(reinterpret_cast<char*>(&count), sizeof count);
  std::vector<Value> values(file ? count : 0);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(Value)));
  if (!file) throw std::runtime_error("what its reader wrote is cut off");
  return values;
}

/// Reads what write_assimp_mesh wrote.
MeshWithNormals read_exchanged(const std::filesystem::path& exchange) {
  std::ifstream file(exchange, std::ios::binary);
  MeshWithNormals mesh;
  mesh.mesh.vertices = read_values<Eigen::Vector3d>(file);
  mesh.mesh.triangles = read_values<Triangle>(file);
  mesh.normals = read_values<Eigen::Vector3f>(file);
  mesh.places = read_values<Eigen::Vector2f>(file);
  return mesh;
}

}  // namespace

MeshWithNormals read_assimp_mesh(const std::filesystem::path& path) {
  const std::filesystem::path program = sibling_program("tensorray");
  std::error_code none;
  if (!std::filesystem::is_regular_file(program, none) || access(program.c_str(), X_OK) != 0) return import(path);
  const UnnamedFile exchange;
  const ProgramEnd end = run_program(program, {"--read-mesh", shared_file, path.string()}, exchange);
  if (end.signal == 0 && end.status == 0) return read_exchanged(exchange.path());
  if (end.signal != 0)
    throw std::runtime_error("it ended its reader; it is damaged or cut off, or does not fit in memory");
  const std::string reason = one_line(end.error);
  if (!reason.empty()) throw std::runtime_error(reason);
  throw std::runtime_error("its reader failed without a word; the folder for temporary files, " +
                           temporary_files().string() + ", may be full");
}

void write_assimp_mesh(const std::filesystem::path& path, const std::filesystem::path& exchange) {
  const IndexErrors errors;  // The logger is one for the process.
  const MeshWithNormals mesh = import(path);
  if (errors.found()) throw std::runtime_error("a face names a vertex that is not there");
  std::ofstream file(exchange, std::ios::binary);
  write_values(file, mesh.mesh.vertices);
  write_values(file, mesh.mesh.triangles);
  write_values(file, mesh.normals);
  write_values(file, mesh.places);
  if (!file.flush()) throw std::runtime_error("its triangles cannot be written to the temporary folder; is it full?");
}

}  // namespace tensorray
