#include "volumes/points/point_files.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <tuple>

#include <Eigen/Geometry>
#include <openvdb/points/PointDataGrid.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "base/geometry/box.h"
#include "volumes/points/vtk_files.h"
#include "volumes/vdb/vdb_archive.h"

namespace tensorray {
namespace {

constexpr double points_per_voxel = 8;

/// The edge of voxels that hold about eight points each if the points are spread evenly over their box. Points in a
/// plane or on a line fill fewer voxels: an axis counts only where the box is thicker than a voxel.
double voxel_edge(const std::vector<Eigen::Vector3f>& positions) {
  const Eigen::AlignedBox3d box = box_of(positions).cast<double>();
  if (box.isEmpty()) return 1;
  Eigen::Vector3d extent = box.sizes();
  std::sort(extent.data(), extent.data() + 3, std::greater<>());
  const double voxels = std::max(1.0, static_cast<double>(positions.size()) / points_per_voxel);
  const double volume_edge = std::cbrt(extent.prod() / voxels);
  const double area_edge = std::sqrt(extent[0] * extent[1] / voxels);
  double edge = extent[0] / voxels;
  if (extent[2] >= volume_edge && extent[2] > 0)
    edge = volume_edge;
  else if (extent[1] >= area_edge && extent[1] > 0)
    edge = area_edge;
  // Indices must fit 32 bits. Voxels smaller than the precision of the positions separate no points.
  const double farthest = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  edge = std::max(edge, 1e-7 * farthest);
  return edge > 0 ? edge : 1;
}

using PointLeaf = openvdb::points::PointDataTree::LeafNodeType;

openvdb::Vec3f to_openvdb(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }

/// Where a point is in the tree.
struct PointPlace {
  openvdb::Coord leaf;  ///< Its origin.
  openvdb::Index voxel = 0;
  std::size_t point = 0;

  bool operator<(const PointPlace& other) const {
    return std::tie(leaf, voxel, point) < std::tie(other.leaf, other.voxel, other.point);
  }
};

/// The centre of a voxel has whole numbers.
openvdb::Vec3d in_voxels(const Eigen::Vector3f& position, double edge) {
  return openvdb::Vec3d(to_openvdb(position)) / edge;
}

/// In the order of leaves and voxels.
std::vector<PointPlace> places_of(const std::vector<Eigen::Vector3f>& positions, double edge) {
  std::vector<PointPlace> places(positions.size());
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) {
    const openvdb::Coord voxel = openvdb::Coord::round(in_voxels(positions[i], edge));
    places[i] = {voxel & ~static_cast<openvdb::Int32>(PointLeaf::DIM - 1), PointLeaf::coordToOffset(voxel), i};
  });
  tbb::parallel_sort(places.begin(), places.end());
  return places;
}

/// An attribute of the points of a leaf, in their order. @param value_of  That of a point, by its number.
template <class ValueOf>
void set_attribute(PointLeaf& leaf, const std::string& name, const PointPlace* first, openvdb::Index count,
                   const ValueOf& value_of) {
  using Value = decltype(value_of(*first));
  const auto handle = openvdb::points::AttributeWriteHandle<Value>::create(leaf.attributeArray(name));
  for (openvdb::Index i = 0; i < count; ++i) handle->set(i, value_of(first[i]));
}

/// OpenVDB's own conversion (PointConversion.h) takes a twentieth of the time to compile the whole program.
/// @param edge  Of a voxel.
openvdb::points::PointDataGrid::Ptr point_grid(const PointCloud& cloud, double edge) {
  using openvdb::points::AttributeSet;
  const auto grid = empty_grid<openvdb::points::PointDataGrid>();
  const auto vector = openvdb::points::TypedAttributeArray<openvdb::Vec3f>::attributeType();
  const auto scalar = openvdb::points::TypedAttributeArray<float>::attributeType();
  auto attributes = AttributeSet::Descriptor::create(vector);  // Its name is P.
  for (const auto& list : cloud.scalars) attributes = attributes->duplicateAppend(list.first, scalar);
  for (const auto& list : cloud.vectors) attributes = attributes->duplicateAppend(list.first, vector);
  const std::vector<PointPlace> places = places_of(cloud.positions, edge);
  for (std::size_t begin = 0, end = 0; begin < places.size(); begin = end) {
    while (end < places.size() && places[end].leaf == places[begin].leaf) ++end;
    const PointPlace* const first = &places[begin];
    const auto count = static_cast<openvdb::Index>(end - begin);
    auto* const leaf = new PointLeaf(first->leaf);
    grid->tree().addLeaf(leaf);  // The tree owns it.
    leaf->replaceAttributeSet(new AttributeSet(attributes, count), /*allowMismatchingDescriptors=*/true);
    std::vector<PointLeaf::ValueType> ends(PointLeaf::SIZE);  // Of each voxel's points.
    for (openvdb::Index voxel = 0, i = 0; voxel < PointLeaf::SIZE; ++voxel) {
      while (i < count && first[i].voxel == voxel) ++i;
      ends[voxel] = i;
    }
    leaf->setOffsets(ends);
    set_attribute(*leaf, "P", first, count, [&](const PointPlace& at) {
      const openvdb::Coord voxel = PointLeaf::offsetToLocalCoord(at.voxel) + at.leaf;
      return openvdb::Vec3f(in_voxels(cloud.positions[at.point], edge) - voxel.asVec3d());
    });
    for (const auto& [name, values] : cloud.scalars)
      set_attribute(*leaf, name, first, count, [&list = values](const PointPlace& at) { return list[at.point]; });
    for (const auto& [name, values] : cloud.vectors)
      set_attribute(*leaf, name, first, count,
                    [&list = values](const PointPlace& at) { return to_openvdb(list[at.point]); });
  }
  return grid;
}

void write_vdb_points(const std::filesystem::path& path, const PointCloud& cloud) {
  const double edge = voxel_edge(cloud.positions);
  const LengthUnit unit = length_unit_for(edge * edge * edge);
  const auto grid = point_grid(cloud, edge);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(edge / unit.value));
  grid->setName("points");
  note_unit(*grid, unit);
  openvdb::MetaMap metadata;
  for (const auto& [key, value] : cloud.metadata) metadata.insertMeta(key, openvdb::StringMetadata(value));
  write_vdb(path, {{grid}}, metadata);
}

template <class Values>
void check_sizes(const PointCloud& cloud, const std::map<std::string, Values>& attributes) {
  for (const auto& [name, values] : attributes)
    if (values.size() != cloud.positions.size())
      throw std::invalid_argument("point attribute \"" + name + "\" must have one value a point");
}

}  // namespace

void write_points(const std::filesystem::path& path, const PointCloud& points) {
  check_sizes(points, points.scalars);
  check_sizes(points, points.vectors);
  if (path.extension() == ".vdb") return write_vdb_points(path, points);
  if (path.extension() == ".vtp") return write_vtp(path, points);
  throw std::invalid_argument(path.string() + ": points are written as .vdb or .vtp; change the file's ending");
}

}  // namespace tensorray
