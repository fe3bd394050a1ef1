#include "volumes/tensors/isosurface.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>

#include "volumes/bricks/tensor_sampler.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
using Voxels = Eigen::AlignedBox3i;

/// Quadrilaterals, in index space.
struct Quads {
  std::vector<Vector3d> vertices;
  std::vector<Eigen::Vector4i> corners;
};

float as_float(double value) {
  constexpr double most = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -most, most));
}

/// Sets a voxel, and its neighbours beyond the faces of the extent. Contours then cross the faces at right angles
/// instead of closing there.
void set_with_margin(openvdb::FloatGrid::Accessor& grid, const Voxels& box, const Vector3i& voxel, float value) {
  const Vector3i first = (voxel.array() == box.min().array()).select(voxel.array() - 1, voxel.array());
  const Vector3i last = (voxel.array() == box.max().array()).select(voxel.array() + 1, voxel.array());
  for (int x = first.x(); x <= last.x(); ++x)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int z = first.z(); z <= last.z(); ++z) grid.setValue({x, y, z}, value);
}

void add_brick(const TensorBrick& brick, const Vector3i& origin, const Voxels& box, Invariant which,
               openvdb::FloatGrid::Accessor& grid) {
  const Voxels own(origin, origin + Vector3i::Constant(TensorBrick::cells));
  const Voxels shared = own.intersection(box);
  for (int x = shared.min().x(); x <= shared.max().x(); ++x)
    for (int y = shared.min().y(); y <= shared.max().y(); ++y)
      for (int z = shared.min().z(); z <= shared.max().z(); ++z) {
        const Vector3i voxel(x, y, z), p = voxel - origin;
        const Eigen::Matrix3d tensor = brick.tensor(TensorBrick::voxel(p.x(), p.y(), p.z()));
        set_with_margin(grid, box, voxel, as_float(invariant(which, tensor)));
      }
}

/// The invariant at the voxels of all bricks that are stored, in index space; 0 elsewhere.
openvdb::FloatGrid::Ptr invariant_grid(const TensorField& field, const Voxels& box, Invariant which) {
  const auto brick_of = [](int index) { return index >> 3; };
  static_assert(TensorBrick::cells == 8, "a brick's index is a voxel's, less three bits");
  const Vector3i first = box.min().unaryExpr(brick_of), last = box.max().unaryExpr(brick_of);
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0);
  openvdb::FloatGrid::Accessor accessor = grid->getAccessor();
  for (int x = first.x(); x <= last.x(); ++x)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int z = first.z(); z <= last.z(); ++z)
        if (field.is_stored({x, y, z}))
          add_brick(field.brick({x, y, z}), TensorBrick::cells * Vector3i(x, y, z), box, which, accessor);
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

/// Triangles of the quads that have a corner in the extent; the other quads close the contours outside it. Each quad is
/// cut along its shorter diagonal, and vertices outside the extent are moved onto its faces.
Isosurface cut_to(const Eigen::AlignedBox3d& extent, const Quads& quads, const Eigen::Affine3d& to_world) {
  Isosurface surface;
  std::vector<int> renumbered(quads.vertices.size(), -1);
  const auto use = [&](int vertex) {
    if (renumbered[vertex] < 0) {
      renumbered[vertex] = static_cast<int>(surface.vertices.size());
      surface.vertices.push_back(to_world * quads.vertices[vertex].cwiseMax(extent.min()).cwiseMin(extent.max()));
    }
    return renumbered[vertex];
  };
  for (const Eigen::Vector4i& quad : quads.corners) {
    if (std::none_of(quad.begin(), quad.end(), [&](int i) { return extent.contains(quads.vertices[i]); })) continue;
    const Eigen::Vector4i q = quad.unaryExpr(use);
    const auto length = [&](int i, int j) { return (surface.vertices[q[i]] - surface.vertices[q[j]]).squaredNorm(); };
    const int turn = length(0, 2) <= length(1, 3) ? 0 : 1;
    surface.triangles.emplace_back(q[turn], q[turn + 1], q[turn + 2]);
    surface.triangles.emplace_back(q[turn], q[turn + 2], q[(turn + 3) % 4]);
  }
  return surface;
}

/// At each vertex, the sum of its triangles' normals, each as long as twice the triangle's area.
std::vector<Vector3d> area_normals(const Isosurface& surface) {
  std::vector<Vector3d> normals(surface.vertices.size(), Vector3d::Zero());
  for (const Vector3i& t : surface.triangles) {
    const Vector3d& a = surface.vertices[t[0]];
    const Vector3d normal = (surface.vertices[t[1]] - a).cross(surface.vertices[t[2]] - a);
    for (const int vertex : t) normals[vertex] += normal;
  }
  return normals;
}

/// The gradient of the invariant in world space, from differences over one voxel to either side, or less at the faces
/// of the extent.
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

/// Sets normals from the gradient; where it vanishes, from the triangles.
void add_normals(const TensorField& field, Invariant which, Isosurface& surface) {
  TensorSampler sampler(field);
  surface.normals = area_normals(surface);
  for (std::size_t i = 0; i < surface.normals.size(); ++i) {
    const Vector3d rise = gradient(field, sampler, which, surface.vertices[i]);
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
  openvdb::initialize();
  const openvdb::FloatGrid::Ptr grid = invariant_grid(field, box, which);
  Isosurface surface = cut_to(field.index_bounds(), contours(*grid, value), field.to_world());
  // OpenVDB's contours are counter-clockwise as seen from the side of greater values.
  if (field.to_world().linear().determinant() > 0)
    for (Vector3i& triangle : surface.triangles) std::swap(triangle[1], triangle[2]);
  add_normals(field, which, surface);
  return surface;
}

}  // namespace tensorray
