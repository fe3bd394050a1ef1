#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "integrators/lens/lens.h"

namespace tensorray {
namespace {

constexpr double face_on = 0.45, edge_on = 0.1;  // Radiance of an obstacle; 1 is the white of the image.

/// Radiance and alpha at a place of the receiver.
Eigen::Vector2d see_obstacle(const Geometry& obstacles, const LensSetup& setup, const Eigen::Vector2d& pixel) {
  const Plate& plane = setup.image.plane;
  const Eigen::Vector3d point = setup.receiver.to_world(pixel), normal = plane.normal();
  const double to_plane = normal.dot(point - plane.center) / normal.dot(setup.direction);
  const std::optional<Hit> hit = obstacles.absorber(point, -setup.direction, to_plane);
  if (!hit) return {0, 0};
  return {edge_on + (face_on - edge_on) * std::abs(hit->normal.dot(setup.direction)), 1};
}

}  // namespace

void draw_obstacles(const Surfaces& surfaces, const LensSetup& setup, int samples, Image& image) {
  const Geometry obstacles({surfaces.bounds, std::nullopt, std::nullopt, surfaces.obstacles});
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      float* pixel = image.pixel(x, y);
      const float open = 1 - pixel[3];
      if (!(open > 0)) continue;
      Eigen::Vector2d seen(0, 0);
      for (int i = 0; i < samples * samples; ++i)
        seen += see_obstacle(obstacles, setup,
                             Eigen::Vector2d(x, y) + Eigen::Vector2d(i % samples + 0.5, i / samples + 0.5) / samples);
      const Eigen::Vector2f added = open * (seen / (samples * samples)).cast<float>();
      for (int c = 0; c < 3; ++c) pixel[c] += added[0];
      pixel[3] = std::min(pixel[3] + added[1], 1.0f);
    }
  });
}

}  // namespace tensorray
