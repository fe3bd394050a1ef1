#include "volumes/tensors/isosurface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>

#include "volumes/bricks/brick_layout.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
using Voxels = Eigen::AlignedBox3i;

/// Index space.
struct Quads {
  std::vector<Vector3d> vertices;
  std::vector<Eigen::Vector4i> corners;
};

float as_float(double value) {
  constexpr double most = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -most, most));
}

/// Sets a voxel, and those beyond the faces of the extent that are next to it, so that contours cross the faces at
/// right angles instead of closing there.
void set_with_margin(openvdb::FloatGrid::Accessor& grid, const Voxels& box, const Vector3i& voxel, float value) {
  const Vector3i first = (voxel.array() == box.min().array()).select(voxel.array() - 1, voxel.array());
  const Vector3i last = (voxel.array() == box.max().array()).select(voxel.array() + 1, voxel.array());
  for (int x = first.x(); x <= last.x(); ++x)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int z = first.z(); z <= last.z(); ++z) grid.setValue({x, y, z}, value);
}

void add_brick(const TensorField& field, const Vector3i& place, const Voxels& box, Invariant which,
               openvdb::FloatGrid::Accessor& grid) {
  const Vector3i origin = TensorBrick::cells * place;
  const TensorBrick brick = field.brick(place);
  TensorSampler sampler(field);
  const Voxels own(origin, origin + Vector3i::Constant(TensorBrick::cells));
  const Voxels shared = own.intersection(box);
  for (int x = shared.min().x(); x <= shared.max().x(); ++x)
    for (int y = shared.min().y(); y <= shared.max().y(); ++y)
      for (int z = shared.min().z(); z <= shared.max().z(); ++z) {
        const Vector3i voxel(x, y, z), p = voxel - origin;
        const Eigen::Matrix3d tensor = field.is_cubic() ? sampler.at(field.to_world() * voxel.cast<double>())
                                                        : brick.tensor(LinearBrick::coefficient(p.x(), p.y(), p.z()));
        set_with_margin(grid, box, voxel, as_float(invariant(which, tensor)));
      }
}

/// The invariant at the voxels of all bricks that are stored, in index space; 0 elsewhere.
openvdb::FloatGrid::Ptr invariant_grid(const TensorField& field, const Voxels& box, Invariant which) {
  const auto brick_of = [](int index) { return index >> 3; };
  static_assert(TensorBrick::cells == 8, "a brick's index is a voxel's, less three bits");
  const Vector3i first = box.min().unaryExpr(brick_of), last = box.max().unaryExpr(brick_of);
  openvdb::initialize();  // As empty_grid() of vdb_archive.h.
  const auto grid =
      openvdb::gridPtrCast<openvdb::FloatGrid>(openvdb::GridBase::createGrid(openvdb::FloatGrid::gridType()));
  openvdb::FloatGrid::Accessor accessor = grid->getAccessor();
  for (int x = first.x(); x <= last.x(); ++x)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int z = first.z(); z <= last.z(); ++z)
        if (field.is_stored({x, y, z})) add_brick(field, {x, y, z}, box, which, accessor);
  return grid;
}

Quads contours(const openvdb::FloatGrid& grid, double value) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> found;
  openvdb::tools::volumeToMesh(grid, points, found, value);
  Quads quads;
  for (const openvdb::Vec3s& p : points) quads.vertices.emplace_back(p.x(), p.y(), p.z());
  for (const openvdb::Vec4I& q : found)
    quads.corners.push_back(Eigen::Matrix<std::uint32_t, 4, 1>(q[0], q[1], q[2], q[3]).cast<int>());
  return quads;
}

/// Triangles of the quads that have a corner in the extent (the others close the contours beyond it), cut along the
/// shorter diagonal, with the vertices moved onto the extent.
TriangleMesh cut_to(const Eigen::AlignedBox3d& extent, const Quads& quads, const Eigen::Affine3d& to_world) {
  TriangleMesh surface;
  constexpr std::uint32_t unused = 0xffffffffu;
  std::vector<std::uint32_t> renumbered(quads.vertices.size(), unused);
  const auto use = [&](int vertex) {
    if (renumbered[vertex] == unused) {
      renumbered[vertex] = static_cast<std::uint32_t>(surface.vertices.size());
      surface.vertices.push_back(to_world * quads.vertices[vertex].cwiseMax(extent.min()).cwiseMin(extent.max()));
    }
    return renumbered[vertex];
  };
  for (const Eigen::Vector4i& quad : quads.corners) {
    if (std::none_of(quad.begin(), quad.end(), [&](int i) { return extent.contains(quads.vertices[i]); })) continue;
    const std::array<std::uint32_t, 4> q{use(quad[0]), use(quad[1]), use(quad[2]), use(quad[3])};
    const auto length = [&](std::size_t i, std::size_t j) {
      return (surface.vertices[q[i]] - surface.vertices[q[j]]).squaredNorm();
    };
    const std::size_t turn = length(0, 2) <= length(1, 3) ? 0 : 1;
    surface.triangles.push_back({q[turn], q[turn + 1], q[turn + 2]});
    surface.triangles.push_back({q[turn], q[turn + 2], q[(turn + 3) % 4]});
  }
  return surface;
}

/// Sums of the triangles' areas times their normals, at each vertex.
std::vector<Vector3d> area_normals(const TriangleMesh& surface) {
  std::vector<Vector3d> normals(surface.vertices.size(), Vector3d::Zero());
  for (const auto& t : surface.triangles) {
    const Vector3d& a = surface.vertices[t[0]];
    const Vector3d normal = (surface.vertices[t[1]] - a).cross(surface.vertices[t[2]] - a);
    for (const std::uint32_t vertex : t) normals[vertex] += normal;
  }
  return normals;
}

/// The gradient in world space, from differences over a voxel to either side, as far as the extent goes.
Vector3d gradient(const TensorField& field, TensorSampler& sampler, Invariant which, const Vector3d& world) {
  const Vector3d index = field.to_index() * world;
  const Eigen::AlignedBox3d& extent = field.index_bounds();
  Vector3d slopes;
  for (int axis = 0; axis < 3; ++axis) {
    Vector3d before = index, after = index;
    before[axis] = std::max(index[axis] - 1, extent.min()[axis]);
    after[axis] = std::min(index[axis] + 1, extent.max()[axis]);
    const double change = invariant(which, sampler.at(field.to_world() * after)) -
                          invariant(which, sampler.at(field.to_world() * before));
    slopes[axis] = change / (after[axis] - before[axis]);
  }
  return field.to_index().linear().transpose() * slopes;
}

/// The triangles' normals stand in where the gradient vanishes.
void add_normals(const TensorField& field, Invariant which, Isosurface& surface) {
  TensorSampler sampler(field);
  surface.normals = area_normals(surface.mesh);
  for (std::size_t i = 0; i < surface.normals.size(); ++i) {
    const Vector3d rise = gradient(field, sampler, which, surface.mesh.vertices[i]);
    if (rise.allFinite() && rise.norm() > 0) surface.normals[i] = -rise;
    surface.normals[i].stableNormalize();
    if (!(surface.normals[i].norm() > 0.5)) surface.normals[i] = Vector3d::UnitZ();
  }
}

}  // namespace

Isosurface isosurface(const TensorField& field, Invariant which, double value) {
  if (!(std::abs(value) <= std::numeric_limits<float>::max()))
    throw std::invalid_argument("an isosurface needs a finite value");
  const Voxels box = Voxels(field.voxels().min().cast<int>(), field.voxels().max().cast<int>());
  if (box.sizes().minCoeff() < 1)
    throw std::invalid_argument("an isosurface needs a field with at least two voxels along each axis");
  const openvdb::FloatGrid::Ptr grid = invariant_grid(field, box, which);
  Isosurface surface;
  surface.mesh = cut_to(field.index_bounds(), contours(*grid, value), field.to_world());
  // OpenVDB's contours are counter-clockwise from the side of greater values.
  if (field.to_world().linear().determinant() > 0)
    for (auto& triangle : surface.mesh.triangles) std::swap(triangle[1], triangle[2]);
  add_normals(field, which, surface);
  return surface;
}

}  // namespace tensorray
