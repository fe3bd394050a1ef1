#include "scenes/photons/plate_map.h"

#include <algorithm>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "integrators/flow/flow_view.h"
#include "scenes/scene/fine_bands.h"

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// From pixels of a plate to the start, in the beam's frame, of straight light that lands there.
Eigen::Affine2d straight_starts(const Plate& plate, const Beam& beam) {
  const auto start = [&](const Vector2d& pixel) -> Vector2d {
    const Vector3d from_center = plate.to_world(pixel) - beam.center;
    return {from_center.dot(beam.right), from_center.dot(beam.up)};
  };
  Eigen::Affine2d map;
  map.translation() = start({0, 0});
  map.linear() << start({1, 0}) - map.translation(), start({0, 1}) - map.translation();
  return map;
}

double limited(double logarithm) { return std::clamp(logarithm, -100.0, 100.0); }

void describe(const FlowPoint& point, const Vector2d& pixel, const Plate& plate, const Eigen::Affine2d& straight,
              float* values) {
  if (point.end != RayEnd::plate) return;
  const auto next = [&values](double value) { *values++ = static_cast<float>(value); };
  const Vector3d moved = plate.to_world(pixel) - plate.to_world(straight.inverse() * point.other.cast<double>());
  for (int i = 0; i < 3; ++i) next(moved[i]);
  // World units on the plate, along right and up, by those across the beam.
  const Vector2d pixel_size = plate.pixel_size();
  const Matrix2d jacobian = Vector2d(pixel_size.x(), -pixel_size.y()).asDiagonal() * point.jacobian.cast<double>();
  const PrincipalStretch stretch = principal_stretch(jacobian);
  next(limited(stretch.logs.sum()));
  next(limited(stretch.logs[0]));
  next(limited(stretch.logs[1]));
  next(stretch.angle);
  next(point.sheets);
  next(point.length);
  next(std::min(point.error, 100.0f));
}

}  // namespace

Image plate_map(const FlowMap& map, const Scene& scene, Team* team) {
  const Plate& plate = *scene.geometry.surfaces().plate;
  FlowPicture picture;
  picture.resolution = plate.resolution;
  picture.straight = straight_starts(plate, scene.beam);
  const FlowView view(map, picture, {reference_place(scene) * static_cast<double>(map.nodes - 1)}, 1);
  Image image(plate.resolution.x(), plate.resolution.y(),
              {"displacement.x", "displacement.y", "displacement.z", "magnification.log", "magnification.major",
               "magnification.minor", "magnification.angle", "folds", "length", "error"});
  tbb::parallel_for(0, view.tiles(), [&](int tile) {
    if (!does_part(team, static_cast<std::size_t>(tile))) return;
    std::vector<FlowPoint> points;
    view.draw(tile, 1, 0, {}, points);
    const Eigen::AlignedBox2i box = view.pixels(tile);
    std::size_t i = 0;
    for (int y = box.min().y(); y <= box.max().y(); ++y)
      for (int x = box.min().x(); x <= box.max().x(); ++x)
        describe(points[i++], {x + 0.5, y + 0.5}, plate, picture.straight, image.pixel(x, y));
  });
  const auto tiles = static_cast<std::size_t>(view.tiles());
  if (team)
    collect_parts(*team, tiles, FlowView::tiles_at_once, [&](std::size_t tile, PartBytes& bytes) {
      const Eigen::AlignedBox2i box = view.pixels(static_cast<int>(tile));
      const std::size_t row = (static_cast<std::size_t>(box.sizes().x()) + 1) * image.channels.size() * sizeof(float);
      for (int y = box.min().y(); y <= box.max().y(); ++y) bytes.copy(image.pixel(box.min().x(), y), row);
    });
  return image;
}

}  // namespace tensorray
