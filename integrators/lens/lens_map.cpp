#include <algorithm>
#include <numeric>

#include "integrators/lens/lens.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

constexpr double reach = 100;    // Size of the planes, in sizes of the volume.
constexpr double behind = 1e-5;  // Distance, in sizes of the volume, from the start back to the plane that stops light.
                                 // Without it, light that starts on a surface would meet that surface at once.

/// Whether a part of the volume lies behind a plane that faces along `normal`.
bool is_cut(const TriangleMesh& volume, const Plate& plane, const Eigen::Vector3d& normal, double size) {
  return std::any_of(volume.vertices.begin(), volume.vertices.end(),
                     [&](const Eigen::Vector3d& vertex) { return normal.dot(vertex - plane.center) < -behind * size; });
}

Plate enlarged(Plate plate, double size) {
  plate.size = plate.size.cwiseMax(reach * size);
  return plate;
}

/// The plane where light lands becomes the plate. The plane where it starts becomes an obstacle if it cuts the volume.
/// (Light does not return to a plane outside the volume: light that has left the volume goes straight.)
Geometry make_geometry(const Surfaces& surfaces, const Plate& from, const Plate& to, const Eigen::Vector3d& direction) {
  const double size = surfaces.bounds.bounds().diagonal().norm();
  Surfaces all = surfaces;
  all.plate = enlarged(to, size);
  const Eigen::Vector3d normal = from.normal().dot(direction) > 0 ? from.normal() : Eigen::Vector3d(-from.normal());
  if (is_cut(surfaces.bounds, from, normal, size)) {
    Plate back = enlarged(from, size);
    back.center -= behind * size * normal;
    all.obstacles.push_back({back.corners(), {{0, 1, 2}, {0, 2, 3}}});
  }
  return Geometry(std::move(all));
}

Eigen::Matrix<double, 3, 2> axes(const Plate& plate) {
  Eigen::Matrix<double, 3, 2> columns;
  columns << plate.right, plate.up;
  return columns;
}

}  // namespace

Eigen::Vector3d plane_point(const Plate& plate, const Eigen::Vector2d& at) { return plate.center + axes(plate) * at; }

Eigen::Vector2d plane_coordinates(const Plate& plate, const Eigen::Vector3d& point) {
  return axes(plate).transpose() * (point - plate.center);
}

LensMap::LensMap(const TensorField& field, const Surfaces& surfaces, const BendingSettings& bending, const Plate& from,
                 const Plate& to, const Eigen::Vector3d& direction)
    : field_(&field),
      bending_(bending),
      from_(from),
      to_(to),
      direction_(direction),
      geometry_(make_geometry(surfaces, from, to, direction)) {}

TraceCounts LensMap::trace(const std::vector<Eigen::Vector2d>& starts, const std::vector<double>& flexibilities,
                           LensLanding* landings) const {
  RayBatch batch;
  RayDifferential differential;
  differential.position = axes(from_);
  for (const Eigen::Vector2d& start : starts)
    for (const double flexibility : flexibilities) {
      batch.add(plane_point(from_, start), direction_, flexibility);
      batch.differentials.push_back(differential);
    }
  tensorray::trace(*field_, geometry_, bending_, batch);
  for (std::size_t i = 0; i < batch.size(); ++i)
    landings[i] = {batch.end[i], plane_coordinates(to_, batch.position[i]),
                   axes(to_).transpose() * batch.differentials[i].position, batch.length[i]};
  return {std::accumulate(batch.steps.begin(), batch.steps.end(), std::uint64_t{0}), batch.tensor_samples};
}

}  // namespace tensorray
