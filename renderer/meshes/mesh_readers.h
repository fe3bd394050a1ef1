#pragma once
/// The formats that read_mesh (mesh.h) reads. Vertices are as in the file: not joined, and not checked to be finite.
/// Errors are std::runtime_error with the reason, without the file's name.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "renderer/meshes/mesh.h"

namespace tensorray {

/// The Stanford polygon format (.ply), ASCII and binary: the elements `vertex` (x, y, z; nx, ny, nz; u, v or s, t, also
/// after texture_), `face` (vertex_indices, texcoord) and `tristrips` (vertex_indices, where −1 begins a new strip).
/// All others are skipped. This reader exists because assimp 5.2 does not read the format reliably: it repeats the last
/// face of a truncated file, never returns from a truncated header, and misreads binary vertices that begin with the
/// byte of a line end.
MeshWithNormals read_ply(const std::filesystem::path& path);

/// Wavefront's format (.obj): v, vt, vn and f; all objects and groups are one mesh. Points, lines and materials have no
/// surface and are left out. Anything else is an error with its line, so that no face is lost.
/// This reader exists because libraries make another mesh of what they do not understand, without a word: assimp 5.2
/// leaves out faces v/vt/vn of files without vt, and faces before a comment; tinyobjloader takes words that are no
/// numbers for 0, and leaves out continued lines and unknown statements.
MeshWithNormals read_obj(const std::filesystem::path& path);

/// What assimp reads: .stl, .off, .gltf, .glb, .dae, .fbx, in metres with +z up where the format says its unit and
/// axes. Damaged files of these formats can crash the process that reads them, so another one does: `tensorray
/// --read-mesh`. The two exchange triangles in a file without a name. Any thread may call this. Where there is no
/// program `tensorray` (child_program.h), as beside another program that uses the library, the file is read in this
/// process, where .off files with faces of vertices that are not there are read with other ones. @throw also Cancelled.
MeshWithNormals read_assimp_mesh(const std::filesystem::path& path);

/// What `tensorray --read-mesh` does: reads the file in this process, and writes the mesh to `exchange`, in place.
void write_assimp_mesh(const std::filesystem::path& path, const std::filesystem::path& exchange);

/// What assimp does not read rightly of glTF 2.0, prepared for it: files by their names, which stand beside a .gltf or
/// .glb whose positions and normals are integers (KHR_mesh_quantization), or whose base colours move
/// (KHR_texture_transform) or are not of the first texture coordinates; gltf_in_memory_name, which is to be read
/// instead, has floats. Empty if there are none, or the file is no glTF 2.0.
/// @throw std::runtime_error naming an extension that is required but not read, or integers beyond their buffer.
std::map<std::string, std::string> gltf_in_memory(const std::filesystem::path& path);
constexpr const char* gltf_in_memory_name = "tensorray.gltf";

/// Adds a polygon as triangles, with the order of its corners. A convex polygon becomes a fan; of others, ears are cut
/// off (Meisters 1975) as seen along the polygon's normal (Newell's). Corners that lie on a line between their
/// neighbours become corners of triangles, too, so that neighbouring polygons stay joined. A polygon that crosses
/// itself becomes as many triangles, which may overlap.
/// @param corners  At least three vertices. @throw std::runtime_error if a concave polygon has more than 10,000.
void add_polygon(const std::vector<std::uint32_t>& corners, TriangleMesh& mesh);

}  // namespace tensorray
