#include "volumes/points/point_files.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointDataGrid.h>

#include "base/geometry/box.h"
#include "volumes/points/vtk_files.h"
#include "volumes/vdb/vdb_archive.h"

namespace tensorray {
namespace {

constexpr double points_per_voxel = 8;

openvdb::Vec3f to_openvdb(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }
float to_openvdb(float value) { return value; }

/// The list of points or of attributes that OpenVDB's conversions take; it refers to the vector.
template <class Stored, class Value>
class List {
 public:
  using PosType = Value;
  using value_type = Value;
  using ValueType = Value;

  explicit List(const std::vector<Stored>& values) : values_(values) {}
  std::size_t size() const { return values_.size(); }
  void getPos(std::size_t i, Value& position) const { position = to_openvdb(values_[i]); }
  void get(Value& value, std::size_t i) const { value = to_openvdb(values_[i]); }
  void get(Value& value, std::size_t i, openvdb::Index) const { get(value, i); }

 private:
  const std::vector<Stored>& values_;
};

using VectorList = List<Eigen::Vector3f, openvdb::Vec3f>;
using ScalarList = List<float, float>;

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

template <class ListType, class Grid, class Index, class Stored>
void add_attribute(Grid& grid, const Index& index, const std::string& name, const std::vector<Stored>& values) {
  using Value = typename ListType::value_type;
  openvdb::points::appendAttribute<Value>(grid.tree(), name);
  openvdb::points::populateAttribute(grid.tree(), index.tree(), name, ListType(values));
}

void write_vdb_points(const std::filesystem::path& path, const PointCloud& cloud) {
  openvdb::initialize();
  const double edge = voxel_edge(cloud.positions);
  const LengthUnit unit = length_unit_for(edge * edge * edge);
  const auto transform = openvdb::math::Transform::createLinearTransform(edge / unit.value);
  std::vector<Eigen::Vector3f> in_unit;
  if (unit.value != 1)
    for (const Eigen::Vector3f& position : cloud.positions)
      in_unit.push_back((position.cast<double>() / unit.value).cast<float>());
  const VectorList positions(unit.value == 1 ? cloud.positions : in_unit);
  const auto index = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(positions, *transform);
  const auto grid = openvdb::points::createPointDataGrid<openvdb::points::NullCodec, openvdb::points::PointDataGrid>(
      *index, positions, *transform);
  grid->setName("points");
  note_unit(*grid, unit);
  for (const auto& [name, values] : cloud.scalars) add_attribute<ScalarList>(*grid, *index, name, values);
  for (const auto& [name, values] : cloud.vectors) add_attribute<VectorList>(*grid, *index, name, values);
  openvdb::MetaMap metadata;
  for (const auto& [key, value] : cloud.metadata) metadata.insertMeta(key, openvdb::StringMetadata(value));
  write_vdb(path, {grid}, metadata);
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
