#include "volumes/files/surface_grids.h"

#include <cmath>
#include <vector>

#include "base/errors.h"
#include "volumes/files/grid_voxels.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr std::size_t rows_of_block = TensorBlock::voxels / 2;

/// @param place_of_cube  Of edge 1: the voxels are in it.
openvdb::GridBase::Ptr list_grid(const std::string& name, const std::vector<Vector3d>& rows,
                                 const Eigen::Affine3d& place_of_cube) {
  const auto grid = empty_grid<openvdb::Vec3SGrid>();
  grid->setName(name);
  grid->setVectorType(openvdb::VEC_INVARIANT);
  const std::size_t blocks = (rows.size() + rows_of_block - 1) / rows_of_block;
  const auto edge = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(blocks))));  // Blocks of the cube.
  openvdb::Vec3STree::LeafNodeType* leaf = nullptr;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::size_t block = i / rows_of_block;
    const Eigen::Vector3i at(
        Eigen::Matrix<std::size_t, 3, 1>(block / edge / edge, block / edge % edge, block % edge).cast<int>());
    if (i % rows_of_block == 0) {
      leaf = new openvdb::Vec3STree::LeafNodeType(coord_of(TensorBlock::size * at));
      grid->tree().addLeaf(leaf);  // The tree owns it.
    }
    const Vector3d rounded = rows[i].cast<float>().cast<double>();
    const auto voxel = static_cast<openvdb::Index>(2 * (i % rows_of_block));
    leaf->setValueOn(voxel, openvdb::Vec3s(rounded.data()));
    leaf->setValueOn(voxel + 1, openvdb::Vec3s(Vector3d(rows[i] - rounded).data()));
  }
  place(*grid, place_of_cube * Eigen::Scaling(1.0 / static_cast<double>(edge * TensorBlock::size)));
  return grid;
}

[[noreturn]] void fail_surface(const std::filesystem::path& path, const std::string& grid, const std::string& what) {
  fail(path, "the surface of its body is damaged: grid " + grid + " " + what + "; import or write the field again");
}

std::vector<Vector3d> read_list(const std::filesystem::path& path, const VdbGrid& grid) {
  if (grid.type != openvdb::Vec3STree::treeType()) fail_surface(path, grid.name, "has the type " + grid.type);
  const std::vector<FieldGrid> grids{{grid, {{0, 0, 0}, {1, 1, 0}, {2, 2, 0}}}};
  std::vector<Vector3d> rows;
  SampleBlock block;
  for (const BlockShape& shape : find_blocks(path, grids, sizeof block)) {
    static_cast<BlockShape&>(block) = shape;
    put_values(path, grids, block);
    for (std::size_t i = 0; i < TensorBlock::voxels && block.active[i]; i += 2)
      rows.emplace_back(block.values[i] + block.values[i + 1]);
  }
  for (const Vector3d& row : rows)
    if (!row.allFinite()) fail_surface(path, grid.name, "has numbers that are not finite");
  return rows;
}

std::string points_name(const std::string& field) { return field + "_surface_points"; }
std::string triangles_name(const std::string& field) { return field + "_surface_triangles"; }

}  // namespace

std::set<std::string> surface_names(const std::string& field) { return {points_name(field), triangles_name(field)}; }

openvdb::GridPtrVec surface_grids(const TriangleMesh& surface, const std::string& field,
                                  const Eigen::Affine3d& to_world, const Eigen::Vector3i& first_voxel) {
  if (surface.triangles.empty()) return {};
  const Eigen::Affine3d to_index = to_world.inverse(),
                        cube = to_world * Eigen::Translation3d(first_voxel.cast<double>());
  std::vector<Vector3d> points, triangles;
  for (const Vector3d& vertex : surface.vertices) points.emplace_back(to_index * vertex);
  for (const auto& t : surface.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  return {list_grid(points_name(field), points, cube), list_grid(triangles_name(field), triangles, cube)};
}

TriangleMesh read_surface(const std::filesystem::path& path, const VdbFile& file, const std::string& field,
                          const Eigen::Affine3d& to_world) {
  TriangleMesh surface;
  const VdbGrid *points = nullptr, *triangles = nullptr;
  for (const VdbGrid& grid : file.grids) {
    if (grid.name == points_name(field)) points = &grid;
    if (grid.name == triangles_name(field)) triangles = &grid;
  }
  if (!points && !triangles) return surface;
  if (!points) fail_surface(path, points_name(field), "is missing");
  if (!triangles) fail_surface(path, triangles_name(field), "is missing");
  for (const Vector3d& point : read_list(path, *points)) surface.vertices.emplace_back(to_world * point);
  const double count = static_cast<double>(surface.vertices.size());
  for (const Vector3d& row : read_list(path, *triangles)) {
    if (!(row.minCoeff() >= 0 && row.maxCoeff() < count) || row != row.array().round().matrix())
      fail_surface(path, triangles->name, "has numbers of points that are not there");
    const Eigen::Matrix<std::uint32_t, 3, 1> t = row.cast<std::uint32_t>();
    surface.triangles.push_back({t[0], t[1], t[2]});
  }
  if (surface.triangles.empty()) fail_surface(path, triangles->name, "is empty");
  return surface;
}

}  // namespace tensorray
